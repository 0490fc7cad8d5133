"""The eigenproblem of a solid: its mass with what is attached, and its flexibility under supports."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from ...common.arrays import Array
from .elasticity import SolidModel


class Mass:
    """M, with what is attached to interfaces: M u + Σ Bᵀ diag(w) B u.

    Args:
        model: has the mass of the part itself.
        attached: for each attached mass B (6, 3 owned), the mean motion of its interface, and w (6,), its weights.
    """

    def __init__(self, model: SolidModel, attached: Sequence[tuple[Array, Array]] = ()) -> None:
        self.model, self.attached = model, attached

    def __matmul__(self, U: Array) -> Array:
        """M U of U (3 owned, n); collective."""
        product = self.model.mass @ U
        for B, weights in self.attached:
            product = product + B.T @ (weights[:, None] * self.model.total(B @ U))
        return product

    def motion_of_attached(self, U: Array) -> list[tuple[Array, Array]]:
        """For each attached mass its motion (6, n) and weights (6,); collective."""
        return [(self.model.total(B @ U), weights) for B, weights in self.attached]


class Inverse(Protocol):
    """The flexibility of a held body: `supports.Flexibility`, or held at interfaces besides."""

    model: SolidModel

    @property
    def rank(self) -> int:
        """Number of independent displacements."""

    def __matmul__(self, loads: Array) -> Array:
        """Displacements under loads (3 owned, k); collective."""

    def allowed(self, U: Array) -> Array:
        """U (3 owned, k) less what the supports do not allow; collective."""
