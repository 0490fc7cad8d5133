"""The commands `import` and `export`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import click

from ..common.errors import InputError
from ..common.outputs import protected
from ..present.logs import FILE, logging_options


@click.command(name="import")
@click.argument("file", metavar="ROBOT.urdf", type=FILE)
@click.option("-o", "--output", metavar="DIR", type=FILE, required=True, help="Folder of the scene.")
@click.option(
    "--flexible",
    metavar="LINK=FILE.toml",
    multiple=True,
    help="A link, and the link file that says what it is; repeatable.",
)
@click.option("--force", is_flag=True, help="Replace files that are there.")
@logging_options
def import_(file: Path, output: Path, flexible: tuple[str, ...], *, force: bool) -> None:
    """Make a scene in space of a robot description (URDF).

    DIR/scene.toml gets bodies and joints: every link rigid, as its <inertial> says, unless --flexible names a link
    file for it; links that fixed joints hold together are one body, what the root carries that way stands still.
    What is to be computed is for you to append.
    """
    from ..present.summary import summary_console
    from .present import print_import
    from .urdf.import_urdf import import_urdf

    links = _links(flexible)
    click.get_current_context().with_resource(protected([file, *links.values()]))
    print_import(import_urdf(file, output, links, force=force), summary_console())


def _links(pairs: tuple[str, ...]) -> Mapping[str, Path]:
    """`LINK=FILE.toml` by link."""
    found = dict[str, Path]()
    for pair in pairs:
        name, sign, path = pair.partition("=")
        if not (name and sign and path):
            raise InputError(f'--flexible: expected LINK=FILE.toml, found "{pair}"')
        if name in found:
            raise InputError(f'--flexible: expected one file for link "{name}", found two')
        found[name] = Path(path)
    return found
