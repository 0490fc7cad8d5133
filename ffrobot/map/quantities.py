"""The quantities of a map that are one number a pose: what is printed and drawn."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..common.arrays import Array, as_floats
from .map_file import torque_share
from .pose_map import PoseMap

CONDITIONS = {"compliant": "compliant gears", "locked": "joints locked"}


class Quantity(NamedTuple):
    """Values (P,) in the unit of the title, nan where there is no pose; whether more of it is better."""

    title: str
    values: Array
    more_is_better: bool

    @property
    def worst(self) -> int:
        """The pose with the worst value."""
        return int(np.nanargmin(self.values) if self.more_is_better else np.nanargmax(self.values))

    @property
    def best(self) -> int:
        """The pose with the best value."""
        return int(np.nanargmax(self.values) if self.more_is_better else np.nanargmin(self.values))


def quantities(found: PoseMap) -> dict[str, Quantity]:
    """By the name of their picture."""
    values, table = found.values, {}
    for condition, words in CONDITIONS.items():
        if f"joints_{condition}/frequency" in values:
            frequency = values[f"joints_{condition}/frequency"][:, 0]
            least = values[f"joints_{condition}/least_stiffness"] / 1e3
            table[f"frequency_{condition}"] = Quantity(f"lowest frequency, {words} (Hz)", frequency, True)
            table[f"stiffness_{condition}"] = Quantity(f"least stiffness, {words} (N/mm)", least, True)
    deflection = 1e3 * np.linalg.norm(values["sag"], axis=1)
    table["deflection"] = Quantity("static deflection (mm)", deflection, False)
    share = torque_share(found)
    if np.isfinite(share).any():
        table["torque"] = Quantity("largest static torque (% of limit)", 100 * _largest(share), False)
    elif share.shape[1]:
        table["torque"] = Quantity("largest static torque (N·m)", _largest(np.abs(values["torque"])), False)
    table["manipulability"] = Quantity("manipulability", values["manipulability"], True)
    return table


def _largest(values: Array) -> Array:
    """(P,) of (P, n), nan where all are."""
    known = np.isfinite(values)
    return as_floats(np.where(known.any(axis=1), np.where(known, values, -np.inf).max(axis=1), np.nan))
