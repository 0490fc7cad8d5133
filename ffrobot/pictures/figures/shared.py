"""What standard figures and charts of reports are made of: curves, names, points that bend, limits of motors."""

from __future__ import annotations

import csv
import hashlib
from pathlib import Path

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, quoted
from ...common.tables import parse_csv, shown
from ...common.toml_files import read_text
from ...mbs.joints.joint import MotorLimits
from ...results.file import Results
from ...results.joints import joint_coordinates
from .figure_file import Curve, FigureRecord

NO_DEFLECTION = 1e-6  # of the largest: points that the reference condition fixes are there but for round-off


def curves_of(results: Results, dataset: str, column: str = "", *, magnitude: bool = False) -> tuple[Curve, ...]:
    """That dataset, or a column of it, of every analysis that has it."""
    names = ((analysis, f"{analysis}/{dataset}") for analysis in results.analyses)
    return tuple(Curve(data=name + column, label=a, magnitude=magnitude) for a, name in names if results.has(name))


def members(results: Results, group: str) -> list[str]:
    """Names in a group of any analysis, each once, in the order of the scene."""
    order = [keys["name"] for table in ("body", "joint") for keys in results.scene.get(table, [])]
    names = dict.fromkeys(name for a in results.analyses for name in results.names(f"{a}/{group}"))
    return sorted(names, key=lambda name: order.index(name) if name in order else len(order))


def bending_points(results: Results, analysis: str | None = None) -> list[str]:
    """Points whose deflection is visible next to that of the others, in one analysis or in any."""
    largest: dict[str, float] = {}
    for each in results.analyses if analysis is None else [analysis]:
        for point in results.names(f"{each}/points"):
            deflection = np.linalg.norm(results[f"{each}/points/{point}/deflection"], axis=1)
            largest[point] = max(largest.get(point, 0.0), float(deflection.max(initial=0.0)))
    visible = NO_DEFLECTION * max(largest.values(), default=0.0)
    return [point for point, value in largest.items() if value > visible]


def both_ways(limit: float | list[float]) -> tuple[float, ...]:
    """The limits of patches, one for all or one each, in both directions, each once."""
    return tuple(sorted({sign * float(one) for one in np.atleast_1d(limit) for sign in (-1.0, 1.0)}))


def file_name(*parts: str) -> str:
    """A file name: everything but letters, digits, `.` and `-` becomes `_`.

    Letters other than a to z and signs take a few digits of their own besides: names of other scripts stay apart.
    """
    joined = "_".join(parts)
    plain = "".join(c if c.isascii() and (c.isalnum() or c in ".-") else "_" for c in joined)
    lost = any(c != p and c not in " /_" for c, p in zip(joined, plain, strict=True))
    return f"{plain}-{hashlib.sha256(joined.encode()).hexdigest()[:6]}" if lost else plain


def curve_points(results: Results, curve: Curve, scale: float) -> tuple[Array, Array]:
    """Of a curve over time (s), or over its `x`: x (T,), and `scale` times its values (T, columns)."""
    values = results.data(curve.data)
    if curve.magnitude:
        values = np.linalg.norm(values, axis=1)[:, None]
    x = results.time(curve.data) if curve.x is None else results.data(curve.x)[:, 0]
    if len(x) != len(values):
        raise InputError(
            f'{results.path}: expected as many values in "{curve.x}" as in "{curve.data}" ({len(values)}), found'
            f" {len(x)}"
        )
    return x, scale * values


def read_points(path: Path, column: str) -> tuple[Array, Array]:
    """Times and values of one column of a CSV file whose first column is the time; lines with # are comments."""
    try:
        header, rows = parse_csv(read_text(path, "table of points"))
    except csv.Error as error:
        raise InputError(f"{path}: cannot read the points: {error}") from None
    if column not in header:
        raise InputError(f'{path}: expected the column "{column}", found {quoted(map(shown, header))}')
    k = header.index(column)
    try:
        return np.array([float(row[0]) for _, row in rows]), np.array([float(row[k]) for _, row in rows])
    except (ValueError, IndexError) as error:
        raise InputError(f'{path}: expected numbers in the column "{column}": {error}') from None


MARGIN = 1.15  # of the largest moment or speed, where no limit ends a curve
POINTS = 60  # of that curve


def motor_limits(results: Results, figure: FigureRecord) -> Array:
    """What the motor of the joint of a torque-speed diagram can do, as `limit_curves`.

    Of several coordinates of a joint each has its limits: those of the one that the first curve is of, "…/moment[1]".
    """
    assert figure.joint is not None
    points = [curve_points(results, curve, figure.scale) for curve in figure.curves]
    speed, moment = (max(float(abs(pair[i]).max()) for pair in points) for i in (0, 1))
    number = int(figure.curves[0].data.partition("[")[2].rstrip("]") or 0)
    limits = [coordinate.limits for coordinate in joint_coordinates(results.scene, figure.joint)]
    return limit_curves(limits[number] if number < len(limits) else MotorLimits(), speed, moment)


def limit_curves(limits: MotorLimits, speed: float, moment: float) -> Array:
    """Where |τ| ≤ τ_max, |γ̇| ≤ γ̇_max and |τ γ̇| ≤ P_max end: (n, 2) speeds and moments, NaN between pieces.

    In all four quadrants; where no limit ends a curve, it goes as far as the data, `speed` and `moment` at most, ask
    for. Empty without limits.
    """
    power = limits.power if np.isfinite(limits.power) else 0.0  # without that limit nothing asks for more than the data
    speed_end = limits.speed if np.isfinite(limits.speed) else MARGIN * max(speed, power / limits.moment, 1e-300)
    moment_end = limits.moment if np.isfinite(limits.moment) else MARGIN * max(moment, power / speed_end, 1e-300)
    pieces = []
    if np.isfinite(limits.moment):
        pieces.append(np.array([[0.0, limits.moment], [min(speed_end, limits.power / limits.moment), limits.moment]]))
    if np.isfinite(limits.power) and limits.power / moment_end < speed_end:
        rates = np.geomspace(limits.power / moment_end, speed_end, POINTS)
        pieces.append(np.column_stack([rates, limits.power / rates]))
    if np.isfinite(limits.speed):
        pieces.append(np.array([[limits.speed, min(moment_end, limits.power / limits.speed)], [limits.speed, 0.0]]))
    gap = np.full((1, 2), np.nan)
    signs = [np.array(pair) for pair in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    return np.concatenate([np.empty((0, 2)), *(part for sign in signs for p in pieces for part in (sign * p, gap))])
