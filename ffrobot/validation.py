"""Reading and validating TOML input files: one clear error that names file, key, expected and found."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from .errors import InputError


class Record(BaseModel):
    """Base of every record of an input file: immutable, no unknown keys, finite numbers, no silent conversions."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


R = TypeVar("R", bound=Record)


def load_toml(path: Path, kind: str) -> dict[str, Any]:
    """Parse the TOML file at `path`; `kind` ("link file", "scene file") is how the error message calls it."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{path}: {kind} not found") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot read the {kind}: {error}") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not a valid TOML {kind}: {error}") from None


def validate(record: type[R], data: dict[str, Any], path: Path) -> R:
    """Build `record` from `data`, read from `path`; an `InputError` lists every wrong key."""
    try:
        return record.model_validate(data)
    except ValidationError as error:
        lines = [_describe(item, record, data) for item in error.errors(include_url=False)]
        raise InputError("\n".join(f"{path}: {line}" for line in dict.fromkeys(lines))) from None


def _describe(item: Any, record: type[BaseModel], data: dict[str, Any]) -> str:
    # TODO: key path, expected, found, did-you-mean for unknown keys
    return f"{'.'.join(str(part) for part in item['loc'])}: {item['msg']}"
