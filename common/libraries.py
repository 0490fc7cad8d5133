"""Libraries that only some runs need: imported when one of their names is used; what to say where one is missing."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from .errors import SolveError


class _OnUse:
    """A library that is imported by the first use of a name; later uses find the name here."""

    def __init__(self, library: str) -> None:
        self._library = library

    def __getattr__(self, name: str) -> Any:
        value = getattr(import_module(self._library), name)
        setattr(self, name, value)
        return value


scipy: Any = _OnUse("scipy")


PACKAGES = {"imageio_ffmpeg": "imageio-ffmpeg", "trimesh": "trimesh pycollada"}
"""What pip installs for libraries that it does not have under their own name."""
ELSEWHERE = ("dolfinx", "basix", "ufl", "ffcx", "petsc4py", "slepc4py", "mpi4py")
"""Libraries of finite elements, which come with dolfinx."""


def missing(error: ModuleNotFoundError) -> str | None:
    """Return a message on what to install for a missing module; None for a module of ffrobot."""
    library = (error.name or "").partition(".")[0]
    if library in ("", __name__.partition(".")[0]):
        return None
    how = "install dolfinx (Debian: python3-dolfinx)"
    if library not in ELSEWHERE:
        how = f"pip install {PACKAGES.get(library, library)}"
    return f"this needs {library}, which is not installed: {how}"


@contextmanager
def extras() -> Iterator[None]:
    """Context that turns a missing library into `SolveError`, which says what to install."""
    try:
        yield
    except ModuleNotFoundError as error:
        if (message := missing(error)) is None:
            raise
        raise SolveError(message) from None
