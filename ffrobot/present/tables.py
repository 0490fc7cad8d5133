"""Tables of text on a terminal."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console
from rich.table import Table


def plain_table(*headers: str) -> Table:
    """Columns of text without lines: the first ones left, numbers right; names fold where they must."""
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False)
    for k, header in enumerate(headers):
        if k < 2 or header == "integrator":
            table.add_column(header, overflow="fold")
        else:
            table.add_column(header, justify="right", no_wrap=True)
    return table


def print_table(console: Console, headers: Iterable[str], rows: Iterable[Iterable[str]]) -> None:
    """Print `rows` below their headers, and an empty line."""
    table = plain_table(*headers)
    for row in rows:
        table.add_row(*row)
    console.print(table, highlight=False)
    console.print()
