"""The files of a map, map.h5 with all arrays over the grid, table.csv with a line for each pose; what is printed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console

from ..common.arrays import Array, as_floats
from ..common.checksum import MARK, sealed
from ..common.checksum import METHOD as CHECKSUM
from ..common.files import write_atomically
from ..common.hdf5 import image_of, in_memory
from ..common.tables import as_csv
from ..common.version import VERSION
from ..present.lines import print_table
from .pose_map import STATUS, PoseMap

FORMAT, FORMAT_VERSION = "ffrobot-map", 1
TABLE, FILE = "table.csv", "map.h5"
UNITS = {
    "frequency": "Hz",
    "compliance": "m/N, rad/N, m/(N·m), rad/(N·m)",
    "stiffness": "N/m",
    "least_stiffness": "N/m",
    "direction": "",
    "response": "m/N",
    "sag": "m",
    "torque": "N·m or N",
    "torque_share": "",
    "place": "m",
    "manipulability": "",
    "robot": "m",
    "milling_depth": "m",
    "milling_best_depth": "m",
    "milling_feed": "",
    "milling_lobes": "m",
}
NOT_IN_TABLE = ("compliance", "response", "robot", "milling_lobes")


def torque_share(poses: PoseMap) -> Array:
    """Return static torque over limit (P, motors) in P poses; NaN without a limit."""
    return np.abs(poses.values["torque"]) / poses.limits


def write_map(poses: PoseMap) -> Path:
    """Write map.h5 and table.csv to the folder of the plan; returns the path of map.h5."""
    plan = poses.plan
    with in_memory() as file:
        file.attrs.update({"format": FORMAT, "format_version": FORMAT_VERSION, MARK: CHECKSUM})
        file.attrs.update({"ffrobot_version": VERSION, "scene": str(plan.scene), "point": plan.point})
        file.attrs["axes"], file.attrs["motors"] = [axis.name for axis in plan.axes], list(poses.motors)
        for axis in plan.axes:
            file[f"axes/{axis.name}"] = axis.values
        file["status"] = poses.status.reshape(plan.shape)
        file["status"].attrs["meaning"] = list(STATUS)
        file["torque_limit"], file["frequencies"] = poses.limits, plan.frequencies
        for name, values in {**poses.values, "torque_share": torque_share(poses), "q": poses.q}.items():
            file[name] = values.reshape(*plan.shape, *values.shape[1:])
            file[name].attrs["unit"] = UNITS.get(name.rpartition("/")[2], "")
        image = image_of(file)
    write_atomically(plan.folder / FILE, sealed(image), "map", make_folder=True, ours=True)
    write_atomically(plan.folder / TABLE, _table(poses).encode(), "table of the map", ours=True)
    return plan.folder / FILE


def _table(poses: PoseMap) -> str:
    """A line for each pose: the grid's coordinates, how it went, and all that is not a matrix."""
    plan = poses.plan
    grid = np.stack(np.meshgrid(*(axis.values for axis in plan.axes), indexing="ij"), axis=-1)
    names = [axis.name for axis in plan.axes]
    columns = {name: column for name, column in zip(names, grid.reshape(-1, len(names)).T, strict=True)}
    for name, values in {**poses.values, "torque_share": torque_share(poses)}.items():
        if name.rpartition("/")[2] not in NOT_IN_TABLE:
            columns |= _columns(poses, name, values)
    lines: list[list[object]] = [[*names, "status", *(name for name in columns if name not in names)]]
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    for status, row in zip(poses.status, rows, strict=True):
        lines.append([*row[: len(names)], STATUS[status], *("" if x != x else x for x in row[len(names) :])])
    return as_csv(lines)


def _columns(poses: PoseMap, name: str, values: Array) -> dict[str, Array]:
    if values.ndim == 1:
        return {name: values}
    labels = {"torque": poses.motors, "torque_share": poses.motors}.get(name)
    if labels is None:
        is_vector = name.rpartition("/")[2] in ("place", "sag", "stiffness", "direction", "milling_feed")
        labels = tuple("xyz" if is_vector else map(str, range(1, values.shape[1] + 1)))
    return {f"{name} {label}": column for label, column in zip(labels, values.T, strict=False)}


CONDITIONS = {"compliant": "compliant gears", "locked": "joints locked"}
ROUND_OFF = 1e-13  # of the reach: smaller deflections are round-off, of its power a smaller manipulability
CONSTANT = 1e-9  # of the largest value: differences of less are round-off


