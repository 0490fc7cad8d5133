"""The command `link`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..common.errors import InputError
from ..common.files import check_new_file, write_atomically
from ..common.parallel import is_first
from ..present.logs import FILE, logging_options
from .options import POSITIVE, output_option, protect

if TYPE_CHECKING:
    from ..mesh.inspection import Unit


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
    link_file: Path, output: Path | None, unit: Unit | None, density: float | None, *, force: bool, inspect: bool
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
    from ..run.inputs import files_of

    protect(files_of(link_file))
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


def _inspect(file: Path, output: Path | None, unit: Unit | None, density: float | None, *, force: bool) -> None:
    """Print what a part's file holds; write a draft of its link file, and a picture with the numbers of the faces."""
    from ..exchange.part_draft import draft_link
    from ..mesh.inspection import inspect_part
    from ..present.console import summary_console
    from ..present.info import LISTED, print_inspection

    protect([file])
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
        console.print(f"written    {path}", soft_wrap=True)
