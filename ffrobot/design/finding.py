"""Base of the results of design commands: printing, tables and figures."""

import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np
from rich.console import Console

from ..common.files import write_atomically
from ..common.tables import as_csv
from ..common.toml_files import load_toml
from ..common.version import VERSION
from ..pictures.studies.study import Diagram, Numbers, Study, StudyName, StudyTable, write_study
from ..present.console import plain_console
from ..present.lines import print_table


class TextTable(NamedTuple):
    """A table of text: below a `line` in print; in reports the first heading begins with `of`."""

    heading: Sequence[str]
    rows: Iterable[Sequence[str]]
    line: str = ""
    of: str = ""

    def for_report(self) -> StudyTable:
        """Return the table as study files contain it."""
        first, *others = self.heading
        heading = (f"{self.of}: {first}" if self.of else first, *others)
        return StudyTable(heading=heading, rows=tuple(map(tuple, self.rows)))


class CsvFile(NamedTuple):
    """Table of numbers for a CSV file: file name, columns, rows."""

    name: str
    columns: Sequence[str]
    rows: Iterable[Sequence[object]]


@dataclass(frozen=True, kw_only=True)
class Finding(ABC):
    """Base of the results of design commands for the scene file `scene`: printing, tables, figures.

    Attributes:
        runs: number of runs; `failures` are messages of failed ones.
        table: the file of all runs; None if they were not kept.
    """

    name: ClassVar[StudyName]
    title: ClassVar[str]

    scene: Path
    runs: int
    failures: tuple[str, ...] = ()
    table: Path | None = None

    @property
    def shortfall(self) -> str | None:
        """Reason why the result is not the requested one; empty if it is, None if that cannot be judged."""
        return None

    @abstractmethod
    def headline(self) -> str:
        """The answer in one line."""

    @abstractmethod
    def sections(self) -> Iterator[TextTable]:
        """Yield the tables of text."""

    def failed(self) -> Iterator[str]:
        """A line about runs that failed, if any did."""
        if count := len(self.failures):
            more = f", and {count - 1} more in the table of runs" if count > 1 else ""
            yield f"failed     {count} of {self.runs} runs, left out: {self.failures[0]}{more}"

    @abstractmethod
    def remarks(self) -> Iterator[str]:
        """Notes on the accuracy, failed runs, and the method."""

    @abstractmethod
    def csv_files(self) -> Iterator[CsvFile]:
        """Tables with all numbers."""

    @abstractmethod
    def diagrams(self) -> Sequence[Diagram]:
        """Diagrams of the study."""

    def report_tables(self) -> Iterator[StudyTable]:
        """Tables of text for the page of a report."""
        return (section.for_report() for section in self.sections())

    def print(self, console: Console) -> None:
        """Print the tables as text, then the notes."""
        for section in self.sections():
            if section.line:
                console.out(section.line)
            print_table(console, section.heading, section.rows)
        for line in self.remarks():
            console.out(line)

    def __str__(self) -> str:
        console = plain_console(out := StringIO(), 120)
        self.print(console)
        return out.getvalue()

    def write_tables(self, folder: Path) -> Iterator[Path]:
        """Write the CSV tables; yields the written files."""
        for file in self.csv_files():
            content = as_csv([file.columns, *file.rows]).encode()
            write_atomically(folder / file.name, content, "table of the study", ours=True)
            yield folder / file.name

    def study(self) -> Study:
        """Content of the study for JSON and reports: texts, tables and diagrams."""
        parts = (line.strip().partition("  ") for line in self.remarks() if line)
        facts = tuple(f"{word}: {text.strip()}" if blanks else word for word, blanks, text in parts)
        return Study(
            ffrobot_version=VERSION, name=self.name, title=self.title, scene=str(self.scene),
            scene_name=str(load_toml(self.scene, "scene").get("name", self.scene.stem)), headline=self.headline(),
            good=None if self.shortfall is None else not self.shortfall, facts=facts,
            tables=tuple(self.report_tables()), diagrams=tuple(self.diagrams()),
        )  # fmt: skip

    def write_study(self, folder: Path, *, figures: bool) -> Iterator[Path]:
        """Write the JSON file for the report, and the figures; yields the written files."""
        study = self.study()
        yield write_study(study, folder)
        if figures:
            from ..pictures.studies.figures import write_diagrams

            yield from write_diagrams(study.diagrams, folder)


def numbers(values: Iterable[float]) -> Numbers:
    """Convert values to Python floats, with None for NaN and infinity."""
    return tuple(float(value) if np.isfinite(value) else None for value in values)


def floats(values: Iterable[float]) -> tuple[float, ...]:
    """Convert to Python floats; 0 where not finite."""
    return tuple(float(value) if np.isfinite(value) else 0.0 for value in values)


def with_unit(text: str, unit: str) -> str:
    """Append a unit in parentheses: `mass (kg)`."""
    return f"{text} ({unit})" if unit else text


def file_name(text: str) -> str:
    """Return `text` with characters that file names should not contain replaced by "_"."""
    return re.sub(r"\W+", "_", text).strip("_")