class Quantity(NamedTuple):
    """Values (P,) in the unit of the title, NaN where a pose is impossible; whether larger is better.

    `endless`: the word for infinite ones.
    """

    title: str
    values: Array
    more_is_better: bool
    endless: str = "rigid"

    @property
    def everywhere(self) -> str:
        """The one value of all poses; empty where values differ, or none is known."""
        known = self.values[~np.isnan(self.values)]
        if not known.size or not np.isfinite(known).any():
            return self.endless if known.size else ""
        return f"{known[0]:.4g}" if np.ptp(known) <= CONSTANT * np.abs(known).max() else ""

    def text(self, pose: int) -> str:
        """Return the value of a pose as it is printed."""
        return f"{self.values[pose]:.4g}" if np.isfinite(self.values[pose]) else self.endless

    @property
    def worst(self) -> int:
        """The pose with the worst value."""
        return int(np.nanargmin(self.values) if self.more_is_better else np.nanargmax(self.values))

    @property
    def best(self) -> int:
        """Index of the pose with the best value."""
        return int(np.nanargmax(self.values) if self.more_is_better else np.nanargmin(self.values))


def quantities(poses: PoseMap) -> dict[str, Quantity]:
    """Return the mapped quantities by the names of their pictures."""
    values, table = poses.values, {}
    for condition, words in CONDITIONS.items():
        if f"joints_{condition}/frequency" in values:
            frequency = values[f"joints_{condition}/frequency"][:, 0]
            least = values[f"joints_{condition}/least_stiffness"] / 1e3
            table[f"frequency_{condition}"] = Quantity(f"lowest frequency, {words} (Hz)", frequency, True)
            table[f"stiffness_{condition}"] = Quantity(f"least stiffness, {words} (N/mm)", least, True)
        if (response := values.get(f"joints_{condition}/response")) is not None:
            peak = 1e3 * response.max(axis=(1, 2))
            table[f"response_{condition}"] = Quantity(f"largest response, {words} (mm/N)", peak, False)
        if (depth := values.get(f"joints_{condition}/milling_depth")) is not None:
            title = f"stable depth of cut, {words} (mm)"
            table[f"milling_{condition}"] = Quantity(title, 1e3 * depth, True, "unlimited")
    reach = np.nanmax(np.linalg.norm(values["place"], axis=1))
    deflection = 1e3 * _beyond(ROUND_OFF * reach, np.linalg.norm(values["sag"], axis=1))
    table["deflection"] = Quantity("static deflection (mm)", deflection, False)
    share = torque_share(poses)
    if np.isfinite(share).any():
        table["torque"] = Quantity("largest static torque (% of limit)", 100 * _largest(share), False)
    elif share.shape[1]:
        title = " or ".join({"rad": "torque (N·m)", "m": "force (N)"}[unit] for unit in dict.fromkeys(poses.units))
        table["torque"] = Quantity(f"largest static {title}", _largest(np.abs(values["torque"])), False)
    manipulability = _beyond(ROUND_OFF * reach ** values["place"].shape[1], values["manipulability"])
    table["manipulability"] = Quantity("manipulability", manipulability, True)
    size = {name: float(np.abs(one.values[np.isfinite(one.values)]).max(initial=0.0)) for name, one in table.items()}
    return {name: one._replace(values=_beyond(CONSTANT * size[name], one.values)) for name, one in table.items()}


def _beyond(round_off: float, values: Array) -> Array:
    return as_floats(np.where(np.abs(values) <= round_off, 0.0, values))


def _largest(values: Array) -> Array:
    """(P,) of (P, n), nan where all are."""
    known = np.isfinite(values)
    return as_floats(np.where(known.any(axis=1), np.where(known, values, -np.inf).max(axis=1), np.nan))


def print_map(poses: PoseMap, console: Console) -> None:
    """A table of quantities: the worst and the best value with the poses; then how many poses there are."""
    console.print(f"{poses.plan.point} over {' and '.join(axis.name for axis in poses.plan.axes)}", soft_wrap=True)
    print_table(console, ("quantity", "worst", "at", "best", "at"), _ranges(poses))
    counts = ", ".join(f"{int((poses.status == k).sum())} {name}" for k, name in enumerate(STATUS))
    console.print(f"poses      {counts}", soft_wrap=True)


def _ranges(poses: PoseMap) -> Iterator[tuple[str, ...]]:
    for quantity in quantities(poses).values():
        if quantity.everywhere:
            yield quantity.title, quantity.everywhere, "everywhere", "", ""
        elif np.isfinite(quantity.values).any():
            ends = ((quantity.text(k), _place(poses, k)) for k in (quantity.worst, quantity.best))
            yield quantity.title, *(cell for end in ends for cell in end)


def _place(poses: PoseMap, number: int) -> str:
    place = np.unravel_index(number, poses.plan.shape)
    pairs = zip(poses.plan.axes, place, strict=True)
    numbers = ((axis, axis.values[k]) for axis, k in pairs if len(axis.values) > 1)
    return ", ".join(f"{one:.3g} m" if axis.unit == "m" else f"{np.degrees(one):.3g}°" for axis, one in numbers)
