"""Whether the undeformed robot can follow its trajectories, and what to say where it cannot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, as_floats
from ...common.errors import InputError
from ..fields.field_types import GROUND, split_point
from ..model.model import Constraint, Model
from ..model.system import MechanismSystem
from ..scene.mechanism import MechanismKeys
from .position import SINGULAR, rank_ratio, solve_positions
from .state import State

REACH_CHECKS = 200
AXES = ("x", "y")
GOLDEN_SECTIONS = 35  # between two of them: a kink is found to 1e-7 of their distance


class _Passed(NamedTuple):
    """A configuration on the way: time (s), q (coordinates,) and its ratio of singular values."""

    t: float
    q: Array
    ratio: float


class Followed(NamedTuple):
    """The undeformed robot along its trajectories: `times` (N,), s, and coordinates `q` (N, coordinates)."""

    times: Array
    q: Array


def check_reach(assembly: MechanismSystem, start: State, times: Array) -> Followed:
    """Raise `InputError` with the first of `times` (T,), s, at which the undeformed robot cannot follow.

    A flexible arm would stretch its small-deformation modes beyond all sense instead of failing; better to say so.
    Configurations are looked at `REACH_CHECKS` times, and between them where they come close to a singular one.
    Returns those looked at, of which there is the first alone where nothing has to be followed.
    """
    if not any(assembly.is_trajectory) or len(assembly.constraints) > len(assembly.frame_coordinates):
        return Followed(as_floats(times[:1]), start.q[None])
    q, followed = start.q, list[_Passed]()
    for t in map(float, times[:: max(1, len(times) // REACH_CHECKS)]):
        following = solve_positions(assembly, t, q)
        if following is None:
            raise InputError(unreachable(assembly, t, q))
        followed.append(_Passed(t, following, rank_ratio(assembly, t, following)))
        least, at = _least_ratio(assembly, followed[-3:])
        if least < SINGULAR:
            raise InputError(unreachable(assembly, at, q))
        q = following
    return Followed(np.array([one.t for one in followed]), np.array([one.q for one in followed]))


def _least_ratio(assembly: MechanismSystem, passed: Sequence[_Passed]) -> tuple[float, float]:
    """The ratio at the last of up to three configurations, or the least about the middle one; and when.

    Where it turns zero it is a kink |t − t*|, which three samples give away: beside a smooth minimum they are alike.
    """
    t, _, ratio = passed[-1]
    if len(passed) < 3:
        return ratio, t
    (a, q, before), (_, _, least), (b, _, _) = passed
    if not (before > least < ratio and least < 2 * max(before, ratio) - 2 * least):
        return ratio, t
    inner = 0.5 * (3.0 - 5.0**0.5)  # golden section
    for _ in range(GOLDEN_SECTIONS):
        values = []
        for s in (a + inner * (b - a), b - inner * (b - a)):
            between = solve_positions(assembly, s, q)
            values.append(0.0 if between is None else rank_ratio(assembly, s, between))
            if values[-1] < SINGULAR:
                return values[-1], s
        a, b = (a, b - inner * (b - a)) if values[0] < values[1] else (a + inner * (b - a), b)
    return min(values), 0.5 * (a + b)


def unreachable(assembly: MechanismSystem, t: float, q: Array) -> str:
    """Which trajectory (or joints) the links cannot meet at time t (s), from q (coordinates,) on."""
    trajectories = [c for c in assembly.constraints if c.is_trajectory]
    how = (
        "cannot reach from the guess in initial.angles (rad)"
        if solve_positions(assembly, t, q) is None
        else "reach only in a singular configuration (stretched, folded, at a dead centre), where forces on it do not"
        " determine the direction of motion. Avoid it, or drive a joint instead"
    )
    scene = assembly.model.scene
    only_joints = MechanismSystem(assembly.model, assembly.model.joints)
    if trajectories and solve_positions(only_joints, t, q) is not None:
        more = "".join(f"; {text}" for text in (_distance(assembly, trajectories, t), *turned_guesses(scene)) if text)
        return (
            f"{assembly.model.scene.path}: {owners(trajectories)}: expected a target within reach, found one at"
            f" t = {t:.6g} s that the undeformed links {how}{more}"
        )
    return (
        f"{assembly.model.scene.path}: expected joints that can be closed, found that"
        f" {owners([c for c in assembly.constraints if not c.is_trajectory])}"
        f" cannot be met at t = {t:g} s from the initial angles"
    )


def _distance(assembly: MechanismSystem, trajectories: Sequence[Constraint], t: float) -> str:
    """How far the target of the first point among trajectories is at t (s), and how far the links reach."""
    model = assembly.model
    points = {record.name: record.point for record in model.scene.trajectory if record.point is not None}
    held = [c for c in trajectories if c.owner in points and c.component in AXES]
    chain = _chain(model, points[held[0].owner]) if held else None
    if chain is None:
        return ""
    of_point = [c for c in held if c.owner == held[0].owner]
    away = [float(c.target.sample(np.array([t]))[0][0]) - chain.at[AXES.index(c.component)] for c in of_point]
    distance, along = float(np.hypot.reduce(away)), "" if len(away) > 1 else f" along {of_point[0].component}"
    unit = ': are these m? (mm are written "750*mm")' if distance > 10 * chain.reach else ""
    return (
        f'it is {distance:.4g} m{along} from joint "{chain.joint}" on the ground, from which the links reach'
        f" {chain.reach:.4g} m{unit}"
    )


class _Chain(NamedTuple):
    """The joint on the ground behind which a point is, its place (2,), m, and the most that links reach from there."""

    joint: str
    at: tuple[float, float]
    reach: float


def _chain(model: Model, point: str) -> _Chain | None:
    """Of a point ("BODY.POINT"), by the undeformed links that carry it; None where a way between them is open."""
    scene, reach = model.scene, 0.0
    while point != GROUND:
        name, own = split_point(point)
        carrier = scene.topology.grounded[name]
        joint, places = scene.joint[carrier.joint], model.body(name).points
        if joint.type not in ("revolute", "weld"):
            return None
        reach += float(np.linalg.norm(places[own].position - places[split_point(carrier.own)[1]].position))
        point = carrier.other
    return _Chain(joint.name, joint.at, reach)


def turned_guesses(scene: MechanismKeys) -> list[str]:
    """Guesses of angles beyond a whole turn, which are degrees as a rule; a text each."""
    turning = {joint.name for joint in scene.joint if joint.type == "revolute"}
    joints = {name: angle for name, angle in scene.initial.joints.items() if name in turning}
    return [
        f'initial.{table}: {name} = {angle:g} rad is more than a turn (degrees are written "{angle:g}*deg")'
        for table, guesses in (("angles", scene.initial.angles), ("joints", joints))
        for name, angle in guesses.items()
        if abs(angle) > 2 * np.pi
    ]


def owners(constraints: Sequence[Constraint]) -> str:
    """The trajectories among the owners of constraints, else the joints, as messages call them."""
    trajectories = [c for c in constraints if c.is_trajectory] or constraints
    kind = "trajectory" if trajectories and trajectories[0].is_trajectory else "joint"
    return ", ".join(dict.fromkeys(f'{kind} "{c.owner}"' for c in trajectories))
