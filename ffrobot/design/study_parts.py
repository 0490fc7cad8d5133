"""What the studies of all commands have in common: scene, numbers that JSON has, labels with units, names of files."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from ..common.toml_files import load_toml
from ..common.version import program_version
from ..pictures.studies.diagrams import Diagram, Numbers
from ..pictures.studies.study import Study, StudyName, StudyTable


def make_study(
    name: StudyName,
    title: str,
    scene: Path,
    headline: str,
    facts: Iterable[str],
    tables: Sequence[StudyTable],
    diagrams: Sequence[Diagram],
    *,
    good: bool | None = None,
) -> Study:
    """The study of one command on the scene file."""
    scene_name = str(load_toml(scene, "scene").get("name", scene.stem))
    return Study(
        ffrobot_version=program_version(), name=name, title=title, scene=str(scene), scene_name=scene_name,
        headline=headline, good=good, facts=tuple(_fact(line) for line in facts), tables=tuple(tables),
        diagrams=tuple(diagrams),
    )  # fmt: skip


def table(heading: Sequence[str], rows: Iterable[Sequence[str]]) -> StudyTable:
    """Of text."""
    return StudyTable(heading=tuple(heading), rows=tuple(map(tuple, rows)))


def numbers(values: Iterable[float]) -> Numbers:
    """None for what is not finite."""
    return tuple(float(value) if np.isfinite(value) else None for value in values)


def floats(values: Iterable[float]) -> tuple[float, ...]:
    """Python's own numbers; 0 for what is not finite."""
    return tuple(float(value) if np.isfinite(value) else 0.0 for value in values)


def with_unit(text: str, unit: str) -> str:
    """`mass (kg)`."""
    return f"{text} ({unit})" if unit else text


def file_name(text: str) -> str:
    """Of a goal or a history, without what file names do not take."""
    return re.sub(r"\W+", "_", text).strip("_")


def _fact(line: str) -> str:
    """`price      text` of the terminal as `price: text`."""
    word, blanks, text = line.strip().partition("  ")
    return f"{word}: {text.strip()}" if blanks else word
