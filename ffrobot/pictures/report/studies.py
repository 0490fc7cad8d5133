"""Studies of design commands as parts of the page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..studies.study import Study, StudyTable
from .diagrams import DrawnDiagram, drawn


@dataclass(frozen=True)
class StudyPart:
    """One study on the page; `file` it was read from."""

    number: int
    file: Path
    study: Study

    @property
    def title(self) -> str:
        """What was asked, and of which scene."""
        return f"{self.study.title}: {self.study.scene_name}"

    @property
    def mood(self) -> str:
        """For the colour of its headline."""
        return {True: "good", False: "bad", None: ""}[self.study.good]

    @property
    def tables(self) -> Sequence[StudyTable]:
        """As the command prints them."""
        return self.study.tables

    @property
    def charts(self) -> list[DrawnDiagram]:
        """Its diagrams."""
        return [drawn(one, f"study_{self.number}_{one.name}") for one in self.study.diagrams]


def study_parts(studies: Sequence[tuple[Path, Study]]) -> list[StudyPart]:
    """Numbered in order."""
    return [StudyPart(number, file, study) for number, (file, study) in enumerate(studies, start=1)]
