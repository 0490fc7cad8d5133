"""What the command line does, for use from Python; paths may be text."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .common.files import AnyPath

if TYPE_CHECKING:
    from .design.finding import Finding
    from .fe_models.link import LinkOutcome
    from .fe_models.modal_body import ModalBody
    from .results.file import Results
    from .run.solution import Solution
    from .run.watcher import Watcher
    from .scene.scene import Scene


def solve(
    scene: Scene | AnyPath,
    output: AnyPath | None = None,
    watcher: Watcher | None = None,
    *,
    resume: bool = False,
    allow_python: Sequence[AnyPath] = (),
) -> Results:
    """Run the analyses of a scene, or of a scene file, and return the results: `ffrobot solve`.

    They are written to `output` where one is given, and kept in memory otherwise. `watcher` is told how it goes.
    Python files that a scene file names run from below its folder, and from `allow_python` (files and folders).
    `resume` goes on with a run that was stopped, from `output`; functions of Python have to be the same then.
    Raises `InputError` for anything wrong with the scene, `SolveError` where an analysis does not reach its end; what
    was computed until then is in `output` all the same. Warns (`FfrobotWarning`) where results may be wrong, or do not
    mean what they seem to; `Results.warnings` has the same texts.
    """
    from .common.errors import FfrobotWarning, InputError
    from .common.files import check_output
    from .common.outputs import protected
    from .results.file import FORMAT, Results
    from .results.resume import resume_scene
    from .results.stopped import how_to_go_on
    from .results.write import results_image, write_results
    from .run.inputs import files_of, files_of_tables
    from .run.solve import solve_scene
    from .run.watcher import Watcher

    path = None if output is None else Path(output)
    inputs = files_of(Path(scene)) if isinstance(scene, str | PathLike) else files_of_tables(scene.path, scene.text)
    if path is not None:
        with protected(inputs):
            check_output(path, FORMAT)
    elif resume:
        raise InputError("solve: resume: expected the output of the run that was stopped, found none")

    def keep(solution: Solution) -> None:
        if path is not None:
            with protected(inputs):
                write_results(solution, path)

    if isinstance(scene, str | PathLike):
        scene = load_scene(scene, allow_python=allow_python)
    watcher = watcher or Watcher()
    if path is not None and resume:
        solution = resume_scene(scene, path, watcher, keep)
        if solution is None:
            return Results(path)
    else:
        solution = solve_scene(scene, watcher, keep)
    for name, result in solution.analyses.items():
        for text in result.warnings:
            warnings.warn(f'{scene.path}: analysis "{name}": {text}', FfrobotWarning, stacklevel=2)
    for run in solution.outcomes.values():
        run.check_completed(how_to_go_on(solution, "solve(…, resume=True)") if path is not None else "")
    return Results(path) if path is not None else Results.from_image(results_image(solution), scene.path)


def load_scene(path: AnyPath, *, allow_python: Sequence[AnyPath] = ()) -> Scene:
    """Read and validate a scene file, `allow_python` as in `solve`. Raises `InputError`, a line for each wrong key."""
    from .common.python_files import python_allowed
    from .scene.load import load_scene as load

    with python_allowed(Path(place) for place in allow_python):
        return load(Path(path))


def make_link(link: AnyPath | Mapping[str, Any], output: AnyPath | None = None, *, force: bool = False) -> LinkOutcome:
    """Compute the modal body of a link unless it is up to date: `ffrobot link`. See `fe_models.link`.

    `link` is a link file or a dictionary of its keys, whose modal body goes to the user's cache without `output`.
    """
    from .common.validation import plain
    from .fe_models.link import make_link
    from .fe_models.link_file import LinkTable

    source = LinkTable(plain(link), Path("<link made in Python>")) if isinstance(link, Mapping) else Path(link)
    return make_link(source, None if output is None else Path(output), force)


def write_study(found: Finding, folder: AnyPath, *, figures: bool = True) -> list[Path]:
    """Write what the design functions return as files for `write_report`, and as figures; the files written."""
    from .common.extras import extras

    with extras():
        return list(found.write_study(Path(folder), figures=figures))


def read_modal_body(path: AnyPath) -> ModalBody:
    """Read and check a modal body file. Raises `InputError` naming what is wrong with it."""
    from .fe_models.modal_body_file import read_modal_body

    return read_modal_body(Path(path))


def plot_results(
    results: AnyPath | Results, folder: AnyPath, formats: Sequence[str] = ("png", "pdf"), *, only: Sequence[str] = ()
) -> list[Path]:
    """Draw the figures of results into `folder`: `ffrobot plot`. Returns the files written.

    `formats` are "png", "pdf", "svg"; `only` names of figures that are wanted, or patterns such as "moment_*".
    """
    from .common.extras import extras

    with extras(), _files(results) as (path,):
        from .pictures.figures.plot import plot_results

        return plot_results(path, Path(folder), formats, only)


def write_report(results: AnyPath | Results | Sequence[AnyPath | Results], path: AnyPath) -> None:
    """Write one HTML page about results, or several side by side: `ffrobot report`.

    Folders of `sensitivity`, `optimise`, `trade_off`, `uncertainty` and `screening` may be among them, or alone.
    """
    from .common.extras import extras
    from .common.outputs import protected
    from .pictures.studies.study import study_files
    from .results.file import Results

    several = [results] if isinstance(results, str | PathLike | Results) else results
    studies = [file for r in several if not isinstance(r, Results) for file in study_files(Path(r))]
    solved = [r for r in several if isinstance(r, Results) or not study_files(Path(r))]
    with extras(), protected(studies), _files(*solved) as paths:
        from .pictures.report import write_report

        write_report([*paths, *studies], Path(path))


def view_file(
    file: AnyPath | Results,
    folder: AnyPath,
    *,
    analysis: str | None = None,
    frames: int | None = None,
    time: float | None = None,
    scale: float | None = None,
    pictures: bool | None = None,
) -> list[Path]:
    """Write grids for ParaView, and pictures, of results or of a modal body file: `ffrobot view`.

    `frames` outputs at most of one `analysis`, or of all; the picture at `time` (s) with deflections `scale` times as
    large. `pictures`: whether to draw them; None: where PyVista can. Returns the files written.
    """
    from .pictures.view.view import FRAMES, Options, view_file

    with _files(file) as (path,):
        return view_file(path, Path(folder), Options(analysis, frames or FRAMES, time, scale, pictures)).paths


def write_movie(
    results: AnyPath | Results,
    path: AnyPath,
    *,
    analysis: str | None = None,
    seconds: float | None = None,
    scale: float | None = None,
    rendered: bool = False,
) -> None:
    """Write a movie of the motion, .gif or .mp4: `ffrobot plot --movie`; `rendered` by PyVista: `view --movie`.

    Of one `analysis`, the first that goes through time if None; it plays for 8 s or so many `seconds`, with deflections
    `scale` times as large, by default as large as can be seen.
    """
    from .common.extras import extras

    with extras(), _files(results) as (file,):
        from .pictures.figures.movie import write_motion
        from .pictures.movie_file import SECONDS, MovieOptions
        from .pictures.view import view_movie

        (view_movie if rendered else write_motion)(
            file, Path(path), MovieOptions(analysis, SECONDS if seconds is None else seconds, scale)
        )


@contextmanager
def _files(*results: AnyPath | Results) -> Iterator[list[Path]]:
    """The files of results, to be read; of those in memory, temporary ones."""
    from .common.hdf5 import reading
    from .results.file import Results

    with ExitStack() as stack:
        paths = [stack.enter_context(r.on_disk()) if isinstance(r, Results) else Path(r) for r in results]
        stack.enter_context(reading(*paths))
        yield paths
