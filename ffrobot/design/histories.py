"""Histories that goals are made of, named with dots: `joints.elbow.moment`, `inverse.points.arm.tip.position[0]`."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from ..common.arrays import Array, as_floats
from ..common.errors import InputError, did_you_mean
from ..mbs.joints.joints import JOINT_TYPES
from ..results.datasets import COLUMN
from ..results.file import Results
from ..results.meanings import meaning
from ..sweep.runs import is_vector

JOINT = re.compile(r"(?P<analysis>[^/]+)/joints/(?P<joint>[^/]+)")
POWER = "power"
"""What joints have besides their datasets: the power of their motors, W."""

SAME = 1e-6  # of an output step: times that are one
SUPPORT = 6  # outputs that a value between outputs is made from


@dataclass(frozen=True)
class History:
    """`values` (T, columns) at `time` (T,), s; of a vector its length, one column."""

    name: str
    unit: str
    time: Array
    values: Array

    def at(self, t: float, column: int, every: int = 1) -> float:
        """The value at t: that of an output, or of the polynomial through the six nearest (Lagrange).

        With `every` = 2 every second of those about t alone is known, without the one next to it.
        """
        values, time = self.values[:, column], self.time
        nearest = int(np.argmin(np.abs(time - t)))
        if every > 1 and time.size > every * SUPPORT:
            first = (nearest + 1) % every
            values, time = values[first::every], time[first::every]
            nearest = int(np.argmin(np.abs(time - t)))
        step = time[1] - time[0] if time.size > 1 else 1.0
        if abs(time[nearest] - t) <= SAME * step:
            return float(values[nearest])
        first = int(np.clip(np.searchsorted(time, t) - SUPPORT // 2, 0, max(0, time.size - SUPPORT)))
        x, y = time[first : first + SUPPORT], values[first : first + SUPPORT]
        parts = [yk * np.prod([(t - xj) / (xk - xj) for xj in x if xj != xk]) for xk, yk in zip(x, y, strict=True)]
        return float(sum(parts))


def read_history(results: Results, name: str, option: str) -> History:
    """The history that `name` means; without an analysis in front it is of the first one that the results have.

    Raises `InputError`, with the `option` that names it, where there is none.
    """
    match = COLUMN.fullmatch(name)
    wanted = match["dataset"] if match else name
    found = _known(results).get(wanted.replace("/", "."))
    if found is None:
        known = [key for key in _known(results) if "." in key]
        raise InputError(
            f'{option}: expected the name of a history, such as "{_example(known)}", found'
            f' "{wanted}"{did_you_mean(wanted.replace("/", "."), known)}'
        )
    values = _power(results, found) if found.endswith(f"/{POWER}") else results.data(found)
    if match:
        k = int(match["column"])
        if k >= values.shape[1]:
            raise InputError(f'{option}: expected a column below {values.shape[1]} of "{wanted}", found {k}')
        values = values[:, k : k + 1]
    elif is_vector(results, found, values):
        values = np.linalg.norm(values, axis=1, keepdims=True)
    return History(name, _unit(results, found), results.time(found), as_floats(values))


def _known(results: Results) -> dict[str, str]:
    """Datasets over time by the names they go by, with dots; those of the first analysis without its name, too."""
    found = [f"{analysis}/{name}" for analysis in results.analyses for name in _histories(results, analysis)]
    found += [f"{m[0]}/{POWER}" for m in map(JOINT.match, found) if m and f"{m[0]}/moment" in results]
    by_name = {name.replace("/", "."): name for name in found}
    first = f"{results.analyses[0]}/" if results.analyses else "/"
    short = {name.removeprefix(first).replace("/", "."): name for name in found if name.startswith(first)}
    return short | by_name


def _histories(results: Results, analysis: str) -> list[str]:
    """Those over the outputs, and of closed loops those over the samples."""
    control = results.names(f"{analysis}/control")
    samples = len(results[f"{analysis}/control/time"]) if control else 0
    of_loop = [f"control/{name}" for name in control if len(results[f"{analysis}/control/{name}"]) == samples]
    return list(dict.fromkeys([*results.histories(analysis), *of_loop]))


def _power(results: Results, name: str) -> Array:
    """(T, 1) W: force times rate, summed over the coordinates of the joint; of the motor where a gear gives."""
    joint = name.removesuffix(f"/{POWER}")
    rate = "motor_rate" if f"{joint}/motor_rate" in results else "rate"
    power = results.data(f"{joint}/moment") * results.data(f"{joint}/{rate}")
    return as_floats(power.sum(axis=1, keepdims=True))


def _unit(results: Results, name: str) -> str:
    """Where the dataset has one only; of a joint that of its coordinates, where these are all angles or all ways."""
    if name.endswith(f"/{POWER}"):
        return "W"
    known = meaning(name.partition("/")[2])
    if known is None or "," not in known.unit:
        return known.unit if known is not None else ""
    match = JOINT.match(name)
    kinds = {str(joint["name"]): str(joint["type"]) for joint in results.scene["joint"]} if match else {}
    if match is None or match["joint"] not in kinds:
        return ""
    units = set(JOINT_TYPES[kinds[match["joint"]]].units)  # types that the plane has too have the same there
    turning, sliding = known.unit.split(", ")
    return {"rad": turning, "m": sliding}[units.pop()] if len(units) == 1 else ""


def _example(known: list[str]) -> str:
    return next((name for name in known if name.startswith("joints.")), known[0] if known else "tip_error")
