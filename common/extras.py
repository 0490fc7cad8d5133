"""Libraries that only some of the program needs: what to say where one is not installed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from .errors import SolveError

SAME = ("matplotlib", "plotly", "jinja2", "pyvista", "pandas", "xarray", "control", "rosbags")
PACKAGES = {name: name for name in SAME} | {"imageio_ffmpeg": "imageio-ffmpeg", "trimesh": "trimesh pycollada"}
"""What pip installs for each of these libraries."""


def missing(error: ModuleNotFoundError) -> str | None:
    """What to install where one of these libraries is not there; None for any other."""
    library = (error.name or "").partition(".")[0]
    if library not in PACKAGES:
        return None
    return f"this needs {library}, which is not installed: pip install {PACKAGES[library]}"


@contextmanager
def extras() -> Iterator[None]:
    """Turn the lack of one of these libraries into `SolveError`."""
    try:
        yield
    except ModuleNotFoundError as error:
        if (message := missing(error)) is None:
            raise
        raise SolveError(message) from None
