"""What a motor can do, in the plane of speed and moment."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..common.arrays import Array
from ..mbs.joints.joint import MotorLimits
from ..results.file import Results
from ..results.joints import joint_coordinates

MARGIN = 1.15  # of the largest moment or speed, where no limit ends a curve
POINTS = 60  # of that curve


def limits_of(results: Results, joint: str, datasets: Sequence[str]) -> MotorLimits:
    """Of the motor of a joint of which `datasets` such as "…/moment" or "…/moment[1]" are drawn; infinite without any.

    Of several coordinates of a joint each has its limits: those of the one that the first dataset is of.
    """
    column = next((name.partition("[")[2].rstrip("]") for name in datasets), "")
    coordinates, number = joint_coordinates(results.scene, joint), int(column or 0)
    return coordinates[number].limits if number < len(coordinates) else MotorLimits()


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
