"""From a modal body file or a results file to a folder with grids for ParaView and pictures by PyVista."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from ...common.arrays import Indices, as_rows
from ...common.errors import InputError, SolveError, did_you_mean
from ...common.files import check_folder, write_atomically
from ...fe_models.modal_body_file import is_modal_body_file, read_modal_body
from ...results.file import Results
from ..figures.shared import file_name
from ..motion import Marker, ground_places, joint_markers, moving_bodies, targets, tool_markers, visible_exaggeration
from ..movie_file import Frame, MovieOptions, make_movie
from .vtkhdf import Grid, modes_grid, results_grid, vtkhdf_image

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
    """Draw into PNG files, in a process of its own, which VTK ends where OpenGL is missing.

    Raises `SolveError` where PyVista is not installed or cannot draw on this machine.
    """
    if find_spec("pyvista") is None:
        raise SolveError(
            "pictures need PyVista, which is not installed: pip install pyvista (with 'numpy<2' next to Debian's)"
        )
    jobs = json.dumps([asdict(picture) for picture in pictures])
    command = [sys.executable, "-c", f"from {__package__}.drawing import main; main()"]
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


FRAMES = 201  # of an animation, unless asked for otherwise


@dataclass(frozen=True)
class Options:
    """What is to be seen.

    Attributes:
        analysis: of a results file; all if None.
        frames: at most so many outputs, equally far apart.
        time: of the picture, in s; that of the largest deflection if None.
        scale: of deflections in the picture; as large as can be seen well if None.
        pictures: whether to draw pictures; None: where PyVista can.
    """

    analysis: str | None = None
    frames: int = FRAMES
    time: float | None = None
    scale: float | None = None
    pictures: bool | None = None


@dataclass(frozen=True)
class Viewed:
    """The files written, and notes on what could not be drawn."""

    paths: list[Path]
    notes: list[str]


def view_file(path: Path, folder: Path, options: Options | None = None) -> Viewed:
    """Write grids (.vtkhdf) and pictures (.png) of a modal body file or of a results file into `folder`.

    Raises `InputError` where the file cannot be read or has no such analysis, `SolveError` where a file cannot be
    written, or pictures that are asked for cannot be drawn: grids are written all the same. Where stresses of a surface
    are known there is a second picture, `.stress.png`.
    """
    options = options or Options()
    check_folder(folder)
    notes: list[str] = []
    views = _modal_body(path) if is_modal_body_file(path) else _results(path, options, notes)
    paths, pictures = [], []
    for name, grid, shown in views:
        paths.append(folder / f"{name}.vtkhdf")
        write_atomically(paths[-1], vtkhdf_image(grid), "grid", make_folder=True)
        pictures += [replace(picture, grid=str(paths[-1])) for picture in shown]
    if options.pictures is not False:
        try:
            paths += _draw(pictures, folder)
        except SolveError as error:
            if options.pictures:
                raise
            notes.append(str(error))
    return Viewed(paths, list(dict.fromkeys(notes)))


View = tuple[str, Grid, list[Picture]]  # name of its files, grid, pictures without the grid's path


def _modal_body(path: Path) -> Iterator[View]:
    body = read_modal_body(path)
    name = file_name(body.name)
    yield name, modes_grid(body), [Picture(body.name, path=f"{name}.png", length=body.length)]


def _results(path: Path, options: Options, notes: list[str]) -> Iterator[View]:
    with Results(path) as results:
        analyses = _analyses(results, options.analysis)
        times = np.concatenate([results.time(name) for name in analyses])
        if options.time is not None and not times.min() <= options.time <= times.max():
            span = f"{times.min():g} to {times.max():g} s"
            raise InputError(f"{path}: time: expected one of the run, {span}, found {options.time:g} s")
        for analysis in analyses:
            frames = chosen_frames(results, analysis, options.frames)
            grid, name = results_grid(results, analysis, frames, notes), file_name(analysis)
            colors = {"deflection": f"{name}.png", "von_mises": f"{name}.stress.png"}
            pictures = [
                replace(_snapshot(results, analysis, frames, grid, options, color), path=path)
                for color, path in colors.items()
                if color in grid.point_data
            ]
            yield name, grid, pictures


def _analyses(results: Results, wanted: str | None) -> Sequence[str]:
    if wanted is None:
        return results.analyses
    if wanted not in results.analyses:
        near = did_you_mean(wanted, results.analyses)
        raise InputError(
            f'{results.path}: analysis: expected one of {", ".join(results.analyses)}, found "{wanted}"{near}'
        )
    return [wanted]


def chosen_frames(results: Results, analysis: str, count: int) -> Indices:
    """Outputs equally far apart, the one nearest to the largest deflection moved there."""
    time = results.time(analysis)
    frames = np.linspace(0, len(time) - 1, min(len(time), count)).round().astype(np.intp)
    points = [f"{analysis}/points/{point}/deflection" for point in results.names(f"{analysis}/points")]
    peaks = [results.peak(name) for name in points if results.has(name)]
    if peaks and max(peaks)[0] > 0.0:
        peak = int(np.abs(time - max(peaks)[1]).argmin())
        frames[np.abs(frames - peak).argmin()] = peak
    return np.unique(frames)


def _snapshot(results: Results, analysis: str, frames: Indices, grid: Grid, options: Options, color: str) -> Picture:
    """At the step nearest to the time asked for, or where what it is colored by is largest."""
    assert grid.time is not None
    values = grid.point_data[color]
    largest = np.nanmax(np.linalg.norm(values, axis=2) if values.ndim == 3 else values, axis=1)
    step = int(np.argmax(largest) if options.time is None else np.argmin(np.abs(grid.time - options.time)))
    scale = visible_scale(grid, [step]) if options.scale is None else options.scale
    return motion_picture(results, analysis, frames, grid, (step,), scale, color)


def visible_scale(grid: Grid, steps: Sequence[int]) -> float:
    """How much larger deflections are drawn so that they can be seen at these steps."""
    size = max(float(np.ptp(grid.points[step], axis=0).max()) for step in steps)
    deflection = np.linalg.norm(grid.point_data["deflection"][list(steps)], axis=2)
    return visible_exaggeration(size, float(deflection.max()))


def motion_picture(
    results: Results, analysis: str, frames: Indices, grid: Grid, steps: tuple[int, ...], scale: float, color: str
) -> Picture:
    """Of the steps of a grid, which shows the outputs `frames` of an analysis."""
    assert grid.time is not None
    name, exaggerated = f"{results.name}: {analysis}", "" if scale == 1.0 else f", deformation x {scale:g}"
    braces = name.replace("{", "{{").replace("}", "}}")
    bodies = moving_bodies(results, analysis, frames[list(steps)])
    joints = joint_markers(results.scene, bodies)
    tools = tool_markers(targets(results, analysis), bodies)
    return Picture(
        f"{braces}, t = {{time}} s{exaggerated}",
        steps=steps,
        times=tuple(float(t) for t in grid.time[list(steps)]),
        scale=scale,
        color=color,
        in_space=not results.space.is_plane,
        joints=_directed(joints, scale, len(steps)),
        tools=_directed([tool for tool in tools if tool.directions.size], scale, len(steps)),
        ground=as_rows(ground_places([results.scene])),
    )


def _directed(markers: Sequence[Marker], scale: float, steps: int) -> list[list[list[list[float]]]]:
    """At each of the steps, of each marker: its place, and its directions."""
    return [
        [as_rows(np.stack([marker.exaggerated(scale)[k], *marker.directions[k]])) for marker in markers]
        for k in range(steps)
    ]


def _draw(pictures: Sequence[Picture], folder: Path) -> list[Path]:
    """Draw elsewhere first: what cannot be drawn to its end leaves no half of a picture."""
    with tempfile.TemporaryDirectory() as place:
        draw_pictures([replace(picture, path=str(Path(place) / picture.path)) for picture in pictures])
        paths = [folder / picture.path for picture in pictures]
        for path in paths:
            write_atomically(path, (Path(place) / path.name).read_bytes(), "picture")
    return paths


def view_movie(results_path: Path, path: Path, options: MovieOptions | None = None) -> list[str]:
    """As `make_movie`, rendered by PyVista."""
    if is_modal_body_file(results_path):
        raise InputError(f"{results_path}: movie: expected a results file, found a modal body: it does not move")
    return make_movie(results_path, path, options, _rendered)


def _rendered(
    results: Results, analysis: str, outputs: Indices, shown: Indices, scale: float | None, notes: list[str]
) -> Iterator[Frame]:
    from PIL import Image

    grid, steps = results_grid(results, analysis, outputs, notes), tuple(range(len(outputs)))
    scale = visible_scale(grid, steps) if scale is None else scale
    picture = motion_picture(results, analysis, outputs, grid, steps, scale, "deflection")
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "grid.vtkhdf"
        write_atomically(file, vtkhdf_image(grid), "grid", ours=True)
        draw_pictures([replace(picture, grid=str(file), path=place, movie=True)])
        for k in shown:
            with Image.open(Path(place) / f"{k:05d}.png") as image:
                yield np.asarray(image.convert("RGB"))
