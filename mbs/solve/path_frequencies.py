"""Frequencies of the robot's vibrations along a path that is held, about which input shapers are designed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...common.arrays import Array, as_floats
from ...common.errors import InputError
from ..model.model import Model
from ..model.system import MechanismSystem
from .initial_state import undeformed_state
from .position import solve_positions
from .reach import unreachable
from .state import State
from .vibration import vibrations

INSTANTS = 9


@dataclass(frozen=True)
class PathFrequencies:
    """The lowest vibrations of the undeformed robot at instants of a path: (instants, modes), Hz and damping ratios."""

    frequency: Array
    damping_ratio: Array


def path_frequencies(model: Model, begin: float, end: float, modes: int) -> PathFrequencies:
    """Of the `modes` lowest vibrations with the trajectories held, at instants from `begin` to `end`, s.

    Raises `InputError` where the path is out of reach, or there are fewer vibrations.
    """
    assembly = MechanismSystem(model, [*model.joints, *model.trajectories])
    state, found = undeformed_state(assembly), []
    q = state.q
    for t in np.linspace(begin, end, INSTANTS):
        following = solve_positions(assembly, float(t), q)
        if following is None:
            raise InputError(unreachable(assembly, float(t), q))
        q = following
        each = vibrations(assembly, State(q, np.zeros_like(state.v)))
        found.append((each.frequency, each.damping_ratio))
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
