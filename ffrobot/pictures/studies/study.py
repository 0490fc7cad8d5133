"""Studies of design commands: data of their diagrams, and the file."""

import json
import re
import textwrap
from pathlib import Path
from typing import Annotated, Literal, NamedTuple, get_args

import numpy as np
from pydantic import Field

from ...common.arrays import Array
from ...common.errors import InputError, quoted
from ...common.files import write_atomically
from ...common.validation import Record, validate
from ..projection import COLORS


class Look(NamedTuple):
    """Style of the lines and points of designs; the last of `LOOKS` are drawn on top."""

    label: str
    color: str
    width: float
    dash: str
    marker: str


LOOKS: "dict[State, Look]" = {
    "failed": Look("failed", "#8b95a3", 0.8, ":", "x"),
    "exceeded": Look("beyond a limit", COLORS[5], 0.8, "--", "^"),
    "kept": Look("within limits", COLORS[4], 0.8, "-", "o"),
    "best": Look("best", COLORS[1], 2.4, "-", "D"),
}

Numbers = tuple[float | None, ...]
"""Numbers of designs; None for runs that failed."""

State = Literal["best", "kept", "exceeded", "failed"]
"""State of a design: the best or one of a front; limits are satisfied, or are not; its run failed."""

ROOM = 0.05  # of an axis, beyond the least and the largest value
DECADES = 2.0  # logarithmic axis for positive responses over more


class Drawing(Record):
    """Base of all diagrams: `name` of its files without suffix, and a title."""

    name: str
    title: str


class Series(Record):
    """Bars of one color: a value for each label of the diagram, and its error, 0 if unknown."""

    label: str = ""
    values: Numbers
    errors: tuple[float, ...] = ()


class Bars(Drawing):
    """Horizontal bars, the first label on top; a single series has one color for each sign where `signed`."""

    kind: Literal["bars"] = "bars"
    x_label: str
    labels: tuple[str, ...]
    series: tuple[Series, ...]
    signed: bool = False


class DesignAxis(Record):
    """One axis of parallel coordinates from `low` to `high`, with the value of every design.

    `limit` of a response is an upper (`sense` 1) or lower (−1) one. `names`: names of a catalog's rows, whose numbers
    are then the values.
    """

    label: str
    values: Numbers
    low: float
    high: float
    logarithmic: bool = False
    limit: float | None = None
    sense: Literal[1, -1] = 1
    names: tuple[str, ...] = ()

    def place(self, values: Array) -> Array:
        """Return positions (…), no unit, of values (…), in the unit of the axis: 0 at `low` and 1 at `high`."""
        scaled = np.log if self.logarithmic else np.asarray
        low, high = scaled(np.array([self.low, self.high]))
        return (scaled(values) - low) / (high - low)

    @property
    def places(self) -> Array:
        """Positions (n,) of n designs, no unit, from 0 to 1, NaN for failed ones."""
        return self.place(floats(self.values))


def floats(values: Numbers) -> Array:
    """Return numbers as an array (n,) in their unit, None as NaN."""
    return np.array([np.nan if value is None else value for value in values])


def axis_of_response(label: str, values: Numbers, limit: float | None = None, sense: Literal[1, -1] = 1) -> DesignAxis:
    """Return the axis of a response, with room for all its values and its upper (`sense` 1) or lower (−1) limit."""
    shown = [value for value in (*values, limit) if value is not None] or [0.0]
    low, high = min(shown), max(shown)
    logarithmic = low > 0.0 and high > low * 10.0**DECADES
    if logarithmic:
        room = (high / low) ** ROOM
        low, high = low / room, high * room
    else:
        room = ROOM * (high - low) or ROOM * abs(high) or 1.0
        low, high = low - room, high + room
    return DesignAxis(label=label, values=values, low=low, high=high, logarithmic=logarithmic, limit=limit, sense=sense)


class Parallel(Drawing):
    """Parallel coordinates (Inselberg 1985): a line over `axes` for each design, styled by its state."""

    kind: Literal["parallel"] = "parallel"
    axes: tuple[DesignAxis, ...]
    states: tuple[State, ...]
    best_label: str = "best"


