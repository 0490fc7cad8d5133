"""The study of whatever a design command has found."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ..pictures.studies.study import Study, write_study
from .front import Front
from .optimum import Optimum
from .optimum_study import front_study, optimum_study
from .record import Sensitivity
from .screening import Screening
from .screening_record import screening_study
from .sensitivity_study import sensitivity_study
from .uncertainty import Uncertainty
from .uncertainty_study import uncertainty_study

Found = Sensitivity | Optimum | Front | Uncertainty | Screening


def study_of(found: Found) -> Study:
    """Words, tables and diagrams of it."""
    match found:
        case Sensitivity():
            return sensitivity_study(found)
        case Optimum():
            return optimum_study(found)
        case Front():
            return front_study(found)
        case Uncertainty():
            return uncertainty_study(found)
        case Screening():
            return screening_study(found)


def keep_study(found: Found, folder: Path, *, figures: bool) -> Iterator[Path]:
    """Write the file for the report, and the diagrams as figures; the files one after the other."""
    study = study_of(found)
    yield write_study(study, folder)
    if figures:
        from ..pictures.studies.figures import write_diagrams

        yield from write_diagrams(study.diagrams, folder)
