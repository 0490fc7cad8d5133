"""What a function of Python depends on, as far as it is known: a digest that changes when the function does."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from types import CodeType, ModuleType
from typing import Any

import numpy as np

from .python_files import own_file, sha256_of

DEPTH = 6  # of functions in functions, lists in lists


def digest_of_function(function: object) -> str:
    """Of code, constants, defaults, enclosed and global values that it uses; of objects that can be called, theirs.

    Of the user's own modules that it names, of their files.
    """
    digest = hashlib.sha256()
    for part in _parts(function, DEPTH):
        digest.update(part + b"\0")
    return digest.hexdigest()[:12]


def _parts(value: Any, depth: int) -> Iterator[bytes]:  # noqa: ANN401 (whatever a function may use)
    if depth == 0:
        return
    code = getattr(value, "__code__", None)
    if isinstance(value, np.ndarray):
        yield repr((value.dtype.str, value.shape)).encode() + value.tobytes()
    elif value is None or isinstance(value, bool | int | float | complex | str | bytes | np.generic):
        yield repr(value).encode()
    elif isinstance(value, list | tuple | set | frozenset):
        for item in sorted(value, key=repr) if isinstance(value, set | frozenset) else value:
            yield from _parts(item, depth - 1)
    elif isinstance(value, dict):
        for key, item in value.items():
            yield repr(key).encode()
            yield from _parts(item, depth - 1)
    elif isinstance(code, CodeType):
        yield from _function(value, code, depth)
    elif hasattr(value, "__wrapped__") or hasattr(value, "func"):  # compiled by numba, functools.partial
        for name in ("__wrapped__", "func", "args", "keywords"):
            yield from _parts(getattr(value, name, None), depth - 1)
    elif isinstance(value, ModuleType):
        yield value.__name__.encode()
        if (file := own_file(value)) is not None:
            yield sha256_of(file).encode()
    else:  # an object that can be called: by its name and what it holds
        yield f"{type(value).__module__}.{type(value).__qualname__}".encode()
        if type(value).__name__ not in ("type", "builtin_function_or_method"):
            yield from _parts(getattr(type(value).__call__, "__func__", type(value).__call__), depth - 1)
            yield from _parts(getattr(value, "__dict__", None), depth - 1)


def _function(function: Any, code: CodeType, depth: int) -> Iterator[bytes]:  # noqa: ANN401
    yield from _code(code)
    for cell in getattr(function, "__closure__", None) or ():
        yield from _parts(_content(cell), depth - 1)
    for values in (getattr(function, "__defaults__", None), getattr(function, "__kwdefaults__", None)):
        yield from _parts(values, depth - 1)
    known = getattr(function, "__globals__", {})
    for name in sorted(_names(code)):
        if name in known:
            yield name.encode()
            yield from _parts(known[name], depth - 1)
    yield from _parts(getattr(getattr(function, "__self__", None), "__dict__", None), depth - 1)


def _code(code: CodeType) -> Iterator[bytes]:
    yield code.co_code
    yield repr(code.co_names).encode()
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _code(constant)
        elif isinstance(constant, frozenset):  # in another order in every process
            yield repr(sorted(constant, key=repr)).encode()
        else:
            yield repr(constant).encode()


def _names(code: CodeType) -> set[str]:
    """Global names of a function and of functions inside it."""
    inner = (constant for constant in code.co_consts if isinstance(constant, CodeType))
    return set(code.co_names).union(*map(_names, inner))


def _content(cell: Any) -> object:  # noqa: ANN401
    try:
        return cell.cell_contents
    except ValueError:  # empty yet
        return None
