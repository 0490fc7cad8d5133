"""Lines of summaries, and tables of text on a terminal."""

import re
from collections.abc import Callable, Iterable, Iterator
from itertools import zip_longest
from typing import TYPE_CHECKING

from .console import summary_width

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from ..results.file import Results
    from ..results.tables import Cells


def alike(lines: Iterable[tuple[str, str]]) -> Iterator[str]:
    """Yield each text of `lines` (analysis, text) once, after the names of all analyses with it."""
    names: dict[str, list[str]] = {}
    for name, text in lines:
        names.setdefault(text, []).append(name)
    for text, of in names.items():
        yield f"{', '.join(of)}: {text}"


NAMED = re.compile(r'((?:.*?(?:trajectory|joint|body|link|motor) )?)("[^"]+"|[^:]+)(.*)', re.DOTALL)


def folded(lines: Iterable[str]) -> Iterator[str]:
    """Join lines that differ in a name only: `trajectory "a", "b" ends at 1 s`."""
    names: dict[tuple[str, str], dict[str, None]] = {}
    for line in lines:
        before, name, after = NAMED.fullmatch(line).groups()  # type: ignore[union-attr]
        names.setdefault((before, after), {})[name] = None
    yield from (f"{before}{', '.join(of)}{after}" for (before, after), of in names.items())


def plain_table(headers: Iterable[str], rows: Iterable[Iterable[str]], *, names: int = 2) -> "Table":
    """Return a table without rules: the first `names` columns are text and wrap, the others are numbers.

    No word or number is cut: print it with `crop=False`.
    """
    from rich.table import Table

    rows = list(rows)
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False)
    width = -2
    for k, column in enumerate(zip_longest(headers, *rows, fillvalue="")):
        is_text = k < names or column[0] == "integrator"
        least = max(map(len, "\n".join(column).split(None if is_text else "\n")), default=0)
        table.add_column(
            column[0], justify="left" if is_text else "right", no_wrap=not is_text, overflow="fold", min_width=least
        )
        width += least + 2
    if width > summary_width():
        table.width = width
    for row in rows:
        table.add_row(*row)
    return table


def named_tables(first: str, rows: "Iterable[tuple[str, Cells]]") -> "Iterator[Table]":
    """Yield a table of rows (name, cells), with the names below the heading `first`; none without rows."""
    named = list(rows)
    if named:
        yield plain_table((first, *named[0][1]), ((name, *cells.values()) for name, cells in named))


def tables_of(
    results: "Results", first: str, cells_of: "Callable[[Results, str], Iterable[Cells]]"
) -> "Iterator[Table]":
    """Yield a table of the `cells_of` all analyses, with their names below the heading `first`; none without rows."""
    return named_tables(first, ((name, cells) for name in results.analyses for cells in cells_of(results, name)))


def print_table(console: "Console", headers: Iterable[str], rows: Iterable[Iterable[str]]) -> None:
    """Print `rows` below their headers, and an empty line."""
    console.print(plain_table(headers, rows), crop=False)
    console.print()
