"""Where a run starts: coordinates and velocities that meet the constraints, and whether that can go on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ..fields.field_types import GROUND, split_point
from ..model.measures import FRAME, Marker
from ..model.model import Constraint, MechanismSystem
from ..model.transmissions import Gear
from ..scene.mechanism_records import Joint

TOLERANCE = 1e-13  # of constraints at the start, relative to the size of the robot
SINGULAR = 1e-6  # ratio of singular values below which a configuration counts as singular
REDUNDANT = 1e-10  # likewise for rows that repeat each other in every configuration
MOST_ITERATIONS = 50
LARGEST_TURN = 0.5  # rad (and sizes of the robot) a Newton step may move: keeps to the branch of the guess
REACH_CHECKS = 200
GOLDEN_SECTIONS = 35  # between two of them: a kink is found to 1e-7 of their distance


@dataclass(frozen=True)
class State:
    """Coordinates q = (R, θ, p of each body) and their rates v."""

    q: Array
    v: Array


def undeformed_state(assembly: MechanismSystem) -> State:
    """The state with p = ṗ = 0 that meets all constraints at t = 0, next to the guessed angles and rates.

    Raises `InputError` for constraints that repeat or contradict each other, a target out of reach, and a singular
    configuration, naming the trajectory or joints.
    """
    guess = _chain_guess(assembly)
    _check_redundancy(assembly, guess.q)
    q = _newton(assembly, 0.0, guess.q)
    if q is None:
        raise InputError(_unreachable(assembly, 0.0, guess.q))
    if _freedom_of_constraints(assembly, 0.0, q) < SINGULAR:
        raise InputError(_singular_start(assembly, q))
    return _unwound(assembly, with_rates(assembly, q, guess.v))


def _unwound(assembly: MechanismSystem, state: State) -> State:
    """The state with rotors where their gears are not strained."""
    q, v = state.q.copy(), state.v.copy()
    for gear in assembly.model.gears:
        rotor = assembly.first[assembly.index[gear.rotor]] + 2
        q[rotor], v[rotor] = output_angle(assembly, gear, q), output_angle(assembly, gear, v)
    return State(q, v)


def output_angle(assembly: MechanismSystem, gear: Gear, x: Array) -> float:
    """γ + α_a/N, which is a rotor's angle over N where its gear is not strained; of q, or its rate of v."""

    def angle(end: Marker) -> float:
        if end.body is None:
            return 0.0
        first, body = assembly.first[assembly.index[end.body]], assembly.model.body(end.body)
        bent = 0.0 if end.point == FRAME else body.points[end.point].rotation @ x[first + 3 : first + 3 + body.n_modes]
        return float(x[first + 2] + bent)

    return angle(gear.coordinate.b) - (1 - 1 / gear.ratio) * angle(gear.coordinate.a)


def with_rates(assembly: MechanismSystem, q: Array, v: Array) -> State:
    """The state at q with (Ṙ, θ̇) moved onto Ċ = 0 by the least change, ṗ kept."""
    _, rate, _ = assembly.system.constraints(0.0, q, v)
    v = v.copy()
    v[assembly.frame_coordinates] -= _least_step(assembly, 0.0, q, rate)
    return State(q, v)


def frame_gradients(assembly: MechanismSystem, t: float, q: Array) -> Array:
    """∂C/∂(R, θ) with rows and columns relative to their natural sizes: the same in all units."""
    _, _, C_q = assembly.system.constraints(t, q, np.zeros_like(q))
    r = assembly.frame_coordinates
    J: Array = C_q[:, r] * assembly.sizes[r] / assembly.row_sizes[:, None]
    return J


def _least_step(assembly: MechanismSystem, t: float, q: Array, residual: Array) -> Array:
    """The smallest change of (R, θ) that takes `residual` off C (or, as a rate, off Ċ)."""
    J = frame_gradients(assembly, t, q)
    step: Array = np.linalg.lstsq(J, residual / assembly.row_sizes, rcond=None)[0]
    return step * assembly.sizes[assembly.frame_coordinates]