class Progress(Drawing):
    """Response by design: one entry of `values`, `states` and `best` (so far, within limits) for each, in order."""

    kind: Literal["progress"] = "progress"
    y_label: str
    values: Numbers
    states: tuple[State, ...]
    best: Numbers
    logarithmic: bool = False


class Band(Drawing):
    """History at `time` (s) under uncertain keys: band between `low` and `high`, worst cases `lowest` and `highest`."""

    kind: Literal["band"] = "band"
    y_label: str
    time: tuple[float, ...]
    nominal: tuple[float, ...]
    median: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    lowest: tuple[float, ...]
    highest: tuple[float, ...]
    band_label: str
    worst_label: str


class Points(Drawing):
    """Points on a curve; hollow unless `sure` (converged and feasible)."""

    kind: Literal["points"] = "points"
    x_label: str
    y_label: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    sure: tuple[bool, ...]


Diagram = Annotated[Bars | Parallel | Progress | Band | Points, Field(discriminator="kind")]


def wrapped(label: str, letters: int) -> list[str]:
    """Wrap a label to lines of about the given length, at blanks and after dots of names, not within its unit."""
    whole = re.sub(r"\([^()]*\)$", lambda unit: unit[0].replace(" ", "\u00a0"), label)
    lines = textwrap.wrap(whole.replace(".", ".\u200b "), letters, break_long_words=False, break_on_hyphens=False)
    return [line.replace("\u200b ", "").replace("\u200b", "").replace("\u00a0", " ") for line in lines]


StudyName = Literal["sensitivity", "optimum", "front", "uncertainty"]
"""Name of a study's file in the folder of a command, without `.json`."""


class StudyTable(Record):
    """A heading row, and rows of text."""

    heading: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


class Study(Record):
    """Result of a design command, as its JSON file contains it."""

    format: Literal["ffrobot-study"] = "ffrobot-study"
    format_version: Literal[1] = 1
    ffrobot_version: str
    name: StudyName
    title: str
    scene: str  # path of the scene file; `scene_name`: name in it
    scene_name: str
    headline: str  # the answer; `good`: whether it is the requested one, None if that cannot be judged
    good: bool | None = None
    facts: tuple[str, ...]  # notes and method, a line each
    tables: tuple[StudyTable, ...]
    diagrams: tuple[Diagram, ...]


def write_study(study: Study, folder: Path) -> Path:
    """Write the JSON file of a study into `folder`; returns its path."""
    path = folder / f"{study.name}.json"
    text = json.dumps(study.model_dump(), ensure_ascii=False, separators=(",", ":"))
    write_atomically(path, text.encode(), "study", make_folder=True, ours=True)
    return path


def study_files(path: Path) -> list[Path]:
    """Return study files in the folder `path` of a design command, or `path` itself if it is one."""
    if not path.is_dir():
        return [path] if path.suffix == ".json" else []
    names = [f"{name}.json" for name in get_args(StudyName)]
    files = [file for name in names if (file := path / name).is_file()]
    if not files:
        raise InputError(
            f"{path}: expected a folder of ffrobot sensitivity, optimise or uncertainty, with one of {quoted(names)}",
            "none: has the command come to its end?",
        )
    return files


def read_study(path: Path) -> Study:
    """Read a study file. Raises `InputError` if it is none, or damaged."""
    try:
        data = json.loads(path.read_bytes())
    except OSError as error:
        raise InputError(f"{path}: expected a file that can be read, found: {error.strerror or error}") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: expected a study of ffrobot as JSON, found: {error}") from None
    if not isinstance(data, dict) or data.get("format") != "ffrobot-study":
        raise InputError(f'{path}: expected a study of ffrobot (format "ffrobot-study")', "another file")
    if (version := data.get("format_version")) != 1:
        raise InputError(f"{path}: expected format_version 1", f"{version}: run the command again")
    return validate(Study, data, path)
