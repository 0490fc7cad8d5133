"""Why a run ended before its end: what is wrong with the last state that it reached."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from ...common.arrays import Array
from .. import _core
from .._core import TimeFunction
from ..model.known_motion import State
from ..model.system import MultibodySystem
from ..posture.posture import JUMP, describe_loops
from ..scene.analysis import IntegratedAnalysis
from .integrator_choice import TOO_STIFF, fastest_friction
from .integrators import EXPLICIT, Choice, beyond_order, unmet

FAR_BENT = 0.5  # of a link's radius of gyration, in the mean


def find_cause(system: MultibodySystem, analysis: IntegratedAnalysis, choice: Choice, run: _core.TreeRun) -> str:
    """A sentence with advice, the likely causes of a failure, the more certain first; empty where nothing is found.

    A target that is not a number, a link bent too far, a load that jumps, friction, a singular posture of loops; where
    steps became too short, the integrator.
    """
    t, at = run.time_reached, State(*np.split(np.array(run.last), [system.model.tree.n_q]))

    def accelerations() -> Array:
        return _core.tree_outputs(system.core, system.scene, [t], np.array(run.last)[None]).accelerations

    causes = (
        not_a_number(_targets(system), accelerations, t)
        or too_far_bent(_links(system, at))
        or load_jump(_loads(system), t)
        or _friction(system, analysis, choice, at)
        or describe_loops(system.model, t, at.q, at.v)
    )
    if causes or run.status != _core.IntegrationStatus.step_underflow:
        return causes
    return beyond_order(choice, analysis) or unmet(choice, run)


def _targets(system: MultibodySystem) -> Iterator[tuple[str, TimeFunction]]:
    for row in system.model.rows:
        functions = row.law.functions if row.law is not None else () if row.target is None else (row.target,)
        yield from ((f'trajectory "{row.owner}"', function) for function in functions)


def not_a_number(targets: Iterable[tuple[str, TimeFunction]], accelerations: Callable[[], Array], t: float) -> str:
    """Return which labelled target is not finite at t (s), or that accelerations are not finite; else ""."""
    for label, target in targets:
        if not np.isfinite(target(t)).all():
            return f"{label} has no finite value, velocity or acceleration there"
    if not np.isfinite(accelerations()).all():
        return "the accelerations there are no finite numbers: a load or a target grows without bound"
    return ""


def _links(system: MultibodySystem, at: State) -> Iterator[tuple[str, Array, float]]:
    for node in system.model.tree.nodes:
        if node.body.n_modes:
            yield node.body.name, at.q[node.p_q], node.body.largest_moment


def too_far_bent(links: Iterable[tuple[str, Array, float]]) -> str:
    """The link that is bent most, by its modal coordinates p and largest moment of inertia about its origin, kg·m².

    |p|/√J is the mean of its deflection against its radius of gyration.
    """
    bent = [(float(np.linalg.norm(p) / np.sqrt(inertia)), name) for name, p, inertia in links]
    most, name = max(bent, default=(0.0, ""))
    if not most > FAR_BENT:
        return ""
    return (
        f'"{name}" is bent by {100 * most:.0f} % of its length, which violates small deformations. Possible causes: a'
        " path too fast, a load beyond buckling, a spin that needs geometric_stiffening = true, a link too soft,"
        " or an arm without motors that falls apart"
    )


def _loads(system: MultibodySystem) -> Iterator[tuple[str, TimeFunction]]:
    for load in system.model.scene.load:
        for name, size in load.components.items():
            component = name.removesuffix("[0]") if len(load.moments) == 1 else name
            yield f'load on "{load.point or load.joint or load.pzt}", {component},', size


def load_jump(loads: Iterable[tuple[str, TimeFunction]], t: float) -> str:
    """Return which labelled load jumps at t (s), or has no finite value from there on; else "".

    Functions of Python may have values alone: the changes just before and just after t tell what is no jump.
    """
    dt = 1e-9 * max(t, 1e-9)
    for label, size in loads:
        values = [size(t + k * dt) for k in (-3, -1, 1, 3)]
        if not (np.isfinite(values[2]) | ~np.isfinite(values[1])).all():
            return f"{label} has no finite value, slope or curvature after that time"
        first, before, after, last = (value[0] for value in values)
        change = abs(after - before) - abs(before - first) - abs(last - after)
        if change > JUMP * max(abs(before), abs(after)):
            return f"{label} jumps from {before:.6g} to {after:.6g} there: round it off, or loosen the tolerance"
    return ""


def _friction(system: MultibodySystem, analysis: IntegratedAnalysis, choice: Choice, at: State) -> str:
    rate, joint = fastest_friction(system, at)
    if rate * analysis.end <= TOO_STIFF:
        return ""
    implicit = 'integrator = "radau", ' if choice.name in EXPLICIT else ""
    return (
        f"friction of {joint} brings it to rest within {1 / rate:.1e} s, which steps of {choice.name} cannot follow:"
        f" use {implicit}less friction or a larger friction_speed"
    )
