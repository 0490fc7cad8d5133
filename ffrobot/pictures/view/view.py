"""From a modal body file or a results file to a folder with grids for ParaView and pictures by PyVista.

Grids are VTK's unstructured ones in HDF5, written without VTK (docs.vtk.org, "VTKHDF format specification", version
2.0; ParaView 5.12): cells once, points and data at each time step.
"""

import pickle
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import field, replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from ...common.arrays import Array, Indices, Integers, NDArray
from ...common.errors import InputError, SolveError, check_known
from ...common.files import check_folder, write_atomically
from ...common.hdf5 import image_of, in_memory
from ...common.structs import struct
from ...fe_models.modal_body_file import is_modal_body_file, read_modal_body
from ...mbs.quantities.stress import surface_stress, von_mises
from ...results.file import Results
from ..figures.shared import file_name
from ..motion import (
    Marker,
    chosen_frames,
    ground_places,
    joint_markers,
    moving_bodies,
    targets,
    tool_markers,
    visible_exaggeration,
)
from ..movie_file import Frame, MovieOptions, make_movie
from ..shapes import body_surface, numbered_cells, surface_shape

# VTK's number of the cell with so many corners: vertex, line, triangle, quadrilateral.
CELL_TYPE = {1: 1, 2: 3, 3: 5, 4: 9}


@struct
class Grid:
    """Cells on P points that move over T steps; SI units."""

    cells: Sequence[Integers]  # blocks (c, v) of c cells with v corners each
    points: Array  # (T, P, 3) in m, global axes
    time: Array | None = None  # (T,) in s; None for a grid that does not move, T = 1
    point_data: Mapping[str, Array] = field(default_factory=dict)  # (T, P) or (T, P, 3) by name
    # (C,) by name, for the C cells of all blocks
    cell_data: Mapping[str, NDArray[np.generic]] = field(default_factory=dict)


def vtkhdf_image(grid: Grid) -> bytes:
    """Serialize a grid as VTKHDF bytes, reproducibly; points are rounded to 7 digits."""
    corners = np.concatenate([np.full(len(block), block.shape[1]) for block in grid.cells])
    connectivity = np.concatenate([block.ravel() for block in grid.cells])
    moved = {"Points": grid.points} | {f"PointData/{name}": values for name, values in grid.point_data.items()}
    arrays: dict[str, NDArray[np.generic]] = {
        "NumberOfPoints": np.array([grid.points.shape[1]]),
        "NumberOfCells": np.array([len(corners)]),
        "NumberOfConnectivityIds": np.array([len(connectivity)]),
        "Connectivity": connectivity,
        "Offsets": np.append(0, np.cumsum(corners)),
        "Types": np.array([CELL_TYPE[v] for v in corners], dtype=np.uint8),
        **{name: values.reshape(-1, *values.shape[2:]).astype(np.float32) for name, values in moved.items()},
        **{f"CellData/{name}": values for name, values in grid.cell_data.items()},
    }
    if grid.time is not None:  # points of each step and their data follow those of the step before
        same = np.zeros(len(grid.time), dtype=np.int64)
        own = np.arange(len(grid.time)) * grid.points.shape[1]
        arrays |= {
            "Steps/Values": grid.time,
            "Steps/NumberOfParts": np.ones_like(same),
            "Steps/PartOffsets": same,
            "Steps/PointOffsets": own,
            "Steps/CellOffsets": same[:, None],
            "Steps/ConnectivityIdOffsets": same[:, None],
            **{f"Steps/PointDataOffsets/{name}": own for name in grid.point_data},
            **{f"Steps/CellDataOffsets/{name}": same for name in grid.cell_data},
        }
    with in_memory() as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array([2, 0])
        root.attrs["Type"] = np.bytes_("UnstructuredGrid")
        for name, values in arrays.items():
            packed = {"compression": "gzip", "compression_opts": 1, "shuffle": True} if values.size > 1000 else {}
            root.create_dataset(name, data=values, track_times=False, **packed)
        if grid.time is not None:
            root["Steps"].attrs["NSteps"] = len(grid.time)
        return image_of(file)


