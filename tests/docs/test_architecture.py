"""The page on how the parts hang together: what it names is there."""

import re
from pathlib import Path

from ffrobot.common.meanings import RESULTS

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs/developer/architecture.md").read_text(encoding="utf-8")
IS_PATH = re.compile(r".*(\.(py|h|cpp|c|md|toml|\*)|/)")


def paths_to_nothing():
    """From the root, or next to one before it in the paragraph or table row; a row "…" goes on with the last one."""
    near = []
    for line in TEXT.splitlines():
        if not line.startswith("| …") and (not line.strip() or line.startswith("|")):
            near = []
        for path in re.findall(r"`([\w./*-]+)`", line):
            is_from_root = "/" in path and (ROOT / path.split("/")[0]).is_dir()
            if is_from_root or IS_PATH.fullmatch(path):
                at = [one for base in (ROOT, *near) for one in base.glob(path.rstrip("/"))]
                near += [one if one.is_dir() else one.parent for one in at]
                if not at:
                    yield path


def test_paths_exist():
    assert list(paths_to_nothing()) == []


def test_tables_are_short():
    """An index that is longer says that folders do not tell what is in them."""
    tables = re.findall(r"(?:^\|.*\n)+", TEXT, flags=re.MULTILINE)
    assert max(table.count("\n") - 2 for table in tables) <= 40  # without the two lines of the head


def test_symbols_have_names_in_code_and_results():
    """The last part of each name in a file of the product, each dataset in the table of these."""
    source = "\n".join(
        path.read_text(encoding="utf-8") for top in ("mbs", "actuation") for path in ROOT.glob(f"{top}/**/*.py")
    )
    rows = [line.split("|")[2:4] for line in TEXT.split("| symbol | code")[1].split("\n\n")[0].splitlines()[2:]]
    assert len(rows) > 5
    for code, datasets in rows:
        for name in re.findall(r"`([^`]+)`", code):
            last = re.findall(r"\w+", name)[-1]
            assert re.search(rf"\b{last}\b", source), name
        assert set(re.findall(r"`([^`]+)`", datasets)) <= set(RESULTS), datasets
