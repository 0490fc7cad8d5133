"""Names that files give to what is in them: of all scripts, but such that they fit messages, datasets, file names."""

from __future__ import annotations

import unicodedata
from typing import Annotated

from pydantic import AfterValidator

from .tables import shown

LONGEST_NAME = 100  # characters
LONGEST_PATH = 4096  # what Linux opens
_UNSEEN = ("Cc", "Cs", "Co", "Cn", "Zl", "Zp")  # control characters, line breaks, what is no character at all


def check_title(value: str, most: int = LONGEST_NAME) -> str:
    """Raise `ValueError` for text that does not fit one line: it is empty, too long, or has unseen characters."""
    if not value.strip():
        raise ValueError(f'expected text that is not empty, found "{shown(value)}"')
    if len(value) > most:
        raise ValueError(f'expected a name of at most {most} characters, found {len(value)}: "{shown(value)}"')
    if any(unicodedata.category(character) in _UNSEEN for character in value):
        raise ValueError(f'expected a name without line breaks and control characters, found "{shown(value)}"')
    return value


def check_name(value: str) -> str:
    """As `check_title`, for what becomes a group of the results file and a part of "BODY.POINT"."""
    if not value or value != value.strip() or "/" in value or "." in value:
        raise ValueError(f'expected a name without "/", "." and blanks around it, found "{shown(value)}"')
    return check_title(value)


def _check_path(value: str) -> str:
    return check_title(value, LONGEST_PATH)


Title = Annotated[str, AfterValidator(check_title)]
PathName = Annotated[str, AfterValidator(_check_path)]
Name = Annotated[str, AfterValidator(check_name)]
