"""The command `solve`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..common.errors import SolveError
from ..present.logs import VERBOSE, logging_options, python_option
from .options import output_option, scene_argument

if TYPE_CHECKING:
    from ..run.result import Solution


@click.command()
@scene_argument
@output_option("RESULTS.h5", "Output file [SCENE.results.h5 next to the input].")
@click.option("--resume", is_flag=True, help="Resume a stopped run from its results file.")
@click.option("--robust", is_flag=True, help="State what remains of tracking and motors-only motions under deviations.")
@click.option("--wanted", multiple=True, hidden=True)  # datasets and groups that a study reads, written alone
@click.option("--strict", is_flag=True, help="Exit code 1 if there is a warning; results are written nevertheless.")
@python_option
@logging_options
def solve(
    scene_file: Path, output: Path | None, *, resume: bool, robust: bool, strict: bool, wanted: tuple[str, ...]
) -> None:
    """Run the analyses of a scene (stage 2).

    Stage 1 runs first for link files that are not up to date. Prints a summary of at most fifteen lines: by analysis
    the answer, tip error and deflection, by motor peaks, RMS and limits, warnings. With --verbose all else: steps,
    constraint violation, voltages, stresses, zeros, errors, wall times.

    Ctrl-C keeps computed results; --resume continues from there, or from the start if there are none.
    """
    from ..present.console import Display
    from ..present.lines import folded
    from ..results.solving import check_ended, solve_and_keep
    from ..run.watcher import Watcher
    from ..scene.load import load_scene
    from ..scene.plausibility import remarks

    path = output or scene_file.with_suffix(".results.h5")
    again = f"ffrobot solve {scene_file}{f' -o {output}' if output else ''} --resume"
    scene = load_scene(scene_file)
    if wanted:
        watcher = Watcher()
        if (solution := solve_and_keep(scene, path, watcher, "", wanted=wanted)) is not None:
            check_ended(solution, watcher, "", scene_file)
        return
    if robust:
        from ..run.robustness import robust as robustly

        scene = robustly(scene)
    remarked = list(folded(remarks(scene)))
    for remark in remarked:  # first: they may be why the run fails
        click.echo(f"note       {remark}")
    with Display() as display:
        solution = solve_and_keep(scene, path, display, again, resume=resume)
    if solution is None:
        click.echo(f"{path}: complete, nothing to go on with")
        return
    _tell(solution, path, len(remarked))
    check_ended(solution, display, again, scene_file)
    for name, result in solution.analyses.items() if strict else ():
        for text in result.warnings:
            raise SolveError(f'{scene_file}: analysis "{name}": {text} (a warning, and --strict)')


def _tell(solution: Solution, path: Path, remarked: int) -> None:
    """Print the summary, or the details; `remarked`: lines that stand above it."""
    from ..present.console import summary_console, summary_width
    from ..present.lines import error_budget, named_tables
    from ..present.start_postures import chosen_posture
    from ..present.summary import summary_lines
    from ..results.file import Results
    from ..results.tables import robustness_cells

    with Results(path) as results:
        posture = chosen_posture(results, solution.model)
        if click.get_current_context().meta.get(VERBOSE):
            from ..present.details import print_details

            print_details(solution, results, summary_console())
            click.echo(f"note       {posture}" if posture else "", nl=bool(posture))
            return
        notes = [*solution.path_notes, *solution.link_notes, *([posture] if posture else [])]
        accuracy = "; ".join(error_budget(solution))
        lines = summary_lines(results.verdict, notes, accuracy, str(path), summary_width(), remarked)
        click.echo("\n".join(lines))
        rows = [(name, cells) for name in results.analyses for cells in robustness_cells(results, name)]
        for table in named_tables("robustness of", rows):
            summary_console().print(table)
