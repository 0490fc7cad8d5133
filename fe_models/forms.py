"""Compile the finite element forms of links ahead: `python -P -m ffrobot.fe_models.forms`, once for an installation.

Forms of other orders and cells are compiled when a link first needs them, and kept in the user's cache.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..common.cache import cache_folder
from ..mesh.form_cache import installed_forms
from .link import computed_modal_body
from .link_source import LinkTable

MATERIAL = {"youngs_modulus": 7e10, "poissons_ratio": 0.33, "density": 2700.0}
SECTION = {"shape": "rectangle", "height": 0.1, "width": 0.1}
ROUND = {"shape": "circle", "diameter": 0.1}
# UFL 2022 (Debian 12) gives a form one of several signatures, another one in another process.
PROCESSES = 4


def links() -> Iterator[dict[str, Any]]:
    """Yield keys of small links: beams of both theories, boxes of both cells, a round bar, each of default order."""
    for theory in ("euler-bernoulli", "timoshenko"):
        yield _link({"kind": "beam", "section": SECTION}, {"elements": 2}, model={"theory": theory})
    for cell in ("tetrahedron", "hexahedron"):
        yield _link({"kind": "solid", "section": SECTION}, {"cell": cell, "divisions": [2, 1, 1]})
    yield _link({"kind": "solid", "section": ROUND}, {"size": 0.1})


def _link(geometry: Mapping[str, Any], mesh: Mapping[str, Any], **more: object) -> dict[str, Any]:
    modes = {"count": 2, "attachment_modes": False}
    named = {"name": "link", "material": MATERIAL, "reference": {"condition": "cantilever"}, "modes": modes}
    return named | {"geometry": {"length": 0.2} | dict(geometry), "mesh": dict(mesh)} | more


def main() -> None:
    """Compile the forms of `links` into the installation or, where that cannot be written, into the user's cache."""
    if sys.argv[1:] == ["one"]:
        for keys in links():
            computed_modal_body(LinkTable(keys, Path("<forms>")))
        return
    target = installed_forms()
    if not os.access(next(folder for folder in target.parents if folder.exists()), os.W_OK):
        target = cache_folder("forms")
    with TemporaryDirectory() as own:
        os.environ["XDG_CACHE_HOME"] = own  # neither what is compiled already nor meshes of these links are to be seen
        for _ in range(PROCESSES):
            subprocess.run([sys.executable, "-P", "-m", "ffrobot.fe_models.forms", "one"], check=True)
        ignored = shutil.ignore_patterns("*.o", "*.lock")
        forms = cache_folder("forms")
        shutil.copytree(forms, target, dirs_exist_ok=True, ignore=ignored, copy_function=shutil.copyfile)
    sys.stdout.write(f"{len(list(target.glob('*/*.so')))} forms compiled in {target}\n")


if __name__ == "__main__":
    main()
