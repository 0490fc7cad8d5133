"""Pictures of grids by PyVista, without a window; in a process of its own, which VTK ends where OpenGL is missing."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.util import find_spec

from ...common.errors import SolveError
from . import drawing

SECONDS = 300.0  # after which a machine that cannot draw is given up …
SECONDS_A_FRAME = 5.0  # … and so many more for each picture of a movie

Place = Sequence[float]  # three


@dataclass(frozen=True)
class Picture:
    """A picture to be drawn, or the frames of a movie.

    Attributes:
        title: above it.
        grid: the .vtkhdf file.
        path: of the PNG; of a movie, of a folder for one at each step, `00000.png` and so on.
        steps: of the grid's time steps; one, but of a movie.
        times: of these, in s; the title's `{time}`.
        scale: of deflections; None for a modal body, whose modes are drawn.
        length: of a modal body, in m.
        in_space: whether z goes up, as in 3D scenes; y in planar ones.
        color: "deflection" or "von_mises".
        joints: for each of the steps joints: a place, exaggerated, in m, and the unit vectors of its axes.
        tools: likewise sections that follow paths: a place and the unit vectors x, y, z.
        ground: where joints sit on the ground, in m.
        movie: whether it is one.
    """

    title: str
    grid: str = ""
    path: str = ""
    steps: tuple[int, ...] = (0,)
    times: tuple[float, ...] = (0.0,)
    scale: float | None = None
    length: float = 0.0
    in_space: bool = False
    color: str = "deflection"
    joints: Sequence[Sequence[Sequence[Place]]] = ((),)
    tools: Sequence[Sequence[Sequence[Place]]] = ((),)
    ground: Sequence[Place] = ()
    movie: bool = False


def draw_pictures(pictures: Sequence[Picture]) -> None:
    """Draw into PNG files. Raises `SolveError` where PyVista is not installed or cannot draw on this machine."""
    if find_spec("pyvista") is None:
        raise SolveError(
            "pictures need PyVista, which is not installed: pip install pyvista (with 'numpy<2' next to Debian's)"
        )
    jobs = json.dumps([asdict(picture) for picture in pictures])
    command = [sys.executable, "-c", f"from {drawing.__name__} import main; main()"]
    seconds = SECONDS + SECONDS_A_FRAME * sum(len(picture.steps) for picture in pictures)
    try:
        done = subprocess.run(
            command, input=jobs, capture_output=True, text=True, errors="replace", timeout=seconds, encoding="utf-8"
        )
    except subprocess.TimeoutExpired:
        raise SolveError(f"PyVista did not finish its pictures within {seconds:g} s") from None
    if done.returncode < 0:
        raise SolveError(
            "PyVista cannot draw on this machine: expected OpenGL through EGL, OSMesa or an X server, found none that"
            " works (Debian: apt install libegl1 libgl1-mesa-dri)"
        )
    if done.returncode:
        reason = (done.stderr.strip().splitlines() or ["no reason given"])[-1]
        raise SolveError(f"PyVista failed: {reason}")
