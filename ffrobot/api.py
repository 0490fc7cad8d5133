"""What the command line does, for use from Python; paths may be text."""

import warnings
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from .common.errors import FfrobotWarning, InputError
from .common.files import AnyPath
from .common.libraries import extras
from .common.outputs import protected

if TYPE_CHECKING:
    from .design.finding import Finding
    from .results.file import Results
    from .run.watcher import Watcher
    from .scene.scene import Scene


def solve(
    scene: "Scene | AnyPath",
    output: AnyPath | None = None,
    watcher: "Watcher | None" = None,
    *,
    resume: bool = False,
    allow_python: Sequence[AnyPath] = (),
) -> "Results":
    """Solve the analyses of a scene or a scene file: `ffrobot solve`.

    Args:
        scene: scene file, or a scene from `make_scene` or `load_scene`.
        output: results file; None: results stay in memory.
        watcher: an object that observes progress and can stop the run.
        resume: whether to resume a stopped run from `output`; Python functions have to be the same.
        allow_python: files and folders whose Python files may run, in addition to those below the folder of the scene.

    Returns:
        The results; `results["inverse/joints/shoulder/moment"]` is a dataset.

    Raises:
        InputError: the scene is invalid.
        SolveError: an analysis does not reach its end; `output` contains the results so far.

    Warns:
        FfrobotWarning: results may be wrong; `Results.warnings` contains the texts.

    Example:
        results = ffrobot.solve("scene.toml", "scene.results.h5")
        torque = results["inverse/joints/shoulder/moment"]  # (T,) in N·m
    """
    from .results.file import Results
    from .results.solving import check_ended, solve_and_keep
    from .results.write import results_image
    from .run.watcher import Watcher
    from .scene.load import MADE_IN_PYTHON, load_scene
    from .scene.scene import Scene

    if output is None and resume:
        raise InputError("solve: resume: expected the output of the run that was stopped", "none")
    if isinstance(scene, str | PathLike):
        scene = load_scene(scene, allow_python=allow_python)
    elif not isinstance(scene, Scene):
        wrong = type(scene).__name__
        raise InputError("solve: scene: expected a scene file, or a scene from make_scene(**keys)", wrong)
    path, watcher = None if output is None else Path(output), watcher or Watcher()
    again = "" if path is None else "solve(…, resume=True)"
    shown = Path(MADE_IN_PYTHON) if scene.path.name == MADE_IN_PYTHON else scene.path  # that one is in no folder
    solution = solve_and_keep(scene, path, watcher, again, resume=resume)
    if solution is not None:
        for name, result in solution.analyses.items():
            for text in result.warnings:
                warnings.warn(f'{shown}: analysis "{name}": {text}', FfrobotWarning, stacklevel=2)
        check_ended(solution, watcher, again, shown)
        if path is None:
            return Results.from_image(results_image(solution), scene.path)
    assert path is not None  # results that are complete are those of a file
    return Results(path)


def write_study(study: "Finding", folder: AnyPath, *, figures: bool = True) -> list[Path]:
    """Write the result of a design function as files for `write_report`, and as figures.

    Args:
        study: result of `sensitivity`, `optimise`, `trade_off` or `uncertainty`.
        folder: where to write.
        figures: whether to draw figures.

    Returns:
        The written files.

    Example:
        ffrobot.write_study(study, "study")
        ffrobot.write_report("study", "study.html")
    """
    with extras():
        return list(study.write_study(Path(folder), figures=figures))


def plot_results(
    results: "AnyPath | Results", folder: AnyPath, formats: Sequence[str] = ("png", "pdf"), *, only: Sequence[str] = ()
) -> list[Path]:
    """Draw the figures of results: `ffrobot plot`.

    Args:
        results: a results file, or results.
        folder: where to write.
        formats: "png", "pdf", "svg".
        only: names of figures, or patterns such as "moment_*", "*" for all; empty: the main ones.

    Returns:
        The written files.

    Raises:
        InputError: `figures.toml` next to the results, or a name in `only`, is wrong.

    Example:
        ffrobot.plot_results("scene.results.h5", "figures", ["svg"], only=["moment_*"])
    """
    from .common.validation import check_texts

    check_texts(formats, "plot_results: formats")
    check_texts(only, "plot_results: only")
    with extras(), _files(results) as (path,):
        from .pictures.figures.plot import plot_file

        return plot_file(path, Path(folder), formats, only)


