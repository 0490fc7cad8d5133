"""The page of what was measured, from the records that `python -m bench -o docs/benchmarks` wrote.

It is kept in the repository, so that it can be read there: `python docs/benchmark_tables.py` writes it anew.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmark_columns import COLUMNS

from ffrobot.bench.campaign import as_text

INTRODUCTION = """# What was measured

Made from the records in `docs/benchmarks`; [Benchmarks](../benchmarks.md) explains the numbers and names the commands
that make them. Seconds depend on the machine, which each table names, and on its load (processes that wanted to run).
"""


def write_benchmark_tables(folder: Path, page: Path) -> None:
    """Write `page` with a section for every record (JSON) in `folder` and below."""
    page.write_text(benchmark_page(folder, page), encoding="utf-8")


def benchmark_page(folder: Path, page: Path) -> str:
    """The text of `page`."""
    sections = [line for path in sorted(folder.rglob("*.json")) for line in _section(path, page)]
    return "\n".join([INTRODUCTION, *(sections or ["No records yet."])]).rstrip("\n") + "\n"


def _section(path: Path, page: Path) -> Iterator[str]:
    record: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    machine = record["machine"]
    yield from (f"## {record['title']}", "")
    yield f"{machine['processor']}, {machine['cores']} cores, {machine['compiler']}; load {record['load']:.2g}."
    if "verdict" in record:
        yield from ("", f"`{json.dumps(record['verdict'])}`")
    headings, lines = as_text(record["rows"], COLUMNS[record["part"]])
    yield from ("", f"| {' | '.join(headings)} |", "|---" * len(headings) + "|")
    yield from (f"| {' | '.join(line)} |" for line in lines)
    yield ""
    prefix = _FIGURES.get(record["part"])
    for picture in sorted(path.parent.glob("*.png")):
        if prefix is not None and picture.stem.startswith(prefix):
            yield f"![{picture.stem}](../{picture.relative_to(page.parents[1]).as_posix()})"
    yield ""


_FIGURES = {
    "work-precision": "work_precision",
    "axes": "error_",
    "growth": "growth",
    "evaluations": "-",
    "aims": "-",
    "replays": "-",
    "peer": "-",
}


if __name__ == "__main__":
    here = Path(__file__).parent
    write_benchmark_tables(here / "benchmarks", here / "developer" / "benchmark_records.md")
