"""Common parts of standard figures and charts of reports: curves, names, points that bend, limits of motors."""

import hashlib
import re
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import field_validator, model_validator

from ...common.arrays import Array
from ...common.errors import InputError, quoted
from ...common.keys import Positive
from ...common.tables import shown
from ...common.toml_files import load_toml, read_csv
from ...common.validation import InputFile, Record, validate
from ...mbs.fields.waypoints import numbers_of
from ...mbs.joints.joint import MotorLimits
from ...results.file import Results
from ...results.joints import joint_coordinates

Range = tuple[float, float]


class Curve(Record):
    """A curve: a dataset of the results file, or one column of it."""

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


NEEDED = {
    "time": ("curves",),
    "path": ("curves",),
    "configurations": ("analysis", "times"),
    "torque-speed": ("curves", "joint"),
    "bode": ("analysis", "transfers"),
    "modes": ("analysis",),
    "placement": ("analysis",),
}
"""Keys of each kind of figure."""


class FigureRecord(Record):
    """One figure; units are in the labels of its axes.

    Kinds: "time" draws its curves over time. "path" draws (x, y) or (x, y, z) datasets as paths. "configurations" draws
    the bodies of `analysis` at `times` (s), and its curves as paths, by default those of points with trajectories.
    "torque-speed" draws its curves over their `x`, and the limits of the motor of `joint`. Of a linear `analysis`, at
    the first of `times`: "bode" draws the frequency responses of `transfers` [input, output], "modes" the mode shapes
    of the robot; "placement" the patches of such an analysis.
    """

    name: str
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
    limits: tuple[float, ...] = ()
    """Values of horizontal lines, such as a voltage limit; in units of the axis."""

    @field_validator("name")
    @classmethod
    def _file_name(cls, value: str) -> str:
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]*", value):
            raise ValueError(f'expected a name of letters, digits, "_", "-" and ".", found "{value}"')
        return value

    @model_validator(mode="after")
    def _consistent(self) -> "FigureRecord":
        if missing := [key for key in NEEDED[self.kind] if not getattr(self, key)]:
            raise ValueError(
                f'expected {quoted(NEEDED[self.kind])} in kind = "{self.kind}", found no {quoted(missing)}'
            )
        if self.kind == "torque-speed" and any(curve.x is None for curve in self.curves):
            raise ValueError('expected the key "x" in every curve of kind = "torque-speed", found one without')
        for key, kind in (("transfers", "bode"), ("exaggeration", "configurations")):
            if getattr(self, key) and self.kind != kind:
                raise ValueError(f'expected the key "{key}" only in kind = "{kind}", found kind = "{self.kind}"')
        return self


class FigureFile(Record):
    """Figures of a case, in order."""

    figure: tuple[FigureRecord, ...]
    """Figures, in this order."""


def check_part(results: Results, figure: FigureRecord, part: str, expected: str) -> None:
    """Raise `InputError`, with the text `expected`, if the results of a figure's analysis lack the group `part`."""
    if not results.has(f"{figure.analysis}/{part}"):
        raise InputError(f'{results.path}: figure "{figure.name}": expected {expected}', f'"{figure.analysis}"')


def load_figures(path: Path) -> FigureFile:
    """Read `figures.toml`. Raises `InputError` for unreadable files and wrong keys."""
    return validate(FigureFile, load_toml(path, "figure file"), path)


NO_DEFLECTION = 1e-6  # of the largest: round-off of points that the reference condition fixes


def curves_of(results: Results, dataset: str, column: str = "", *, magnitude: bool = False) -> tuple[Curve, ...]:
    """Return curves of a dataset, or of its `column` such as "[0]", for every analysis that contains it."""
    names = ((analysis, f"{analysis}/{dataset}") for analysis in results.analyses)
    return tuple(Curve(data=name + column, label=a, magnitude=magnitude) for a, name in names if results.has(name))


def members(results: Results, group: str) -> list[str]:
    """Return the names in a group of any analysis, each once, in the order of the scene."""
    order = [keys["name"] for table in ("body", "joint") for keys in results.scene.get(table, [])]
    names = dict.fromkeys(name for a in results.analyses for name in results.names(f"{a}/{group}"))
    return sorted(names, key=lambda name: order.index(name) if name in order else len(order))