def check_reach(assembly: MechanismSystem, start: State, times: Array) -> None:
    """Raise `InputError` with the first time at which the undeformed robot cannot follow its trajectories.

    A flexible arm would stretch its small-deformation modes beyond all sense instead of failing; better to say so.
    Configurations are looked at `REACH_CHECKS` times, and between them where they come close to a singular one.
    """
    if not any(assembly.is_trajectory) or len(assembly.constraints) > len(assembly.frame_coordinates):
        return
    q, passed = start.q, list[tuple[float, Array, float]]()
    for t in map(float, times[:: max(1, len(times) // REACH_CHECKS)]):
        following = _newton(assembly, t, q)
        if following is None:
            raise InputError(_unreachable(assembly, t, q))
        passed = [*passed[-2:], (t, following, _freedom_of_constraints(assembly, t, following))]
        least, at = _least_freedom(assembly, passed)
        if least < SINGULAR:
            raise InputError(_unreachable(assembly, at, q))
        q = following


def _least_freedom(assembly: MechanismSystem, passed: Sequence[tuple[float, Array, float]]) -> tuple[float, float]:
    """The freedom of constraints at the last of up to three configurations, or the least about the middle one; when.

    Where it turns zero it is a kink |t − t*|, which three samples give away: beside a smooth minimum they are alike.
    """
    t, _, freedom = passed[-1]
    if len(passed) < 3:
        return freedom, t
    (a, q, before), (_, _, least), (b, _, _) = passed
    if not (before > least < freedom and least < 2 * max(before, freedom) - 2 * least):
        return freedom, t
    inner = 0.5 * (3.0 - 5.0**0.5)  # golden section
    for _ in range(GOLDEN_SECTIONS):
        values = []
        for s in (a + inner * (b - a), b - inner * (b - a)):
            between = _newton(assembly, s, q)
            values.append(0.0 if between is None else _freedom_of_constraints(assembly, s, between))
            if values[-1] < SINGULAR:
                return values[-1], s
        a, b = (a, b - inner * (b - a)) if values[0] < values[1] else (a + inner * (b - a), b)
    return min(values), 0.5 * (a + b)


def _newton(assembly: MechanismSystem, t: float, q: Array) -> Array | None:
    """(R, θ) moved onto C(q, t) = 0 by steps of least size, p kept; None where that does not converge."""
    q, r = q.copy(), assembly.frame_coordinates
    rest, sizes, row_sizes = np.zeros_like(q), assembly.sizes, assembly.row_sizes
    for _ in range(MOST_ITERATIONS):
        C, _, _ = assembly.system.constraints(t, q, rest)
        size = 1.0 + np.abs(q / sizes).max(initial=0.0)
        left = np.abs(C / row_sizes).max(initial=0.0)
        if left <= TOLERANCE * size:
            return q
        if not np.isfinite(left):
            return None
        step = _least_step(assembly, t, q, C)
        largest = np.abs(step / sizes[r]).max()
        q[r] -= step * min(1.0, LARGEST_TURN * size / largest) if largest else step
    return q if left <= 1e3 * TOLERANCE * size else None


def _freedom_of_constraints(assembly: MechanismSystem, t: float, q: Array) -> float:
    """Ratio of singular values of C_q: 0 where the mechanism has lost a direction that its constraints need.

    Of the mechanism with rigid links where it follows trajectories: that modes could give way does not count. A loop
    that only closes may well need them.
    """
    _, _, C_q = assembly.system.constraints(t, q, np.zeros_like(q))
    if not len(C_q):
        return 1.0
    J = C_q * assembly.sizes / assembly.row_sizes[:, None]
    if any(assembly.is_trajectory) and len(J) <= len(assembly.frame_coordinates):
        J = J[:, assembly.frame_coordinates]
    values = np.linalg.svd(J, compute_uv=False)
    return float(values[-1] / values[0])


def _singular_start(assembly: MechanismSystem, q: Array) -> str:
    """Why constraints that differ cannot be told apart at q: everywhere on the way (redundant), or just there."""
    path, names = assembly.model.scene.path, _names(assembly.constraints)
    loop = MechanismSystem(assembly.model, assembly.model.joints)
    J = frame_gradients(loop, 0.0, q)
    values, right = np.linalg.svd(J)[1:]
    missing = int(np.count_nonzero(values < SINGULAR * values[0]))
    free = right[len(J) - missing :].sum(axis=0) * loop.sizes[loop.frame_coordinates]
    moved = q.copy()
    moved[loop.frame_coordinates] += 0.05 * free
    beside = _newton(loop, 0.0, moved)
    if missing and beside is not None and _freedom_of_constraints(loop, 0.0, beside) < SINGULAR:
        return (
            f"{path}: joint: expected joints that each take something away from the motion, found {missing} too many"
            f" among {_names(loop.constraints)}: in this geometry (parallel cranks?) rigid links move all the same, and"
            " nothing says how the force is shared; leave a joint out, or give the links modes"
        )
    return (
        f"{path}: initial: expected a configuration in which the links can follow {names} in every direction, found a"
        " singular one (an arm stretched or folded, a mechanism at a dead centre?): bend it, or move the start of the"
        " trajectory"
    )


def _check_redundancy(assembly: MechanismSystem, q: Array) -> None:
    """Rows that depend on each other in a configuration chosen at random depend on each other in all."""
    if not assembly.constraints:
        return
    shift = np.random.default_rng(0).uniform(-0.3, 0.3, len(q)) * assembly.sizes
    for position in assembly.first:  # deformations stay small
        shift[position + 3 :] *= 1e-3
    _, _, C_q = assembly.system.constraints(0.0, q + shift, np.zeros_like(q))
    C_q *= assembly.sizes
    left, values, _ = np.linalg.svd(C_q / np.linalg.norm(C_q, axis=1, keepdims=True))
    rank = int(np.count_nonzero(values > REDUNDANT * values[0]))
    if rank == len(assembly.constraints):
        return
    involved = np.abs(left[:, rank:]).max(axis=1) > 1e-6
    rows = [c for c, is_involved in zip(assembly.constraints, involved, strict=True) if is_involved]
    raise InputError(
        f"{assembly.model.scene.path}: expected independent constraints, found {len(assembly.constraints) - rank} too"
        f" many among {'; '.join(c.row.label for c in rows)}: they repeat or contradict each other"
    )


def _unreachable(assembly: MechanismSystem, t: float, q: Array) -> str:
    """Which trajectory (or joints) the links cannot meet at time t."""
    trajectories = [c for c in assembly.constraints if c.is_trajectory]
    how = (
        "cannot reach"
        if _newton(assembly, t, q) is None
        else "reach only in a singular configuration (stretched, folded, at a dead centre), from which no force on it"
        " says which way they go on: keep clear of it, or drive a joint instead"
    )
    if trajectories and _newton(_only_joints(assembly), t, q) is not None:
        return (
            f"{assembly.model.scene.path}: {_names(trajectories)}: expected a target within reach, found one at"
            f" t = {t:.6g} s that the undeformed links {how}"
        )
    return (
        f"{assembly.model.scene.path}: expected joints that can be closed, found that"
        f" {_names([c for c in assembly.constraints if not c.is_trajectory])}"
        f" cannot be met at t = {t:g} s from the initial angles"
    )


def _only_joints(assembly: MechanismSystem) -> MechanismSystem:
    return MechanismSystem(assembly.model, assembly.model.joints)


def _names(constraints: Sequence[Constraint]) -> str:
    trajectories = [c for c in constraints if c.is_trajectory] or constraints
    kind = "trajectory" if trajectories and trajectories[0].is_trajectory else "joint"
    return ", ".join(dict.fromkeys(f'{kind} "{c.owner}"' for c in trajectories))


def _chain_guess(assembly: MechanismSystem) -> State:
    """Frames placed from joint to joint with the guessed angles and rates; loops are left to Newton."""
    model = assembly.model
    q, v = np.zeros(assembly.system.coordinates), np.zeros(assembly.system.coordinates)
    for name, i in assembly.index.items():
        q[assembly.first[i] + 2] = model.scene.initial.angles.get(name, 0.0)
        v[assembly.first[i] + 2] = model.scene.initial.rates.get(name, 0.0)

    placed = {GROUND}
    while True:
        joint = next((j for j in _firm_first(model.scene.joint) if _one_side_placed(j, placed)), None)
        if joint is None:
            return State(q, v)
        sides = [(side, side.partition(".")[0]) for side in joint.between]
        (known, _), (side, body) = sides if sides[0][1] in placed else sides[::-1]
        at, rate = _motion(assembly, q, v, known, joint.at)
        arm, turn = _arm(assembly, q, side)
        i = assembly.first[assembly.index[body]]
        q[i : i + 2] = at - arm
        v[i : i + 2] = rate - v[i + 2] * turn
        placed.add(body)


def _firm_first(joints: Sequence[Joint]) -> list[Joint]:
    """Prismatic joints last: they leave the place along their axis open."""
    return sorted(joints, key=lambda joint: joint.type == "prismatic")


def _one_side_placed(joint: Joint, placed: set[str]) -> bool:
    return sum(side.partition(".")[0] in placed for side in joint.between) == 1


def _arm(assembly: MechanismSystem, q: Array, side: str) -> tuple[Array, Array]:
    """A x of a point of an undeformed body, and A_θ x."""
    end = Marker(*split_point(side))
    assert end.body is not None
    body = assembly.index[end.body]
    x, y = assembly.model.bodies[body].points[end.point].position
    theta = q[assembly.first[body] + 2]
    arm = np.array([np.cos(theta) * x - np.sin(theta) * y, np.sin(theta) * x + np.cos(theta) * y])
    return arm, np.array([-arm[1], arm[0]])


def _motion(assembly: MechanismSystem, q: Array, v: Array, side: str, at: tuple[float, float]) -> tuple[Array, Array]:
    """Position and velocity of a placed point, or of a place on the ground."""
    if side == GROUND:
        return np.array(at), np.zeros(2)
    arm, turn = _arm(assembly, q, side)
    i = assembly.first[assembly.index[split_point(side)[0]]]
    return q[i : i + 2] + arm, v[i : i + 2] + v[i + 2] * turn