def results_grid(results: Results, analysis: str, frames: Indices, notes: list[str]) -> Grid:
    """Return the bodies of an analysis at the outputs `frames` (T,), with positions r, m, global axes.

    Point data, m, global axes: `deflection`, and `exaggeration`: r + (s − 1) exaggeration shows deformations s times
    as large with closed joints. `von_mises`, Pa, where stresses of a surface are known. Cell data: `body`, its number
    in the scene. Adds to `notes` on missing parts.
    """
    bodies = moving_bodies(results, analysis, frames)
    shapes = [surface_shape(results, body, notes) for body in bodies]
    parts = list[tuple[Array, Array, Array]]()
    for shape, body in zip(shapes, bodies, strict=True):
        deflection = shape.deflection
        stress = np.full(deflection.shape[:2], np.nan)
        if results.has(f"{analysis}/stress/{body.name}/surface"):
            with suppress(InputError):  # a note where its surface is drawn
                link = results.modal_body(body.name)
                stress = von_mises(surface_stress(link, results.stress_recovery(analysis, body.name).at(frames)))
        parts.append((deflection, deflection + body.shift[:, None], stress))
    joined = (np.concatenate(each, axis=1) for each in zip(*parts, strict=True))
    data = dict(zip(("deflection", "exaggeration", "von_mises"), joined, strict=True))
    if np.isnan(data["von_mises"]).all():
        del data["von_mises"]
    numbers = [body["name"] for body in results.scene["body"]]
    return Grid(
        cells=numbered_cells(shapes),
        points=np.concatenate([shape.placed() for shape in shapes], axis=1),
        time=results.time(analysis)[frames],
        point_data=data,
        cell_data={"body": np.repeat([numbers.index(b.name) for b in bodies], [len(s.cells) for s in shapes])},
    )


SECONDS = 300.0  # after which a machine that cannot draw is given up …
SECONDS_A_FRAME = 5.0  # … and so many more for each picture of a movie


@struct
class Picture:
    """A picture to be drawn, or the frames of a movie; SI units."""

    titles: Sequence[str]  # above it, at each of its steps
    grid: str = ""  # the .vtkhdf file
    path: str = ""  # the PNG; for a movie the folder of a PNG at each step, `00000.png` and so on
    steps: tuple[int, ...] = (0,)  # numbers of the grid's time steps; one, except for movies
    scale: float | None = None  # exaggeration of deflections; None for a modal body, whose modes are drawn
    length: float = 0.0  # length of a modal body, m
    in_space: bool = False  # whether z goes up, as in 3D scenes; y in planar ones
    color: str = "deflection"  # "deflection" or "von_mises"
    joints: Sequence[Marker] = ()  # at each of the steps
    tools: Sequence[Marker] = ()  # likewise sections that follow paths
    ground: Array = field(default_factory=lambda: np.zeros((0, 3)))  # (g, 3) joints on the ground, m, global axes
    movie: bool = False  # whether these are frames of a movie