def bending_points(results: Results, analysis: str | None = None) -> list[str]:
    """Return the points whose deflection is visible next to that of the others, in one analysis or in any."""
    largest: dict[str, float] = {}
    for each in results.analyses if analysis is None else [analysis]:
        for point in results.names(f"{each}/points"):
            deflection = np.linalg.norm(results[f"{each}/points/{point}/deflection"], axis=1)
            largest[point] = max(largest.get(point, 0.0), float(deflection.max(initial=0.0)))
    visible = NO_DEFLECTION * max(largest.values(), default=0.0)
    return [point for point, value in largest.items() if value > visible]


def both_ways(limit: float | list[float]) -> tuple[float, ...]:
    """Return the distinct limits of patches, V, with both signs."""
    return tuple(sorted({sign * float(one) for one in np.atleast_1d(limit) for sign in (-1.0, 1.0)}))


def file_name(*parts: str) -> str:
    """Return a file name: everything but letters, digits, `.` and `-` becomes `_`, with digits of a hash for others."""
    joined = "_".join(parts)
    mark = f"-{hashlib.sha256(joined.encode()).hexdigest()[:6]}" if re.search(r"[^\w /.-]", joined, re.A) else ""
    return re.sub(r"[^A-Za-z0-9.-]", "_", joined) + mark


def curve_points(results: Results, curve: Curve, scale: float) -> tuple[Array, Array]:
    """Return abscissa (T,), time (s) or the curve's `x`, and values (T, columns): `scale` times those in the file."""
    values = results.data(curve.data)
    if curve.magnitude:
        values = np.linalg.norm(values, axis=1)[:, None]
    x = results.time(curve.data) if curve.x is None else results.data(curve.x)[:, 0]
    if len(x) != len(values):
        raise InputError(
            f'{results.path}: expected as many values in "{curve.x}" as in "{curve.data}" ({len(values)})', len(x)
        )
    return x, scale * values


def read_points(path: Path, column: str) -> tuple[Array, Array]:
    """Read times (T,), s, from the first column of a CSV file, and values (T,), in its units, from another."""
    header, rows = read_csv(path, "table of points")
    if column not in header:
        raise InputError(f'{path}: expected the column "{column}"', quoted(map(shown, header)))
    k = header.index(column)
    table = [numbers_of(path, line, [*row[:1], *row[k : k + 1]], 2) for line, row in rows]
    time, values = np.reshape(table, (-1, 2)).T
    return time, values


MARGIN = 1.15  # of the largest moment or speed, where no limit ends a curve
POINTS = 60  # of that curve


def motor_limits(results: Results, figure: FigureRecord) -> Array:
    """Return points (n, 2) of a motor's limits, speed and torque in the units of the diagram; see `limit_curves`."""
    assert figure.joint is not None
    points = [curve_points(results, curve, figure.scale) for curve in figure.curves]
    speed, moment = (max(float(abs(one).max()) for one in each) for each in zip(*points, strict=True))
    # Limits of the joint coordinate in the first curve, "…/moment[1]".
    number = int(figure.curves[0].data.partition("[")[2].rstrip("]") or 0)
    limits = [coordinate.limits for coordinate in joint_coordinates(results.scene, figure.joint)]
    return limit_curves(limits[number] if number < len(limits) else MotorLimits(), speed, moment)


def limit_curves(limits: MotorLimits, speed: float, moment: float) -> Array:
    """Return points (n, 2), speed and torque, of bounds |τ| ≤ τ_max, |γ̇| ≤ γ̇_max, |τ γ̇| ≤ P_max; NaN between curves.

    `speed` (rad/s or m/s) and `moment` (N·m or N) are the largest of the data; unbounded curves go further.
    """
    has_moment, has_speed, has_power = known = np.isfinite([limits.moment, limits.speed, limits.power])
    if not known.any():
        return np.empty((0, 2))
    power = limits.power if has_power else 0.0  # without that limit nothing asks for more than the data
    speed_end = limits.speed if has_speed else MARGIN * max(speed, power / limits.moment, 1e-300)
    moment_end = limits.moment if has_moment else MARGIN * max(moment, power / speed_end, 1e-300)
    rates = [speed_end]
    if 0.0 < power / moment_end < speed_end:
        rates = np.geomspace(power / moment_end, speed_end, POINTS).tolist()
    curve = [[0.0, moment_end]] if has_moment else []
    curve += [[rate, min(moment_end, limits.power / rate)] for rate in rates]
    curve += [[speed_end, 0.0]] if has_speed else []
    gap = np.full((1, 2), np.nan)
    signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    return np.concatenate([part for sign in signs for part in (np.multiply(sign, curve), gap)])
