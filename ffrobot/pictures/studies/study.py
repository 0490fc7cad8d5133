"""The file of a study: what a design command has found, in words, tables and diagrams, for the report."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Literal, get_args

from ...common.errors import InputError, quoted
from ...common.files import write_atomically
from ...common.validation import Record, validate
from .diagrams import Diagram

FORMAT = "ffrobot-study"
VERSION = 1
StudyName = Literal["sensitivity", "optimum", "front", "uncertainty", "screening"]
"""Of a file, without `.json`, as the folder of a command has it beside its tables."""

NAMES: tuple[StudyName, ...] = get_args(StudyName)


class StudyTable(Record):
    """A heading row, and rows of text."""

    heading: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


class Study(Record):
    """What one command has found.

    Attributes:
        scene: path of its file, as the command had it; `scene_name` in it.
        headline: the answer; `good` whether it is what was asked for, None where nothing was.
        facts: what to mind, and how it was found, a line each.
    """

    format: Literal["ffrobot-study"] = "ffrobot-study"
    format_version: Literal[1] = 1
    ffrobot_version: str
    name: StudyName
    title: str
    scene: str
    scene_name: str
    headline: str
    good: bool | None = None
    facts: tuple[str, ...]
    tables: tuple[StudyTable, ...]
    diagrams: tuple[Diagram, ...]


def write_study(study: Study, folder: Path) -> Path:
    """Beside the tables of the command; the file written."""
    path = folder / f"{study.name}.json"
    text = json.dumps(study.model_dump(), ensure_ascii=False, separators=(",", ":"))
    write_atomically(path, text.encode(), "study", make_folder=True, ours=True)
    return path


def study_files(path: Path) -> list[Path]:
    """Those of a folder of a design command, which has to have one, or `path` itself where it is one."""
    if not path.is_dir():
        return [path] if path.suffix == ".json" else []
    found = [file for name in NAMES if (file := path / f"{name}.json").is_file()]
    if not found:
        raise InputError(
            f"{path}: expected a folder of ffrobot sensitivity, optimise or uncertainty, with one of"
            f" {quoted(f'{name}.json' for name in NAMES)}, found none: has the command come to its end?"
        )
    return found


def read_study(path: Path) -> Study:
    """Raises `InputError` where the file is none, or damaged."""
    try:
        data = json.loads(path.read_bytes())
    except OSError as error:
        raise InputError(f"{path}: expected a file that can be read, found: {error.strerror or error}") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: expected a study of ffrobot as JSON, found: {error}") from None
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise InputError(f'{path}: expected a study of ffrobot (format "{FORMAT}"), found another file')
    if data.get("format_version") != VERSION:
        raise InputError(
            f"{path}: expected format_version {VERSION}, found {data.get('format_version')}: run the command again"
        )
    return validate(Study, data, path)
