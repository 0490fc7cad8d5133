"""Why a 3D run ended before its end: what is wrong with the last state that it reached."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...common.arrays import Array
from .. import _core
from .._core import TimeFunction
from ..model.spatial_system import SpatialSystem
from ..scene.analysis import IntegratedAnalysis
from .diagnosis import load_jump, not_a_number, too_far_bent
from .integrators import EXPLICIT, Choice, beyond_order, unmet
from .spatial_integrators import TOO_STIFF, fastest_friction
from .state import State


def find_cause_in_space(system: SpatialSystem, analysis: IntegratedAnalysis, choice: Choice, run: _core.TreeRun) -> str:
    """A sentence with advice, the likely causes of a failure, the more certain first; empty where nothing is found.

    A target that is not a number, a link bent too far, a load that jumps, friction; where steps became too short,
    the integrator.
    """
    t, at = run.time_reached, State(*np.split(np.array(run.last), [system.model.tree.n_q]))
    found = (
        not_a_number(_targets(system), lambda: _accelerations(system, t, run.last), t)
        or too_far_bent(_links(system, at))
        or load_jump(_loads(system), t)
        or _friction(system, analysis, choice, at)
    )
    if found or run.status != _core.IntegrationStatus.step_underflow:
        return found
    return beyond_order(choice, analysis) or unmet(choice, run)


def _accelerations(system: SpatialSystem, t: float, state: Array) -> Array:
    return _core.tree_outputs(system.core, system.scene, [t], np.array(state)[None]).accelerations


def _loads(system: SpatialSystem) -> Iterator[tuple[str, TimeFunction]]:
    for load in system.model.scene.load:
        for name, size in load.components.items():
            yield f'load on "{load.point or load.joint or load.pzt}", {name},', size


def _targets(system: SpatialSystem) -> Iterator[tuple[str, TimeFunction]]:
    for row in system.model.rows:
        functions = row.law.functions if row.law is not None else () if row.target is None else (row.target,)
        yield from ((f'trajectory "{row.owner}"', function) for function in functions)


def _links(system: SpatialSystem, at: State) -> Iterator[tuple[str, Array, float]]:
    for node in system.model.tree.nodes:
        if node.body.n_modes:
            yield node.body.name, at.q[node.p_q], node.body.largest_moment


def _friction(system: SpatialSystem, analysis: IntegratedAnalysis, choice: Choice, at: State) -> str:
    rate, joint = fastest_friction(system, at)
    if rate * analysis.end <= TOO_STIFF:
        return ""
    implicit = 'integrator = "radau", ' if choice.name in EXPLICIT else ""
    return (
        f"friction of {joint} brings it to rest within {1 / rate:.1e} s, which steps of {choice.name} cannot follow:"
        f" use {implicit}less friction or a larger friction_speed"
    )
