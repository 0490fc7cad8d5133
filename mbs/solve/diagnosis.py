"""Why a run ended before its end: what is wrong with the last state that it reached."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from ...common.arrays import Array
from .._core import TimeFunction
from ..model.planar_tree import PlanarTree
from ..model.system import MechanismSystem
from .path_checks import JUMP
from .position import frame_gradients
from .state import State

NEARLY_SINGULAR = 1e-3  # ratio of singular values of C_q; a motion that only comes near it has no trouble there
FAR_BENT = 0.5  # of a link's radius of gyration, in the mean


def find_cause(assembly: MechanismSystem, t: float, state: State) -> str:
    """A sentence with numbers and advice; empty where nothing is found.

    The likely causes, the more certain first: a state or target that is not a number, a link bent too far, a load that
    jumps, constraints that turn singular.
    """
    return (
        not_a_number(
            ((constraint.measure.label, constraint.target) for constraint in assembly.constraints),
            lambda: PlanarTree(assembly).evaluate(t, state.q, state.v)[0],
            t,
        )
        or too_far_bent(_links(assembly, state.q))
        or load_jump(_loads(assembly), t)
        or _singular(assembly, t, state.q)
    )


def not_a_number(targets: Iterable[tuple[str, TimeFunction]], accelerations: Callable[[], Array], t: float) -> str:
    """Which of the targets, each with its label, is no number at t, or whether the accelerations there are none."""
    for label, target in targets:
        if not np.isfinite(target(t)).all():
            return f"{label} has no finite value, velocity or acceleration there"
    if not np.isfinite(accelerations()).all():
        return "the accelerations there are no finite numbers: a load or a target grows without bound"
    return ""


def _loads(assembly: MechanismSystem) -> Iterator[tuple[str, TimeFunction]]:
    yield from ((row.label, size) for row, size in assembly.model.loads)
    yield from ((f'load of the patches of "{load.body}"', load.magnitude) for load in assembly.model.modal_loads)


def load_jump(loads: Iterable[tuple[str, TimeFunction]], t: float) -> str:
    """Which of the loads, each with its label, jumps at t: its size just after t does not follow from that before."""
    dt = 1e-9 * max(t, 1e-9)
    for label, size in loads:
        before, after = (size(s) for s in (t - dt, t + dt))
        if not np.isfinite(after).all():
            return f"{label} has no finite value, slope or curvature after that time"
        change = after[0] - before[0] - dt * (before[1] + after[1])
        if abs(change) > JUMP * max(abs(before[0]), abs(after[0])):
            return f"{label} jumps from {before[0]:.6g} to {after[0]:.6g} there: round it off, or loosen the tolerance"
    return ""


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
        " load beyond buckling, a spin that needs geometric_stiffening = true, a link too soft, or an arm without"
        " motors that falls apart"
    )


def _links(assembly: MechanismSystem, q: Array) -> Iterator[tuple[str, Array, float]]:
    for first, body in zip(assembly.first, assembly.model.bodies, strict=True):
        if body.n_modes:
            yield body.name, q[first + 3 : first + 3 + body.n_modes], body.inertia


def _singular(assembly: MechanismSystem, t: float, q: Array) -> str:
    """Whether the constraints can hardly be told apart there."""
    if not assembly.constraints:
        return ""
    J = frame_gradients(assembly, t, q)
    if len(J) > J.shape[1]:
        return ""
    left, values, _ = np.linalg.svd(J)
    ratio = float(values[-1] / values[0])
    if ratio > NEARLY_SINGULAR:
        return ""
    weights = np.abs(left[:, -1])
    involved = dict.fromkeys(c.measure.label for c, w in zip(assembly.constraints, weights, strict=True) if w > 0.1)
    return (
        f"the configuration is singular or nearly so (ratio of singular values {ratio:.1g}; {'; '.join(involved)}):"
        " an arm stretched or folded, or a mechanism at a dead centre, where forces on the driven point do not"
        " determine the direction of motion. Avoid it, or drive a joint instead"
    )
