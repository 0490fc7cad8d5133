"""Why steps of a run in space have become too short: what acts at the last state that it reached."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .. import _core
from .._core import TimeFunction
from ..model.spatial_system import SpatialSystem
from ..scene.analysis import IntegratedAnalysis
from .diagnosis import load_jump
from .integrators import EXPLICIT, Choice, beyond_order, unmet
from .spatial_integrators import TOO_STIFF, fastest_friction
from .state import State

FAR_BENT = 0.5  # of a link's radius of gyration, in the mean


def cause_of_short_steps(
    system: SpatialSystem, analysis: IntegratedAnalysis, choice: Choice, run: _core.TreeRun
) -> str:
    """A sentence with advice, the more certain causes first: loads, links bent too far, friction, the integrator."""
    t, at = run.time_reached, State(*np.split(np.array(run.last), [system.model.tree.n_q]))
    return (
        load_jump(_loads(system), t)
        or _bent(system, at)
        or _friction(system, analysis, choice, at)
        or beyond_order(choice, analysis)
        or unmet(choice, run)
    )


def _loads(system: SpatialSystem) -> Iterator[tuple[str, TimeFunction]]:
    for load in system.model.scene.load:
        for name, size in load.components.items():
            yield f'load on "{load.point or load.joint or load.pzt}", {name},', size


def _bent(system: SpatialSystem, at: State) -> str:
    nodes = [node for node in system.model.tree.nodes if node.body.n_modes]
    bent = [
        (float(np.linalg.norm(at.q[node.p_q]) / np.sqrt(np.linalg.eigvalsh(node.body.inertia)[-1])), node.body.name)
        for node in nodes
    ]
    most, name = max(bent, default=(0.0, ""))
    if not most > FAR_BENT:
        return ""
    return (
        f'"{name}" is bent by {100 * most:.0f} % of its length, which small deformations do not describe: a load beyond'
        " buckling, a spin that needs geometric_stiffening = true, a link too soft, or joints that nothing holds"
    )


def _friction(system: SpatialSystem, analysis: IntegratedAnalysis, choice: Choice, at: State) -> str:
    rate, joint = fastest_friction(system, at)
    if rate * analysis.end <= TOO_STIFF:
        return ""
    implicit = 'integrator = "radau", ' if choice.name in EXPLICIT else ""
    return (
        f"friction of {joint} brings it to rest within {1 / rate:.1e} s, which steps of {choice.name} cannot follow:"
        f" use {implicit}less friction or a larger friction_speed"
    )
