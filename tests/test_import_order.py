"""Imports go down only: from the command line to what all share, and never back, not for type annotations either."""

import ast
import re
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

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
    """A circle of files and one of folders, where there are any."""
    arrows = {(item.file, item.target) for item in found}
    folders = {(a.parent, b.parent) for a, b in arrows if a.parent != b.parent}
    return [circle for graph in (arrows, folders) if (circle := _circle(graph))]


def _circle(arrows):
    sorter = TopologicalSorter()
    for a, b in arrows:
        sorter.add(a, b)
    try:
        sorter.prepare()
    except CycleError as error:
        return sorted(set(map(str, error.args[1])))
    return []


def test_every_folder_is_on_a_floor():
    paths = [path.relative_to(ROOT) for package in PACKAGES for path in (ROOT / package).rglob("*.py")]
    assert [str(path) for path in paths if None in floor(path)] == []


def test_imports_go_down_and_there_are_no_circles():
    found = imports(ROOT)
    assert {"common/errors.py", "mbs/scene/analysis.py"} <= {str(item.target) for item in found}
    assert [str(item) for item in upward(found)] == []
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