def write_report(results: "AnyPath | Results | Sequence[AnyPath | Results]", path: AnyPath) -> None:
    """Write one HTML page about results, or several side by side: `ffrobot report`.

    Args:
        results: a results file, results, or a sequence of them. Folders of `sensitivity`, `optimise`, `trade_off`
            and `uncertainty` may be among them.
        path: the page, `.html`.

    Raises:
        InputError: planar and 3D results are mixed, or a file is none of these.

    Example:
        ffrobot.write_report(["before.results.h5", "after.results.h5"], "compare.html")
    """
    from .pictures.studies.study import study_files
    from .results.file import Results

    several = [results] if isinstance(results, str | PathLike | Results) else results
    studies = [file for r in several if not isinstance(r, Results) for file in study_files(Path(r))]
    solved = [r for r in several if isinstance(r, Results) or not study_files(Path(r))]
    with extras(), protected(studies), _files(*solved) as paths:
        from .pictures.report import write_report

        write_report([*paths, *studies], Path(path))


def view_file(
    file: "AnyPath | Results",
    folder: AnyPath,
    *,
    analysis: str | None = None,
    frames: int | None = None,
    time: float | None = None,
    scale: float | None = None,
    pictures: bool | None = None,
) -> list[Path]:
    """Write grids for ParaView, and pictures, of results or of a modal body file: `ffrobot view`.

    Args:
        file: a results file, results, or a modal body file.
        folder: where to write.
        analysis: the analysis; None: all.
        frames: largest number of outputs; None: 201.
        time: time of the picture, s; None: that of the largest deflections.
        scale: factor of deflections; None: chosen for visibility.
        pictures: whether to draw pictures; None: if PyVista can.

    Returns:
        The written files.

    Raises:
        InputError: no such analysis, or PyVista cannot draw requested pictures.

    Example:
        ffrobot.view_file("scene.results.h5", "view", analysis="inverse", scale=100)
    """
    from .pictures.view.view import FRAMES, Options, view_file

    with _files(file) as (path,):
        return view_file(path, Path(folder), Options(analysis, frames or FRAMES, time, scale, pictures)).paths


def write_movie(
    results: "AnyPath | Results",
    path: AnyPath,
    *,
    analysis: str | None = None,
    seconds: float | None = None,
    scale: float | None = None,
    rendered: bool = False,
) -> None:
    """Write a movie of the motion: `ffrobot plot --movie`.

    Args:
        results: a results file, or results.
        path: the movie, `.gif` or `.mp4`.
        analysis: the analysis; None: the first one over time.
        seconds: duration of the movie; None: 8 s.
        scale: factor of deflections; None: chosen for visibility.
        rendered: whether PyVista renders solids (`ffrobot view --movie`), instead of a drawing.

    Raises:
        InputError: no such analysis, or ffmpeg is missing for MP4.

    Example:
        ffrobot.write_movie("scene.results.h5", "motion.gif", rendered=True, scale=100)
    """
    with extras(), _files(results) as (file,):
        from .pictures.figures.movie import write_motion
        from .pictures.movie_file import SECONDS, MovieOptions
        from .pictures.view import view_movie

        (view_movie if rendered else write_motion)(
            file, Path(path), MovieOptions(analysis, SECONDS if seconds is None else seconds, scale)
        )


@contextmanager
def _files(*results: "AnyPath | Results") -> Iterator[list[Path]]:
    """The files of results, to be read; of those in memory, temporary ones."""
    from .common.hdf5 import reading
    from .results.file import Results

    with ExitStack() as stack:
        paths = [stack.enter_context(r.on_disk()) if isinstance(r, Results) else Path(r) for r in results]
        stack.enter_context(reading(*paths))
        yield paths
