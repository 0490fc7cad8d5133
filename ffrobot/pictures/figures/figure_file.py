"""`figures.toml`: which figures a case shows, and what each draws."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from ...common.keys import Positive
from ...common.toml_files import load_toml
from ...common.validation import InputFile, Record, validate

FILE_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")


def _file_name(value: str) -> str:
    if not FILE_NAME.fullmatch(value):
        raise ValueError(f'expected a name of letters, digits, "_", "-" and ".", found "{value}"')
    return value


FileName = Annotated[str, AfterValidator(_file_name)]
Range = tuple[float, float]


class Curve(Record):
    """A curve: a dataset of the results file, or one column of it.

    `data` reads, say, `inverse/joints/A/moment` or `forward/points/link2.tip/position[0]`. With `file`, a CSV file
    whose first column is the time, its column `data` is drawn as separate points.
    """

    data: str
    """Dataset of the results file, "inverse/joints/A/moment", or one column of it, "…/position[0]"; with `file`, the
    name of its column."""
    label: str
    """Label in the legend."""
    x: str | None = None
    """Dataset of the horizontal axis instead of the time, or one of its columns: "inverse/joints/A/rate"."""
    magnitude: bool = False
    """Length of the vectors of the dataset instead of their components."""
    file: InputFile | None = None
    """CSV file whose first column is the time (s), drawn as separate points."""


class FigureRecord(Record):
    """One figure. Axes without a range take that of the data; units are in the labels of the axes.

    Kinds: "time" draws its curves over time. "path" draws (x, y) or (x, y, z) datasets as paths. "configurations" draws
    the bodies of `analysis` at `times` (s), and its curves as paths, by default those of points with trajectories.
    "torque-speed" draws its curves over their `x`, and the limits of the motor of `joint`. Of a linear `analysis`, at
    the first of `times`: "bode" draws the frequency responses of `transfers` [input, output], "modes" the mode shapes
    of the robot; "placement" the patches of such an analysis.
    """

    name: FileName
    """Name of the files, without suffix."""
    title: str = ""
    """Title above the axes."""
    kind: Literal["time", "path", "configurations", "torque-speed", "bode", "modes", "placement"] = "time"
    """Kind of figure; see above."""
    transfers: tuple[tuple[str, str], ...] = ()
    """Pairs [input, output] of the linear model for kind = "bode"."""
    curves: tuple[Curve, ...] = ()
    """Curves over time, or paths."""
    analysis: str | None = None
    """Analysis whose robot, modes, responses or patches are drawn."""
    joint: str | None = None
    """Joint whose motor limits kind = "torque-speed" draws."""
    times: tuple[float, ...] = ()
    """Instants of the configurations, s."""
    exaggeration: Positive | None = None
    """Exaggeration of deflections in configurations; default: 1 in planar scenes, chosen for visibility in 3D ones."""
    x_label: str = "time (s)"
    """Label of the horizontal axis, with its unit, in kind = "time" and "torque-speed"."""
    y_label: str = ""
    """Label of the vertical axis, with its unit."""
    scale: float = 1.0
    """Factor of values, in kind = "time" and "torque-speed": 1000 for mm."""
    x_range: Range | None = None
    """Range of the horizontal axis; by default that of the data."""
    y_range: Range | None = None
    """Range of the vertical axis; by default that of the data."""
    limits: tuple[float, ...] = Field(default=())
    """Values of horizontal lines, such as a voltage limit; in units of the axis."""

    @model_validator(mode="after")
    def _consistent(self) -> FigureRecord:
        if self.kind == "configurations" and (self.analysis is None or not self.times):
            raise ValueError('expected the keys "analysis" and "times" in kind = "configurations"')
        if self.kind in ("bode", "modes", "placement") and self.analysis is None:
            raise ValueError(f'expected the key "analysis" in kind = "{self.kind}", found none')
        if (self.kind == "bode") != bool(self.transfers):
            raise ValueError(
                f'expected the key "transfers" in kind = "bode" and only there, found kind = "{self.kind}"'
            )
        if self.kind in ("time", "path", "torque-speed") and not self.curves:
            raise ValueError(f'expected the key "curves" in kind = "{self.kind}", found none')
        if self.exaggeration is not None and self.kind != "configurations":
            raise ValueError(
                f'expected the key "exaggeration" only in kind = "configurations", found kind = "{self.kind}"'
            )
        if self.kind == "torque-speed" and (self.joint is None or any(curve.x is None for curve in self.curves)):
            raise ValueError('expected the key "joint", and "x" in every curve, in kind = "torque-speed"')
        return self


class FigureFile(Record):
    """Figures of a case, in order."""

    figure: tuple[FigureRecord, ...]
    """Figures, in this order."""


def load_figures(path: Path) -> FigureFile:
    """Read `figures.toml`. Raises `InputError` naming file, key, what was expected and what was found."""
    return validate(FigureFile, load_toml(path, "figure file"), path)
