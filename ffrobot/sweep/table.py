"""The table of a sweep: as a file with all columns, and on the screen with the most telling ones."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from ..common.files import write_atomically
from ..common.tables import as_csv
from .runs import Row

SHOWN = 5  # quantities on the screen
GAP = 2  # between columns


def write_table(path: Path, keys: Sequence[str], rows: Sequence[Row]) -> None:
    """One line for each run: number, values of the keys, status, quantities, message."""
    quantities = _quantities(rows)
    lines: list[list[object]] = [["run", *keys, "status", *quantities, "message"]]
    for row in rows:
        found = [row.quantities.get(name, "") for name in quantities]
        lines.append([row.number, *row.values, row.status, *found, row.message])
    write_atomically(path, as_csv(lines).encode(), "table of the sweep", ours=True)


def print_table(
    path: Path, keys: Sequence[str], rows: Sequence[Row], collected: Sequence[str], console: Console
) -> None:
    """Keys, status and what was asked for, or a few quantities; the file at `path` has the rest."""
    quantities = [name for name in _quantities(rows) if not name.endswith((" steps", " wall_seconds"))]
    shown = quantities[:SHOWN] if not collected else [name for name in quantities if name in collected]
    while len(shown) > 1 and sum(_width(header) + GAP for header in ("run", *keys, "status", *shown)) > console.width:
        shown = shown[:-1]
    table = Table(box=None, padding=(0, GAP, 0, 0), pad_edge=False)
    for header in ("run", *keys, "status", *shown):
        table.add_column(_broken(header), justify="left" if header == "status" else "right", min_width=_width(header))
    for row in rows:
        values = [f"{value:.6g}" if isinstance(value, float) else str(value) for value in row.values]
        found = [f"{row.quantities[name]:.4g}" if name in row.quantities else "" for name in shown]
        table.add_row(str(row.number), *values, row.status, *found)
    console.print(table)
    for row in rows:
        if row.status != "completed":
            console.print(f"run {row.number}: {row.status}: {row.message}", soft_wrap=True)
    more = f", with {len(quantities) - len(shown)} more quantities" if len(quantities) > len(shown) else ""
    console.print(f"table      {path}{more}", soft_wrap=True)


def _broken(header: str) -> str:
    return header.replace("/", "/\n").replace(" ", "\n")


def _width(header: str) -> int:
    return max([8, *(len(line) for line in _broken(header).splitlines())])


def _quantities(rows: Sequence[Row]) -> list[str]:
    """All that is not zero in every row: points at which a link cannot bend are no news."""
    return list(dict.fromkeys(name for row in rows for name, value in row.quantities.items() if value != 0.0))
