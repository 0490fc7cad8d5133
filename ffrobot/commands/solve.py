"""The command `solve`."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..present.logs import FILE, VERBOSE, logging_options, python_option
from .options import protect

if TYPE_CHECKING:
    from ..present.console import Display
    from ..run.solution import Solution


@click.command()
@click.argument("scene_file", metavar="SCENE.toml", type=FILE)
@click.option(
    "-o", "--output", metavar="RESULTS.h5", type=FILE, help="Output file [SCENE.results.h5 next to the input]."
)
@click.option("--resume", is_flag=True, help="Resume a stopped run from its results file.")
@click.option("--robust", is_flag=True, help="State what remains of tracking and motors-only motions under deviations.")
@click.option("--strict", is_flag=True, help="Exit code 1 if there is a warning; results are written nevertheless.")
@python_option
@logging_options
def solve(scene_file: Path, output: Path | None, *, resume: bool, robust: bool, strict: bool) -> None:
    """Run the analyses of a scene (stage 2).

    Stage 1 runs first for link files that are not up to date. Prints a summary of at most fifteen lines: by analysis
    the answer, tip error and deflection, by motor peaks, RMS and limits, warnings. With --verbose all else: steps,
    constraint violation, voltages, stresses, zeros, errors, wall times.

    Ctrl-C keeps computed results; --resume continues from there, or from the start if there are none.
    """
    from ..common.files import check_output
    from ..results.file import FORMAT
    from ..run.inputs import files_of

    path = output or scene_file.with_suffix(".results.h5")
    protect(files_of(scene_file))
    check_output(path, FORMAT)
    again = f"ffrobot solve {scene_file}{f' -o {output}' if output else ''} --resume"
    _solve(scene_file, path, again, resume=resume, robust=robust, strict=strict)


def _solve(scene_file: Path, path: Path, again: str, *, resume: bool, robust: bool, strict: bool) -> None:
    """Solve, write and tell; `again` is the command that goes on with it."""
    from ..common.errors import SolveError, StoppedError
    from ..present.console import Display, summary_console, summary_width
    from ..present.lines import error_budget, folded, named_tables
    from ..present.start_postures import chosen_posture
    from ..present.summary import summary_lines
    from ..results.file import Results
    from ..results.resume import how_to_go_on, resume_scene
    from ..results.tables import robustness_cells
    from ..results.write import write_results
    from ..run.solve import solve_scene
    from ..scene.load import load_scene
    from ..scene.plausibility import remarks

    scene = load_scene(scene_file)
    if robust:
        from ..run.robustness import robust as robustly

        scene = robustly(scene)
    remarked = list(folded(remarks(scene)))
    for remark in remarked:  # first: they may be why the run fails
        click.echo(f"note       {remark}")
    writing, kept = 0.0, []

    def keep(solution: Solution) -> None:
        nonlocal writing
        began = time.perf_counter()
        write_results(solution, path)
        writing = time.perf_counter() - began
        kept.append(solution)

    with Display() as display:
        try:
            solution = resume_scene(scene_file, path, display, keep) if resume else solve_scene(scene, display, keep)
        except SolveError as error:  # what a signal has cut short may fail for that
            if not display.signal:
                raise
            go_on = "".join(how_to_go_on(one, again) for one in kept[-1:])
            raise StoppedError(f"{error}{go_on}", display.signal) from error
    if solution is None:
        click.echo(f"{path}: complete, nothing to go on with")
        return
    verbose = click.get_current_context().meta.get(VERBOSE)
    with Results(path) as results:
        verdict, posture = results.verdict, chosen_posture(results, solution.model)
        if verbose:
            from ..present.details import print_details

            print_details(solution, results, {**solution.seconds, "writing": writing}, summary_console())
            click.echo(f"note       {posture}" if posture else "", nl=bool(posture))
    if not verbose:
        notes = [*solution.path_notes, *solution.link_notes, *([posture] if posture else [])]
        accuracy = "; ".join(error_budget(solution))
        lines = summary_lines(verdict, notes, accuracy, str(path), summary_width(), len(remarked))
        click.echo("\n".join(lines))
        with Results(path) as results:
            rows = [(name, cells) for name in results.analyses for cells in robustness_cells(results, name)]
            for table in named_tables("robustness of", rows):
                summary_console().print(table)
    _check_ended(solution, display, scene_file, again)
    for name, result in solution.analyses.items() if strict else ():
        for text in result.warnings:
            raise SolveError(f'{scene_file}: analysis "{name}": {text} (a warning, and --strict)')


def _check_ended(solution: Solution, display: Display, scene_file: Path, again: str) -> None:
    """Raise `SolveError` where an analysis ended early, `StoppedError` where a signal has asked for an end."""
    from ..common.errors import SolveError, StoppedError
    from ..results.resume import how_to_go_on, left_out

    go_on = how_to_go_on(solution, again)
    try:
        for outcome in solution.outcomes.values():
            outcome.check_completed(go_on)
    except SolveError as error:
        raise StoppedError(str(error), display.signal) if display.signal else error from None
    if display.signal:
        done = "before all analyses" if left_out(solution) else "when all was computed and written"
        raise StoppedError(f"{scene_file}: stopped on request {done}{go_on}", display.signal)
