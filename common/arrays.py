"""Names for the types of arrays, in annotations (shapes and units stand in docstrings); null spaces."""

from typing import Any, TypeVar

import numpy as np

Scalar = TypeVar("Scalar", bound=np.generic)

NDArray = np.ndarray[Any, np.dtype[Scalar]]  # as numpy.typing has it, which every start would wait for
Array = NDArray[np.floating[Any]]  # float64; NumPy's types leave that open for linspace, inv and quotients
ComplexArray = NDArray[np.complex128]
Integers = NDArray[np.int64]
Indices = NDArray[np.intp]
Booleans = NDArray[np.bool_]
PPoly = Any  # scipy.interpolate.PPoly, of which type checkers know nothing, and which a start does not load


def in_parts(count: int, size: int) -> list[slice]:
    """Slices of `count` numbers, of `size` each and the last of what is left."""
    return [slice(k, k + size) for k in range(0, count, size)]


def null_space(J: Array, tolerance: float) -> Array:
    """Orthonormal basis (k, m), no unit, of J's null space: singular values up to `tolerance` times the largest.

    J (r, k) is in any unit.
    """
    _, sizes, V = np.linalg.svd(J)
    return V[np.count_nonzero(sizes > tolerance * sizes.max(initial=0.0)) :].T
