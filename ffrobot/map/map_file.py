"""Files of a map: map.h5 with arrays over the grid, table.csv with a line for each pose; printed summary."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console

from ..common.arrays import Array
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
    "response": "m/N",
    "torque": "N·m or N",
    "best_turn": "rad",
    "best_turn_depth": "m",
    "sag": "m",
    "place": "m",
    "robot": "m",
    "milling_depth": "m",
    "milling_best_depth": "m",
    "milling_lobes": "m",
    "milling_deviation": "m",
}
NOT_IN_TABLE = ("compliance", "response", "robot", "milling_lobes")


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
        of_poses = {**poses.values, "q": poses.q}
        arrays = {name: values.reshape(*plan.shape, *values.shape[1:]) for name, values in of_poses.items()}
        for condition, (turn, depth) in best_turns(poses).items():
            arrays |= {f"{condition}/best_turn": turn, f"{condition}/best_turn_depth": depth}
        for name, values in arrays.items():
            file[name] = values
            file[name].attrs["unit"] = UNITS.get(name.rpartition("/")[2], "")
        image = image_of(file)
    write_atomically(plan.folder / FILE, sealed(image), "map", make_folder=True, ours=True)
    write_atomically(plan.folder / TABLE, _table(poses).encode(), "table of the map", ours=True)
    return plan.folder / FILE


def _table(poses: PoseMap) -> str:
    plan = poses.plan
    grid = np.stack(np.meshgrid(*(axis.values for axis in plan.axes), indexing="ij"), axis=-1)
    names = [axis.name for axis in plan.axes]
    columns = dict(zip(names, grid.reshape(-1, len(names)).T, strict=True))
    for name, values in poses.values.items():
        if name.rpartition("/")[2] not in NOT_IN_TABLE:
            columns |= _columns(poses, name, values)
    lines: list[list[object]] = [[*names, "status", *list(columns)[len(names) :]]]
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


def best_turns(poses: PoseMap) -> dict[str, tuple[Array, Array]]:
    """Return, for "compliant" and "locked" joints, the tool's turn (rad) of largest stable depth, and this depth (m).

    Arrays (…) over the axes of the grid except "turn"; NaN where no turn is possible. Empty without turns or milling.
    """
    plan = poses.plan
    if plan.turned_about is None:
        return {}
    angles, turns = plan.axes[_turn_axis(poses)].values, {}
    for name in (name for name in poses.values if name.endswith("/milling_depth")):
        depth = np.moveaxis(poses.values[name].reshape(plan.shape), _turn_axis(poses), -1)
        best = np.where(np.isnan(depth), -1.0, depth).argmax(axis=-1)
        largest = np.take_along_axis(depth, best[..., None], axis=-1)[..., 0]
        turns[name.partition("/")[0]] = np.where(np.isnan(largest), np.nan, angles[best]), largest
    return turns


CONDITIONS = {"compliant": "compliant gears", "locked": "joints locked"}
ROUND_OFF = 1e-13  # of the reach (deflections), or of its power (manipulability)
CONSTANT = 1e-9  # of the largest value: differences of less are round-off


class Quantity(NamedTuple):
    """Values (P,) in P poses in the unit of the title, NaN in impossible ones; whether larger is better.

    `endless`: the word for infinite values.
    """

    title: str
    values: Array
    more_is_better: bool
    endless: str = "rigid"

    @property
    def everywhere(self) -> str:
        """Text of the value of all poses; empty where values differ, or none is known."""
        known = self.values[~np.isnan(self.values)]
        if not known.size or not np.isfinite(known).any():
            return self.endless if known.size else ""
        return f"{known[0]:.4g}" if np.ptp(known) <= CONSTANT * np.abs(known).max() else ""

    def text(self, pose: int) -> str:
        """Return the value in pose number `pose` as text."""
        return f"{self.values[pose]:.4g}" if np.isfinite(self.values[pose]) else self.endless

    @property
    def extremes(self) -> tuple[int, int]:
        """Numbers of the poses with the worst and the best value."""
        least, largest = int(np.nanargmin(self.values)), int(np.nanargmax(self.values))
        return (least, largest) if self.more_is_better else (largest, least)


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
    share = values["torque_share"]
    if np.isfinite(share).any():
        table["torque"] = Quantity("largest static torque (% of limit)", 100 * np.fmax.reduce(share, axis=1), False)
    elif share.shape[1]:
        title = " or ".join({"rad": "torque (N·m)", "m": "force (N)"}[unit] for unit in dict.fromkeys(poses.units))
        table["torque"] = Quantity(f"largest static {title}", np.fmax.reduce(np.abs(values["torque"]), axis=1), False)
    manipulability = _beyond(ROUND_OFF * reach ** values["place"].shape[1], values["manipulability"])
    table["manipulability"] = Quantity("manipulability", manipulability, True)
    for name, one in table.items():
        size = np.abs(one.values).max(where=np.isfinite(one.values), initial=0.0)
        table[name] = one._replace(values=_beyond(CONSTANT * size, one.values))
    return table


def _beyond(round_off: float, values: Array) -> Array:
    return np.where(np.abs(values) <= round_off, 0.0, values)


def print_map(poses: PoseMap, console: Console) -> None:
    """Print a table of quantities, with the worst and the best value and their poses, and numbers of poses."""
    console.out(f"{poses.plan.point} over {' and '.join(axis.name for axis in poses.plan.axes)}")
    print_table(console, ("quantity", "worst", "at", "best", "at"), _ranges(poses))
    for line in _milling(poses):
        console.out(f"milling    {line}")
    counts = ", ".join(f"{int((poses.status == k).sum())} {name}" for k, name in enumerate(STATUS))
    console.out(f"poses      {counts}")


def _ranges(poses: PoseMap) -> Iterator[tuple[str, ...]]:
    for quantity in quantities(poses).values():
        if quantity.everywhere:
            yield quantity.title, quantity.everywhere, "everywhere", "", ""
        elif np.isfinite(quantity.values).any():
            ends = ((quantity.text(k), _place(poses, k)) for k in quantity.extremes)
            yield quantity.title, *(cell for end in ends for cell in end)


def _milling(poses: PoseMap) -> Iterator[str]:
    """Smallest stable depth with other feeds or turns of the tool, and its deviation."""
    condition = next((f"joints_{one}" for one in CONDITIONS if f"joints_{one}/milling_depth" in poses.values), "")
    of = {name.partition("/")[2]: values for name, values in poses.values.items() if name.startswith(condition)}
    if not condition or not np.isfinite(of["milling_depth"]).any():
        return
    worst = int(np.nanargmin(of["milling_depth"]))
    least, best = 1e3 * of["milling_depth"][worst], 1e3 * of["milling_best_depth"][worst]
    if "milling_deviation" in of:
        yield f"{least:.4g} mm ± {2e3 * of['milling_deviation'][worst]:.2g} mm (two deviations by errors of the fit)"
    if best > least * (1 + CONSTANT):
        feed = ", ".join(f"{x:.3g}" for x in of["milling_feed"][worst])
        yield f"{best:.4g} mm in the worst pose with the best feed, along ({feed}), instead of {least:.4g} mm"
    if condition in (turns := best_turns(poses)):
        depth = np.moveaxis(of["milling_depth"].reshape(poses.plan.shape), _turn_axis(poses), 0)
        at_all = np.where(np.isnan(depth), -1.0, depth).reshape(len(depth), -1).min(axis=1)
        if at_all.max() > 0.0:
            angle = poses.plan.axes[_turn_axis(poses)].values[at_all.argmax()]
            yield f"{1e3 * at_all.max():.4g} mm at all places with the tool turned by {np.degrees(angle):.4g}°"
        each = turns[condition][1]
        yield f"{1e3 * np.nanmin(each):.4g} mm with the best turn of each place"


def _turn_axis(poses: PoseMap) -> int:
    return [axis.is_turn for axis in poses.plan.axes].index(True)


def _place(poses: PoseMap, number: int) -> str:
    place = np.unravel_index(number, poses.plan.shape)
    pairs = zip(poses.plan.axes, place, strict=True)
    numbers = ((axis, axis.values[k]) for axis, k in pairs if len(axis.values) > 1)
    return ", ".join(f"{one:.3g} m" if axis.unit == "m" else f"{np.degrees(one):.3g}°" for axis, one in numbers)
