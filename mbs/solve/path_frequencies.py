"""Frequencies of the robot's vibrations along a path that is held, about which input shapers are designed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...common.arrays import Array, as_floats
from ...common.errors import InputError, quoted
from ..model.gears import with_prescribed_motors
from ..model.model import Model
from .posture import solve_posture
from .redundancy import resolved
from .start import relaxed_gears, undeformed_posture
from .state import State
from .vibration import vibrations_of, without_rows

INSTANTS = 9


@dataclass(frozen=True)
class PathFrequencies:
    """The lowest vibrations of the undeformed robot at instants of a path: (instants, modes), Hz and damping ratios."""

    frequency: Array
    damping_ratio: Array


def frequencies_along(model: Model, begin: float, end: float, modes: int) -> PathFrequencies:
    """Of the `modes` lowest vibrations of the undeformed robot with its trajectories held, from `begin` to `end`, s.

    Where motors follow them, compliant gears are among its springs. Joints that the paths leave free are free.
    Raises `InputError` where the path is out of reach, or there are fewer vibrations.
    """
    model = with_prescribed_motors(resolved(model, end))
    unconstrained = without_rows(model)
    state, found = undeformed_posture(model), []
    for t in np.linspace(begin, end, INSTANTS):
        q = solve_posture(model, float(t), state.q)
        if q is None:
            raise InputError(
                f"{model.scene.path}: trajectory: expected paths within reach, found no posture of the undeformed robot"
                f" at t = {t:.6g} s that meets {quoted(dict.fromkeys(row.owner for row in model.rows))}"
            )
        state = relaxed_gears(model, State(q, np.zeros_like(state.v)))
        found.append(vibrations_of(model, unconstrained, float(t), state.q)[:2])
    return common_modes(model.scene.path, found, modes)


def common_modes(path: Path, found: Sequence[tuple[Array, Array]], modes: int) -> PathFrequencies:
    """The `modes` lowest of ω (rad/s) and damping ratios by instant. Raises `InputError` where one has fewer."""
    most = min(len(omega) for omega, _ in found)
    if most < modes:
        raise InputError(
            f"{path}: trajectory: shaper.modes: expected at most {most}, the number of vibrations on the constrained"
            f" path, found {modes}"
        )
    frequency = np.array([omega[:modes] for omega, _ in found]) / (2 * np.pi)
    return PathFrequencies(as_floats(frequency), np.array([ratio[:modes] for _, ratio in found]))
