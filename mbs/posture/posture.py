"""Postures of a robot: how it can move there, what to say of singular ones and of jumps. SI units."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from ...common.arrays import Array, Booleans, Indices
from ...common.errors import InputError, quoted
from ...common.structs import struct
from .. import _core
from .._core import TimeFunction
from ..model.model import Model

SINGULAR = 4e-6  # ratio of singular values below which a posture counts as singular: round-off leaves 1e-5 of forces
NEARLY_SINGULAR = 1e-3  # ratio of singular values that is worth a warning
BRANCHING = 0.05  # ratio below which bent links may take redundant loops from one branch to another
MOVING = 0.05  # share of a joint in the motion that a singular posture leaves, of the largest
MOVES = 1e-6  # share of a joint in a motion that is left free
BESIDE = 0.05  # rad (and sizes of the robot) before a singular posture, where equations of loops are distinguished


@struct
class Mobility:
    """Mobility of the rigid mechanism in a posture."""

    freedom: int  # number of degrees of freedom that joints and loops leave
    followed: int  # how many of these the trajectories prescribe
    # smallest by largest singular value of the path's equations in these freedoms, lengths by robot size
    ratio: float
    left: tuple[str, ...]  # joints that still move with all trajectories prescribed
    loop_rank: int  # rank of the loops' constraint equations


def mobilities(model: Model, q: Array, times: Array, loop_rank: int = -1) -> list[_core.Mobility]:
    """The mobility with rigid links and gears at q (T, n_q), rad and m, and `times` (T,), s.

    `loop_rank` is the rank of the loops' equations with straight links; where negative, that at q. Bent links raise
    it, so that redundant equations seem to lock joints.
    """
    constraints, is_path = model.constraints, (~model.loop_rows).tolist()
    return constraints.core.mobilities(constraints.scene, times.tolist(), q, is_path, model.size, loop_rank)


def singular_ratios(model: Model, q: Array, times: Array, rank: int) -> Array:
    """Ratios (T,), smallest to largest of `rank` singular values of equations at q (T, n_q), SI, `times` (T,), s."""
    constraints, is_path = model.constraints, [False] * len(model.rows)
    motions = constraints.core.mobilities(constraints.scene, times.tolist(), q, is_path, model.size, rank)
    return np.array([at.loop_ratio for at in motions])


def mobility(model: Model, q: Array) -> Mobility:
    """The mobility with rigid links and gears at q (n_q,), rad and m."""
    at = mobilities(model, q[None], np.zeros(1))[0]
    freedom, left = at.free.shape[1] - len(model.tree.gears), _joints(model, _largest(at.left) > MOVES)
    return Mobility(freedom, at.followed, at.ratio, left, at.loop_rank)


def _largest(motions: Array) -> Array:
    """Of motions (joint coordinates, m), the largest by joint coordinate."""
    return np.abs(motions).max(axis=1, initial=0.0)


def _joints(model: Model, are: Booleans) -> tuple[str, ...]:
    """Names of joints by their coordinates (joint coordinates,)."""
    names = np.array([node.joint.name for node in model.tree.nodes for _ in range(node.joint.freedoms)])
    return tuple(dict.fromkeys(names[are].tolist()))


def _owners(model: Model, *, are_paths: bool = False) -> str:
    """Names of joints that close loops, or of trajectories."""
    return quoted(dict.fromkeys(row.owner for row in model.rows if row.is_trajectory == are_paths))


def paths_by_bending(model: Model, q: Array) -> tuple[int, tuple[str, ...]]:
    """Number of path equations that only bending links can meet, and the joints that loops would lock with rigid links.

    At q (n_q,), rad and m; 0 of robots without flexible links.
    """
    is_loop, now = model.loop_rows, np.zeros(1)
    if not is_loop.any() or model.tree.is_rigid:
        return 0, ()
    (C_v,) = model.constraints.natural_gradients(q[None], now)
    moving = _largest(mobilities(model, q[None], now)[0].free) > MOVES
    rows = C_v[~is_loop][:, model.tree.joint_columns]
    is_locked = (_largest(rows[:, moving]) <= MOVES) & (_largest(rows) > MOVES)
    return int(np.count_nonzero(is_locked)), _joints(model, ~moving)


def rank_of_redundant_loops(model: Model, q: Array, rows: Indices) -> int | None:
    """The rank of loop equations with links straight at q (n_q,), rad and m, if some of those in `rows` are redundant.

    Else None. Each path equation that links follow only as they bend (`paths_by_bending`) lowers it by one.
    """
    count = int(np.count_nonzero(model.loop_rows[rows]))
    if not count:
        return None
    rank = mobility(model, q).loop_rank
    return rank - paths_by_bending(model, q)[0] if rank < count else None


def shape_in_redundant_loops(model: Model, q: Array, rows: Indices) -> str:
    """Why links, straight at q (n_q,), SI, cannot have a shape: equations `rows` of loops are redundant; else ""."""
    if rank_of_redundant_loops(model, q, rows) is None:
        return ""
    return (
        f"constraints of the loop that {_owners(model)} closes are redundant with straight links, and do not hold with"
        ' bent ones of any shape. Use joints with more degrees of freedom, or kind = "pcid"'
    )


def worst_posture(model: Model, times: Array, q: Array, loop_rank: int = -1) -> tuple[float, int]:
    """Least `Mobility.ratio` of singular values at `times` (T,), s, and q (T, n_q), SI, and number of this time.

    `loop_rank`: see `mobilities`.
    """
    ratios = [at.ratio for at in mobilities(model, q, times, loop_rank)]
    return min(ratios), int(np.argmin(ratios))


def describe_posture(model: Model, ratio: float, t: float, q: Array, *, is_end: bool, loop_rank: int = -1) -> str:
    """A message on the worst posture q (n_q,), SI, of a path at t (s), `ratio` of singular values; "" if regular.

    `is_end`: the run ends there; `loop_rank`: see `mobilities`.
    """
    if not ratio < NEARLY_SINGULAR:
        return ""
    least = np.abs(mobilities(model, q[None], np.array([t]), loop_rank)[0].hardest)
    moving = quoted(_joints(model, least > MOVING * least.max()))
    how = "a singular posture" if is_end else f"nearly a singular posture (ratio {ratio:.1e})"
    return f"at t = {t:.6g} s {how}: motions of {moving} against each other hardly move what follows the path"


def describe_branches(model: Model, times: Array, q: Array, loop_rank: int) -> str:
    """A message if loops pass a singular posture at `times` (T,), s, and q (T, n_q), rad and m; else "".

    `loop_rank`: see `mobilities`.
    """
    ratios = np.array([at.loop_ratio for at in mobilities(model, q, times, loop_rank)])
    worst = int(ratios.argmin())
    if not ratios[worst] < BRANCHING or worst in (0, len(times) - 1):
        return ""
    return (
        f"at t = {times[worst]:.6g} s loops that {_owners(model)} close pass a singular posture (ratio"
        f" {ratios[worst]:.1e}), in which branches of their motion meet: links that bend may go on along another one"
    )


def describe_loops(model: Model, t: float, q: Array, v: Array) -> str:
    """A message if loop or path equations become nearly dependent at q (n_q,), v (n_v,), t, rad, m and s; else ""."""
    loops = model.without_paths()
    before = loops.constraints.posture(model.tree.integrate(q, -BESIDE / max(float(np.abs(v).max()), 1e-300) * v), 0.0)
    if not loops.rows or before is None:
        return ""
    freedom = mobility(model, before)
    for of, rank, what, why in (
        (
            loops,
            freedom.loop_rank,
            f"loops that {_owners(model)} close",
            ", or cranks and coupler in a line. No finite force determines the further motion. Avoid this posture",
        ),
        (
            model,
            freedom.loop_rank + freedom.followed,
            f"trajectory {_owners(model, are_paths=True)}",
            ", where forces on the driven point do not determine the direction of motion. Keep clear of it,",
        ),
    ):
        ratio = singular_ratios(of, q[None], np.array([t]), rank)[0]
        if ratio < 5 * NEARLY_SINGULAR:  # of a run that failed there
            return (
                f"the configuration is singular or nearly so (ratio of singular values {ratio:.1g}; {what}): a"
                f" mechanism at a dead center{why} or drive a joint instead"
            )
    return ""


def check_path(model: Model, q: Array, end: float) -> Iterator[str]:
    """Yield warnings on freedoms that neither paths nor motors determine at q (n_q,), rad and m.

    Raises `InputError` for more components than the mechanism can follow, a wrong number of motors, a singular posture,
    and a path that jumps before `end` (s).
    """
    path, free = model.scene.path, mobility(model, q)
    bent, locked = paths_by_bending(model, q)
    if end > 0:
        check_smooth(model, end)
    rows = int(np.count_nonzero(~model.loop_rows))
    names = quoted(trajectory.name for trajectory in model.scene.trajectory)
    if rows > free.freedom and bent:
        yield (
            f"loops lock joints {quoted(locked)} with rigid links: the mechanism follows trajectory {names} only as its"
            " links bend"
        )
        free = replace(free, freedom=free.freedom + bent, followed=free.followed + bent)
    if rows > free.freedom:
        raise InputError(
            f"{path}: trajectory: expected at most {free.freedom} components, as many as the mechanism has degrees of"
            " freedom with rigid links",
            f"{rows} in {names}: only vibrations could follow the others",
        )
    if free.followed < rows:
        raise InputError(
            f"{path}: initial: expected a posture in which the links can follow trajectory {names} in every direction",
            "a singular one (two axes in line, an arm stretched or folded?). Bend it, or move the start of the path",
        )
    if free.ratio < NEARLY_SINGULAR:
        yield f"near a singular posture at the start: {names} can hardly be followed (ratio {free.ratio:.1e})"
    if rows and free.followed < free.freedom:
        yield (
            f"{free.freedom - free.followed} degrees of freedom are not prescribed; forces and inertia move"
            f' {", ".join(free.left)}: prescribe a joint by a trajectory, or set redundancy = "least-motion" or'
            ' "least-torque"'
        )
    if rows:
        yield from _check_motors(model, free)


def _check_motors(model: Model, seen: Mobility) -> Iterator[str]:
    motors = {name: len(columns) for name, columns in model.motors.items()}
    count, named = sum(motors.values()), any(getattr(joint, "motor", None) for joint in model.scene.joint)
    if count > seen.freedom or (count < seen.freedom and named and model.scene.is_planar):
        raise InputError(
            f"{model.scene.path}: joint: expected as many motors as the mechanism has degrees of freedom"
            f" ({seen.freedom})",
            f"{count} ({quoted(motors)})",
        )
    if count < seen.freedom and (named or model.scene.topology.is_open_chain):
        joints = [node.joint for node in model.tree.nodes if node.joint.freedoms and node.joint.type != "free"]
        moving = [joint.name for joint in joints if joint.name not in motors]
        if moving:
            names = ", ".join(moving)
            yield f"joints without motor: {names}: motor torques for the path are undetermined and not computed"


SAMPLES = 2001
LOOKED_INTO = 5  # intervals between samples, the roughest ones
HALVINGS = 25
JUMP = 1e-4  # in terms of the largest value or velocity: less is rounded numbers in an expression
SMOOTH = 0.1  # of that: what misses less in one of those intervals has no jump
RESTING = 1e-6  # of the largest value, within the run: a path that moves less stands still, and what jumps is round-off


def check_smooth(model: Model, end: float, shape: Iterable[tuple[str, TimeFunction]] = ()) -> None:
    """Raise `InputError` for trajectories, or labels with functions of `shape`, that jump in value or velocity.

    From t = 0 to `end` (s); accelerations may jump.
    """
    paths = ((f'trajectory "{each.name}": {of[0]}', of[1]) for each in model.scene.trajectory for of in each.targets)
    for label, target in (*paths, *shape):
        for order, quantity in enumerate(("value", "velocity")):
            jump = _jump(target, end, order)
            if jump is not None:
                t, before, after = jump
                raise InputError(
                    f"{model.scene.path}: {label}: expected a continuous {quantity}",
                    f"a jump from {before:.6g} to {after:.6g} at t = {t:.9g} s: no finite force can make the robot"
                    " follow; round it off (waypoints make a smooth curve)",
                )


def _jump(function: TimeFunction, end: float, order: int) -> tuple[float, float, float] | None:
    """Time, value before and after of the first jump that is found in a derivative of that order; None without one."""
    times = np.linspace(0.0, end, SAMPLES)
    derivatives = function.sample(times)
    samples, still = derivatives[order], RESTING * float(np.abs(derivatives[0]).max())
    size = max(float(np.ptp(samples)), still) if order == 0 else max(float(np.abs(samples).max()), still / end)
    if not (np.isfinite(samples).all() and size > 0):
        return None
    missed = misfits(function, times, order)
    rough = np.argsort(-missed)[:LOOKED_INTO]
    rough = rough[missed[rough] > SMOOTH * JUMP * size]
    if rough.size == 0:
        return None
    a, b = times[rough], times[rough + 1]
    for _ in range(HALVINGS):
        middle = 0.5 * (a + b)
        halves = misfits(function, np.stack([a, middle, b]), order)
        a, b = np.where(halves[0] > halves[1], (a, middle), (middle, b))
    jumps = misfits(function, np.stack([a, b]), order)[0] > JUMP * size
    if not jumps.any():
        return None
    first = np.flatnonzero(jumps)[np.argmin(b[jumps])]
    before, after = function.sample(np.array([a[first], b[first]]))[order]
    return float(b[first]), float(before), float(after)


def misfits(function: TimeFunction, times: Array, order: int) -> Array:
    """How far changes of derivative `order` between `times` (T, …), s, differ from integrals of the next one.

    (T − 1, …) in the unit of that derivative, by the trapezoidal rule; 0 where not finite.
    """
    value, slope = function.sample(times.ravel())[order : order + 2].reshape(2, *times.shape)
    missed = np.diff(value, axis=0) - 0.5 * np.diff(times, axis=0) * (slope[1:] + slope[:-1])
    return np.nan_to_num(np.abs(missed), nan=0.0, posinf=0.0)
