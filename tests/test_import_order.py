"""Imports go down only: from the command line to what all share, and never back, not for type annotations either."""

import ast
import re
import shutil
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

COMPILED = ("ffrobot", "mbs", "_core")  # the core: it has no source here, and imports nothing

PACKAGES = ("common", "mesh", "fe_models", "mbs", "actuation", "ffrobot")

# From bottom to top; a folder may import from folders left of it, files from files of their own folder. "." are the
# files of the package itself.
ORDER = """
fe_models: link_records modal_body beam solid .
mbs: fields joints scene model posture linear run quantities inversion analysis tracking .
actuation: patches . control
ffrobot: scene run results present milling batch map exchange pictures sweep fit design smooth bench commands .
"""
FLOORS = {package: folders.split() for package, folders in re.findall(r"(\w+): (.+)", ORDER)}


@dataclass(frozen=True)
class Import:
    """`file` imports, in `line`, from `target`: both below the root of the sources."""

    file: Path
    line: int
    target: Path

    def __str__(self):
        return f"{self.file}:{self.line} imports {self.target}"


def imports(root):
    """Every import of one source file of ffrobot by another: at the top, inside functions, for types only."""
    files = {_name(path.relative_to(root)): path for package in PACKAGES for path in (root / package).rglob("*.py")}
    found = []
    for name, path in files.items():
        inside = name if path.name == "__init__.py" else name[:-1]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            for target in _targets(node, inside):
                if target[:3] == COMPILED:
                    continue
                hit = next((files[target[:n]] for n in range(len(target), 0, -1) if target[:n] in files), None)
                if hit not in (None, path):
                    found.append(Import(path.relative_to(root), node.lineno, hit.relative_to(root)))
    return found


def _name(path):
    """Module name in parts, below ffrobot: root folders are subpackages once installed."""
    parts = path.with_suffix("").parts
    parts = parts[1:] if parts[0] == "ffrobot" else parts
    return ("ffrobot", *(parts[:-1] if parts[-1] == "__init__" else parts))


def _targets(node, inside):
    if isinstance(node, ast.Import):
        return [tuple(alias.name.split(".")) for alias in node.names]
    if not isinstance(node, ast.ImportFrom):
        return []
    base = inside[: len(inside) - node.level + 1] if node.level else ()
    module = (*base, *(node.module.split(".") if node.module else ()))
    return [(*module, alias.name) for alias in node.names]


def floor(path):
    """Number of the package, and of the folder in it; None where that is on no floor."""
    package, *folders = path.parts[:-1]
    order = FLOORS.get(package)
    if order is None:
        return PACKAGES.index(package), 0
    folder = folders[0] if folders else "."
    return PACKAGES.index(package), order.index(folder) if folder in order else None


def upward(found):
    """The imports against the order of packages, or of folders in them."""
    return [item for item in found if None not in floor(item.file) and floor(item.target) > floor(item.file)]


def circles(found):
    """Groups of files, and of folders, each of which can be reached from the others."""
    arrows = {(item.file, item.target) for item in found}
    folders = {(a.parent, b.parent) for a, b in arrows if a.parent != b.parent}
    return [sorted(map(str, group)) for graph in (arrows, folders) for group in _groups(graph)]


def _groups(arrows):
    below = defaultdict(set)
    for a, b in arrows:
        below[a].add(b)

    def reached(start):
        seen, todo = set(), [start]
        while todo:
            for node in below.get(todo.pop(), ()):
                if node not in seen:
                    seen.add(node)
                    todo.append(node)
        return seen

    reach = {node: reached(node) for node in below}
    return {frozenset(b for b in reach[a] if a in reach.get(b, ())) for a in reach if a in reach[a]}


@pytest.fixture(scope="module")
def found():
    return imports(ROOT)


def test_every_folder_is_on_a_floor():
    paths = [path.relative_to(ROOT) for package in PACKAGES for path in (ROOT / package).rglob("*.py")]
    assert [str(path) for path in paths if None in floor(path)] == []


def test_imports_go_down(found):
    assert [str(item) for item in upward(found)] == []


def test_there_are_no_circles(found):
    assert circles(found) == []


def test_includes_of_the_core_have_no_circles():
    """Of its files, and of its folders."""
    files = [*ROOT.glob("mbs/core/**/*.h"), *ROOT.glob("mbs/core/**/*.cpp")]
    included = [
        Import(path.relative_to(ROOT / "mbs"), line, Path(text.split('"')[1]))
        for path in files
        for line, text in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if text.startswith('#include "core/')
    ]
    assert len(included) > len(files)
    assert circles(included) == []


# In each way, in a file of its own.
TURNED = {
    "errors": "from ..cli import main\n",
    "locks": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from ..cli import main\n",
    "peaks": "def late():\n    from ..cli import main\n",
    "structs": "from .. import cli\n",
    "rotations": "import ffrobot.cli\n",
}


def test_imports_turned_round_are_reported(found, tmp_path):
    """At the top, for types only, inside a function, of the module, by its full name; also between folders."""
    for package in PACKAGES:
        ignored = shutil.ignore_patterns("*.h", "*.cpp", "__pycache__")
        shutil.copytree(ROOT / package, tmp_path / package, ignore=ignored)
    expected = set()
    fields = tmp_path / "mbs" / "fields" / "field_types.py"
    for file, text, target in (
        *((tmp_path / "common" / f"{name}.py", text, "ffrobot/cli.py") for name, text in TURNED.items()),
        (fields, "from ..model import model\n", "mbs/model/model.py"),
    ):
        content = file.read_text(encoding="utf-8") + text
        file.write_text(content, encoding="utf-8")
        expected.add(Import(file.relative_to(tmp_path), content.count("\n"), Path(target)))
    after = imports(tmp_path)
    assert set(upward(after)) - set(upward(found)) == expected
    assert any({"common/errors.py", "ffrobot/cli.py"} <= set(group) for group in circles(after))
