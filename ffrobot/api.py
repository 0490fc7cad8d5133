"""What the command line does, for use from Python; paths may be text."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from .design.front import Front
    from .design.optimise import Method
    from .design.optimum import Optimum
    from .design.record import Sensitivity
    from .design.screening import Screening
    from .design.studies import Found
    from .design.uncertainty import Uncertainty
    from .fe_models.link import LinkOutcome
    from .fe_models.modal_body import ModalBody
    from .fit import Fit
    from .results.file import Results
    from .run.solution import Solution
    from .run.watcher import Watcher
    from .scene.scene import Scene

AnyPath = str | PathLike[str]


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


def fit_measured(
    file: AnyPath,
    measured: AnyPath,
    vary: Sequence[str],
    output: AnyPath | None = None,
    *,
    motors: Literal["free", "held"] | None = None,
    force: bool = False,
) -> Fit:
    """Fit keys of a link or a scene file to measured natural frequencies: `ffrobot fit`. See `fit.fitting`."""
    from .fit import fit_measured

    where = None if output is None else Path(output)
    return fit_measured(Path(file), Path(measured), vary, where, motors=motors, force=force)


def sensitivity(
    scene: AnyPath,
    of: Sequence[str],
    to: Sequence[str],
    output: AnyPath | None = None,
    *,
    processes: int = 1,
    step: float = 0.01,
    tolerance: float | None = None,
    allow_python: Sequence[AnyPath] = (),
) -> Sensitivity:
    """Derivatives of scalar results `of` a scene file by the numbers at keys `to`: `ffrobot sensitivity`.

    Runs stay in the folder `output`, and are not run again; without one they are forgotten. See `design.sensitivity`.
    """
    from .design.sensitivity import sensitivity

    with _designs(Path(scene), output, allow_python) as folder:
        found = sensitivity(Path(scene), of, to, folder, processes=processes, step=step, tolerance=tolerance)
    return found if output is not None else replace(found, table=None)


def optimise(
    scene: AnyPath,
    vary: Sequence[str],
    output: AnyPath | None = None,
    *,
    minimise: str | None = None,
    maximise: str | None = None,
    subject_to: Sequence[str] = (),
    method: Method = "auto",
    starts: int = 1,
    seed: int = 0,
    runs: int = 1000,
    processes: int = 1,
    tolerance: float = 1e-8,
    allow_python: Sequence[AnyPath] = (),
) -> Optimum:
    """The design with the least, or largest, goal within limits: `ffrobot optimise`, whose options these are.

    Where no design keeps the limits the nearest one is returned, not `feasible`. Runs stay in the folder `output`, and
    are not run again; without one they are forgotten. See `design.optimise`.
    """
    from .design.optimise import optimise

    with _designs(Path(scene), output, allow_python) as folder:
        found = optimise(
            Path(scene), vary, folder, minimise=minimise, maximise=maximise, subject_to=subject_to, method=method,
            starts=starts, seed=seed, most=runs, processes=processes, tolerance=tolerance,
        )  # fmt: skip
    return found if output is not None else replace(found, best_scene=None, designs=None)


def trade_off(
    scene: AnyPath,
    vary: Sequence[str],
    output: AnyPath | None = None,
    *,
    minimise: str,
    against: str,
    points: int = 8,
    subject_to: Sequence[str] = (),
    runs: int = 1000,
    processes: int = 1,
    tolerance: float = 1e-8,
    allow_python: Sequence[AnyPath] = (),
) -> Front:
    """The least of one goal for each of `points` values of another: `ffrobot optimise … --against`.

    Runs stay in the folder `output`, and are not run again; without one they are forgotten. See `design.front`.
    """
    from .design.front import trade_off

    with _designs(Path(scene), output, allow_python) as folder:
        return trade_off(
            Path(scene), vary, folder, minimise=minimise, against=against, points=points, subject_to=subject_to,
            most=runs, processes=processes, tolerance=tolerance,
        )  # fmt: skip


@contextmanager
def _designs(scene: Path, output: AnyPath | None, allow_python: Sequence[AnyPath]) -> Iterator[Path]:
    """The folder of designs of a scene file, a temporary one without `output`."""
    from tempfile import TemporaryDirectory

    from .common.outputs import protected
    from .common.python_files import python_allowed
    from .run.inputs import files_of

    with ExitStack() as stack:
        folder = output if output is not None else stack.enter_context(TemporaryDirectory())
        stack.enter_context(protected(files_of(scene)))
        stack.enter_context(python_allowed(Path(place) for place in allow_python))
        yield Path(folder)


def uncertainty(
    scene: AnyPath,
    of: Sequence[str],
    spread: Sequence[str],
    output: AnyPath | None = None,
    *,
    samples: int = 200,
    seed: int = 0,
    by: Literal["samples", "gradients"] = "samples",
    indices: bool = False,
    processes: int = 1,
    allow_python: Sequence[AnyPath] = (),
) -> Uncertainty:
    """Statistics of goals and histories `of` a scene file whose keys are `spread`: `ffrobot uncertainty`.

    Runs stay in the folder `output`, and are not run again; without one they are forgotten. See `design.uncertainty`.
    """
    from .design.uncertainty import uncertainty

    with _designs(Path(scene), output, allow_python) as folder:
        found = uncertainty(
            Path(scene), of, spread, folder, samples=samples, seed=seed, by=by, indices=indices, processes=processes
        )
    return found if output is not None else replace(found, table=None)


def screening(
    scene: AnyPath,
    of: Sequence[str],
    spread: Sequence[str],
    output: AnyPath | None = None,
    *,
    trajectories: int = 10,
    seed: int = 0,
    processes: int = 1,
    allow_python: Sequence[AnyPath] = (),
) -> Screening:
    """Elementary effects on goals `of` a scene file of keys that are `spread`: `ffrobot uncertainty --by screening`.

    Runs stay in the folder `output`, and are not run again; without one they are forgotten. See `design.screening`.
    """
    from .design.screening import screening

    with _designs(Path(scene), output, allow_python) as folder:
        found = screening(Path(scene), of, spread, folder, trajectories=trajectories, seed=seed, processes=processes)
    return found if output is not None else replace(found, table=None)


def write_study(found: Found, folder: AnyPath, *, figures: bool = True) -> list[Path]:
    """Write what the design functions return as files for `write_report`, and as figures; the files written."""
    from .common.extras import extras
    from .design.studies import keep_study

    with extras():
        return list(keep_study(found, Path(folder), figures=figures))


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
