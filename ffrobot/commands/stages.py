"""The commands of both stages: `link`, `pose` and `solve`."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..common.errors import InputError, SolveError
from ..common.files import check_new_file, write_atomically
from ..common.parallel import is_first
from ..present.logs import FILE, VERBOSE, logging_options, python_option
from .options import POSITIVE, output_option, protect, protect_scene, scene_argument

if TYPE_CHECKING:
    from ..mesh.inspection import Unit
    from ..run.result import Solution


@click.command()
@click.argument("link_file", metavar="LINK.toml|PART", type=FILE)
@output_option("BODY.h5|DRAFT.toml", "Output file [LINK.h5 next to the input].")
@click.option("--force", is_flag=True, help="Computation even if the file is up to date.")
@click.option(
    "--inspect",
    is_flag=True,
    help="Size, likely unit and faces of a STEP file or mesh; with --output a draft of its link file.",
)
@click.option("--unit", type=click.Choice(["m", "mm", "in"]), help="Unit of the part, with --inspect.")
@click.option("--density", metavar="KG/M3", type=POSITIVE, help="Density for the mass of the part, with --inspect.")
@logging_options
def link(
    link_file: Path, output: Path | None, unit: "Unit | None", density: float | None, *, force: bool, inspect: bool
) -> None:
    """Compute the modal body file of one link (stage 1).

    Mesh, finite element model, modes under the reference condition of the link file, and the invariants that the
    dynamics needs. Nothing is computed when the output is up to date with the content of LINK.toml.
    """
    if inspect:
        _inspect(link_file, output, unit, density, force=force)
        return
    if unit is not None or density is not None:
        raise InputError("--unit, --density: expected --inspect with them", "none")
    from ..fe_models.link import make_link
    from ..fe_models.link_file import read_link
    from ..fe_models.remarks import remarks_on_link
    from ..present.console import Display

    protect_scene(link_file)
    with Display() as display:
        outcome = make_link(link_file, output, force=force, progress=display.stage)
    if not is_first():
        return
    body = outcome.body
    reused = f", {outcome.reused} from an earlier run" if outcome.reused else ""
    verb = f"computed in {outcome.seconds:.2f} s{reused}" if outcome.computed else "up to date"
    highest = body.frequency[body.eigenmode_count - 1]
    click.echo(f"{outcome.path}: {verb}; {body.modes_in_words}, {body.frequency[0]:.6g} … {highest:.6g} Hz")
    for remark in (*body.remarks, *remarks_on_link(read_link(link_file), link_file.name)):
        click.echo(f"remark     {remark}")


def _inspect(file: Path, output: Path | None, unit: "Unit | None", density: float | None, *, force: bool) -> None:
    """Print the contents of a part's file; write a draft of its link file, and a picture with numbers of faces."""
    from ..exchange.part_draft import draft_link
    from ..mesh.inspection import inspect_part
    from ..present.console import summary_console
    from ..present.info import LISTED, print_inspection

    protect(file)
    if output is not None:
        check_new_file(output, replace=force)
    part = inspect_part(file, unit)
    console = summary_console()
    print_inspection(file, part, density, console)
    if output is None:
        return
    draft = draft_link(part, file, output.stem, output.absolute().parent, density)
    from ..pictures.figures.plot import draw_part, write_figure

    write_atomically(output, draft.encode(), "draft of a link file")
    for path in (output, *write_figure(draw_part(part, LISTED), output.parent, f"{output.stem}.faces", ("png",))):
        console.out(f"written    {path}")


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
    _tell(solution, path, min(len(remarked), 5))  # leaves a summary room
    check_ended(solution, display, again, scene_file)
    for name, result in solution.analyses.items() if strict else ():
        for text in result.warnings:
            raise SolveError(f'{scene_file}: analysis "{name}": {text} (a warning, and --strict)')


def _tell(solution: "Solution", path: Path, remarked: int) -> None:
    """Print the summary, or the details; `remarked`: lines that stand above it."""
    from ..present.console import summary_console, summary_width
    from ..present.lines import tables_of
    from ..present.start_postures import chosen_posture
    from ..present.summary import error_budget, summary_lines
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
        for table in tables_of(results, "robustness of", robustness_cells):
            summary_console().print(table, crop=False)


@click.command()
@scene_argument
@python_option
@logging_options
def pose(scene_file: Path) -> None:
    """Print the posture in which a scene starts, and the other ones that reach the same places (elbow, wrist)."""
    from ..present.console import Display, summary_console
    from ..present.start_postures import print_start

    protect_scene(scene_file)
    with Display() as display:
        print_start(scene_file, display, summary_console())
