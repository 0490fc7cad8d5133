"""What a motor can do, in the plane of speed and moment."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..common.arrays import Array
from ..mbs.joints.joints import JOINT_TYPES
from ..mbs.joints.transmission import MotorLimits
from ..results.file import Results

MARGIN = 1.15  # of the largest moment or speed, where no limit ends the curve of the power
POINTS = 60  # of that curve


def motor_limits(results: Results, joint: str) -> MotorLimits:
    """Of a joint of the scene; infinite where it gives none."""
    keys = joint_keys(results, joint)
    return MotorLimits(*(float(keys.get(f"{what}_limit") or np.inf) for what in ("moment", "speed", "power")))


def joint_keys(results: Results, joint: str) -> dict[str, Any]:
    """What the scene says of a joint; nothing of one that it does not have."""
    return next((keys for keys in results.scene.get("joint", []) if keys["name"] == joint), {})


def force_unit(results: Results, joint: str) -> str:
    """Of the force along a joint's coordinate: "N·m" or "N"."""
    return JOINT_TYPES[str(joint_keys(results, joint)["type"])].force_unit


def coordinate_unit(results: Results, joint: str) -> str:
    """Of a joint's coordinate: "rad" or "m"."""
    return "rad" if force_unit(results, joint) == "N·m" else "m"


def limit_curves(limits: MotorLimits, speed: float, moment: float) -> Array:
    """Where |τ| ≤ τ_max, |γ̇| ≤ γ̇_max and |τ γ̇| ≤ P_max end: (n, 2) speeds and moments, NaN between pieces.

    In all four quadrants; the curve of the power goes as far as the data, `speed` and `moment` at most, ask for. Empty
    without limits.
    """
    speed_end = min(limits.speed, MARGIN * max(speed, limits.power / limits.moment, 1e-300))
    moment_end = min(limits.moment, MARGIN * max(moment, limits.power / speed_end, 1e-300))
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
