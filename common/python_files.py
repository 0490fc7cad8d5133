"""Which Python files a scene may run: those below its folder, and what the user allows besides."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

_allowed: ContextVar[tuple[Path, ...]] = ContextVar("python_allowed", default=())


@contextmanager
def python_allowed(paths: Iterable[Path]) -> Iterator[None]:
    """Within its context scenes may run these Python files, and those in or below these folders."""
    before = _allowed.get()
    allow_python(paths)
    try:
        yield
    finally:
        _allowed.set(before)


def allow_python(paths: Iterable[Path]) -> None:
    """As `python_allowed`, for good."""
    _allowed.set((*_allowed.get(), *(path.resolve() for path in paths)))


def allowed_python() -> tuple[Path, ...]:
    """What is allowed besides files below the scene's folder."""
    return _allowed.get()


def check_python_file(path: Path, folder: Path) -> None:
    """Raise `ValueError` unless the file at `path`, links resolved, is below the scene's `folder`, or allowed."""
    file = path.resolve()
    if not any(file.is_relative_to(place) for place in (folder.resolve(), *_allowed.get())):
        raise ValueError(
            f'expected a Python file below the scene\'s folder, found "{file}": where you trust it, allow it with'
            f" --allow-python {file.parent}"
        )