def draw_pictures(pictures: Sequence[Picture]) -> None:
    """Draw PNG files in a separate process, which VTK ends if OpenGL is missing.

    Raises:
        SolveError: PyVista is not installed, or cannot draw on this machine.
    """
    if find_spec("pyvista") is None:
        raise SolveError(
            "pictures need PyVista, which is not installed: pip install pyvista (with 'numpy<2' next to Debian's)"
        )
    command = [sys.executable, "-c", f"from {__package__}.drawing import main; main()"]
    seconds = SECONDS + SECONDS_A_FRAME * sum(len(picture.steps) for picture in pictures)
    try:
        done = subprocess.run(command, input=pickle.dumps(pictures), capture_output=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        raise SolveError(f"PyVista did not finish its pictures within {seconds:g} s") from None
    if done.returncode < 0:
        raise SolveError(
            "PyVista cannot draw on this machine: expected OpenGL through EGL, OSMesa or an X server",
            "none that works (Debian: apt install libegl1 libgl1-mesa-dri)",
        )
    if done.returncode:
        reason = (done.stderr.decode(errors="replace").strip().splitlines() or ["no reason given"])[-1]
        raise SolveError(f"PyVista failed: {reason}")


FRAMES = 201  # of an animation, unless asked for otherwise


@struct
class Options:
    """Options of grids and pictures."""

    analysis: str | None = None  # analysis of a results file; None: all
    frames: int = FRAMES  # largest number of outputs, equally far apart
    time: float | None = None  # time of the picture, s; None: that of the largest deflection
    scale: float | None = None  # exaggeration of deflections in the picture; None: chosen for visibility
    pictures: bool | None = None  # whether to draw pictures; None: where PyVista can


@struct
class Viewed:
    """Files written, and notes on what could not be drawn."""

    paths: list[Path]
    notes: list[str]


def view_file(path: Path, folder: Path, options: Options | None = None) -> Viewed:
    """Write grids (.vtkhdf) and pictures (.png) of a modal body file or of a results file into `folder`.

    Where stresses of a surface are known there is a second picture, `.stress.png`.

    Raises:
        InputError: the file cannot be read, or has no such analysis.
        SolveError: a file cannot be written, or requested pictures cannot be drawn, after grids are written.
    """
    options = options or Options()
    check_folder(folder)
    notes: list[str] = []
    views = _modal_body(path) if is_modal_body_file(path) else _results(path, options, notes)
    paths, pictures = list[Path](), list[Picture]()
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


Views = Iterable[tuple[str, Grid, list[Picture]]]
"""Names of files, grids, and pictures whose `grid` is still empty."""


def _modal_body(path: Path) -> Views:
    """Of the surface of a link, undeformed, with every mode as a vector: displacement per unit of modal coordinate."""
    body = read_modal_body(path)
    mesh, name = body_surface(body), file_name(body.name)
    modes = {
        f"mode {k + 1:02d}, {body.frequency[k]:.5g} Hz, {family}": mesh.mode_shapes[None, :, :, k]
        for k, family in enumerate(body.family)
    }
    grid = Grid([mesh.cells], mesh.points[None], point_data=modes)
    return [(name, grid, [Picture([body.name], path=f"{name}.png", length=body.length)])]


def _results(path: Path, options: Options, notes: list[str]) -> Views:
    with Results(path) as results:
        analyses = results.analyses
        if options.analysis is not None:
            check_known(options.analysis, analyses, f"{path}: analysis: expected one of {', '.join(analyses)}")
            analyses = [options.analysis]
        times = np.concatenate([results.time(name) for name in analyses])
        if options.time is not None and not times.min() <= options.time <= times.max():
            span = f"{times.min():g} to {times.max():g} s"
            raise InputError(f"{path}: time: expected one of the run, {span}", f"{options.time:g} s")
        for analysis in analyses:
            frames = chosen_frames(results, analysis, options.frames)
            grid, name = results_grid(results, analysis, frames, notes), file_name(analysis)
            pictures = []
            for color, suffix in (("deflection", ""), ("von_mises", ".stress")):
                if color in grid.point_data:
                    steps = (_step(grid, options.time, color),)
                    picture = _motion(results, analysis, frames, grid, steps, scale=options.scale, color=color)
                    pictures.append(replace(picture, path=f"{name}{suffix}.png"))
            yield name, grid, pictures


def _step(grid: Grid, time: float | None, color: str) -> int:
    """That nearest to `time`; without one, that at which what it is colored by is largest."""
    if time is not None and grid.time is not None:
        return int(np.argmin(np.abs(grid.time - time)))
    values = grid.point_data[color]
    return int(np.argmax(np.nanmax(np.linalg.norm(values, axis=2) if values.ndim == 3 else values, axis=1)))


def _motion(
    results: Results, analysis: str, frames: Indices, grid: Grid, steps: tuple[int, ...], *,
    scale: float | None, color: str = "deflection",
) -> Picture:  # fmt: skip
    """The picture of some steps of a grid, whose steps are the outputs `frames` of an analysis."""
    assert grid.time is not None
    some = list(steps)
    if scale is None:
        size = np.ptp(grid.points[some], axis=1).max()
        scale = visible_exaggeration(float(size), np.linalg.norm(grid.point_data["deflection"][some], axis=2).max())
    exaggerated = "" if scale == 1.0 else f", deformation x {scale:g}"
    bodies = moving_bodies(results, analysis, frames[some])
    return Picture(
        [f"{results.name}: {analysis}, t = {time:.4g} s{exaggerated}" for time in grid.time[some]],
        steps=steps,
        scale=scale,
        color=color,
        in_space=not results.space.is_plane,
        joints=joint_markers(results.scene, bodies),
        tools=tool_markers(targets(results, analysis), bodies),
        ground=ground_places([results.scene]),
    )


def _draw(pictures: Sequence[Picture], folder: Path) -> list[Path]:
    """Draw elsewhere first: what cannot be drawn to its end leaves no half of a picture."""
    with tempfile.TemporaryDirectory() as place:
        draw_pictures([replace(picture, path=str(Path(place) / picture.path)) for picture in pictures])
        paths = [folder / picture.path for picture in pictures]
        for path in paths:
            write_atomically(path, (Path(place) / path.name).read_bytes(), "picture")
    return paths


def view_movie(results_path: Path, path: Path, options: MovieOptions | None = None) -> list[str]:
    """Write a movie of a results file by PyVista; return notes on simplifications (`make_movie`)."""
    if is_modal_body_file(results_path):
        raise InputError(f"{results_path}: movie: expected a results file", "a modal body: it does not move")
    return make_movie(results_path, path, options, _rendered)


def _rendered(
    results: Results, analysis: str, outputs: Indices, scale: float | None, notes: list[str]
) -> Iterator[Frame]:
    from PIL import Image

    grid, steps = results_grid(results, analysis, outputs, notes), tuple(range(len(outputs)))
    picture = _motion(results, analysis, outputs, grid, steps, scale=scale)
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "grid.vtkhdf"
        write_atomically(file, vtkhdf_image(grid), "grid", ours=True)
        draw_pictures([replace(picture, grid=str(file), path=place, movie=True)])
        for k in steps:
            with Image.open(Path(place) / f"{k:05d}.png") as image:
                yield np.asarray(image.convert("RGB"))
