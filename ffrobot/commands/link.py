"""The command `link`."""

from __future__ import annotations

from pathlib import Path

import click

from ..common.parallel import is_first
from ..present.logs import FILE, logging_options
from .protect import protect


@click.command()
@click.argument("link_file", metavar="LINK.toml", type=FILE)
@click.option("-o", "--output", metavar="BODY.h5", type=FILE, help="Output file [LINK.h5 next to the input].")
@click.option("--force", is_flag=True, help="Computation even if the file is up to date.")
@logging_options
def link(link_file: Path, output: Path | None, force: bool) -> None:
    """Compute the modal body file of one link (stage 1).

    Mesh, finite element model, modes under the reference condition of the link file, and the invariants that the
    dynamics needs. Nothing is computed when the output is up to date with the content of LINK.toml.
    """
    from ..fe_models.link import make_link
    from ..fe_models.link_file import read_link
    from ..present.progress import Display
    from ..run.inputs import files_of
    from ..scene.plausibility import remarks_on_link

    protect(files_of(link_file))
    with Display() as display:
        outcome = make_link(link_file, output, force, display.stage)
    if not is_first():
        return
    body = outcome.body
    reused = f", {outcome.reused} from an earlier run" if outcome.reused else ""
    verb = f"computed in {outcome.seconds:.2f} s{reused}" if outcome.computed else "up to date"
    highest = body.frequency[body.eigenmode_count - 1]
    click.echo(f"{outcome.path}: {verb}; {body.modes_in_words}, {body.frequency[0]:.6g} … {highest:.6g} Hz")
    for remark in (*body.remarks, *remarks_on_link(read_link(link_file), link_file.name)):
        click.echo(f"remark     {remark}")
