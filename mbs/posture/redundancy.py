"""Freedom that paths leave to a robot, as six components do to seven joints: settled with rigid links.

The motion of the joints along the path is found with undeformed links, by the criterion that the scene names. The
joints that determine the free motion best then follow it exactly, with flexible links, too.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np

from ...common.arrays import Array, Booleans, null_space
from ...common.errors import InputError, SolveError
from ...common.libraries import scipy
from .. import _core
from ..fields.waypoints import spline
from ..model.model import Model
from ..model.nodes import ConstraintRow, Node, rows_of_joint
from ..model.system import driven_mechanism
from .posture import Mobility, mobility
from .prescribed import prescribed_motion
from .start import undeformed_posture

OWNER = "redundancy"  # of the rows that this adds
NODES = 401  # of the splines that joints follow
TOLERANCE = 1e-9  # of the motion with rigid links
INTERVALS = 6  # of the splines by which joints move
STRIDE = 10  # of these nodes at which moments count
OUT_OF_REACH = 1e3
MOST_MOVES = 40  # to the least torque: most motions take 4 to 10
TRIALS = 20  # in one of them; one that they do not suffice for is not the last
LONGEST = 0.5  # of joints in one of them, rad or sizes of the robot
SETTLED = 1e-4  # share of the integral that the last one takes off
RANK = 1e-6  # of the largest singular value
TELLS = 0.02  # share of a motion left free that joints must have at all times to tell it


def resolved(model: Model, end: float) -> Model:
    """The robot with a joint's motion from 0 to `end` (s) as equation for each redundant freedom.

    By the scene's `redundancy`. Raises `InputError` for unsupported joints or loops and if nothing is redundant,
    `SolveError` where no motion is found.
    """
    criterion = model.scene.redundancy
    if criterion is None or all(not row.is_trajectory for row in model.rows):
        return model
    start = undeformed_posture(model)
    free = mobility(model, start.q)
    _check(model, criterion, free)
    times = np.linspace(0.0, end, NODES) if end > 0 else np.zeros(1)
    q = _least_motion(model, start.q, times)
    if criterion == "least-torque" and end > 0:
        q = _least_torque(model, times, q)
    nodes = _most_observable(model, times, q, free.freedom - free.followed)
    rows = _rows(nodes, times, q) if end > 0 else _rows(nodes, np.array([0.0, 1.0]), np.repeat(q, 2, axis=0), degree=1)
    return replace(model, rows=(*model.rows, *rows))


def resolving_joints(model: Model) -> list[str]:
    """Names of the joints that follow a motion which `resolved` found."""
    by_column = {node.v.start: node.joint.name for node in model.tree.nodes}
    return [by_column[row.coordinate] for row in model.rows if row.owner == OWNER]


def _check(model: Model, criterion: str, seen: Mobility) -> None:
    path = model.scene.path
    if seen.followed == seen.freedom:
        raise InputError(
            f"{path}: redundancy: expected a mechanism with more degrees of freedom than its trajectories prescribe",
            f"{seen.freedom} degrees of freedom and as many components: leave the key out",
        )
    if criterion == "least-torque" and model.loop_rows.any():
        raise InputError(
            f'{path}: redundancy: expected "least-motion" of a mechanism with kinematic loops',
            '"least-torque", which supports open chains only',
        )
    for node in model.tree.nodes:
        if node.joint.q_count != node.joint.freedoms:
            raise InputError(
                f"{path}: redundancy: expected joints with angles or displacements for coordinates",
                f'"{node.joint.name}", a {node.joint.type} joint: prescribe joints by trajectories',
            )


def _rows(nodes: Iterable[Node], times: Array, q: Array, degree: int = 5) -> Iterator[ConstraintRow]:
    """Rows by which the joints of `nodes` follow q (T, n_q) at `times` (T,), a spline between."""
    for node in nodes:
        if node.joint.freedoms:
            sign = node.sign if len(node.joint.units) == 1 else 1.0
            targets = spline(times, sign * q[:, node.q], degree)
            yield from rows_of_joint(OWNER, node, np.r_[node.v], targets, sign)


def _left_free(model: Model, times: Array, q: Array) -> list[Array]:
    """What the rows leave free at `times` (T,) and q (T, n_q): T orthonormal (joints, k), in natural sizes."""
    return [null_space(C_v, RANK) for C_v in _of_joints(model, times, q)]


def _of_joints(model: Model, times: Array, q: Array) -> Array:
    """C_v (T, rows, joints) at `times` (T,) and q (T, n_q), in natural sizes."""
    return model.constraints.natural_gradients(q, times)[:, :, model.tree.joint_columns]


def _least_motion(model: Model, q: Array, times: Array) -> Array:
    """Q (T, n_q) from q (n_q,) on, with the least v at every time (D. Whitney, IEEE Trans. MMS-10, 1969)."""
    if len(times) == 1:
        return q[None]
    of_joints, rest = model.tree.joint_columns, np.zeros((1, model.tree.n_v))

    def ends_at(t: float) -> SolveError:
        return SolveError(
            f"{model.scene.path}: redundancy: the motion of least size ends at t = {t:.6g} s: the joints cannot follow"
            " the path there; start in another posture, or prescribe a joint by a trajectory"
        )

    def rates(t: float, way: Array) -> Array:
        at, now, q_dot = (q + way)[None], np.array([t]), np.zeros_like(q)
        (C_v,) = _of_joints(model, now, at)
        left = model.constraints.rates(at, rest, now)[0] / model.row_sizes
        least = -np.linalg.pinv(C_v, rcond=RANK) @ left
        if np.abs(C_v @ least + left).max() > RANK * np.abs(left).max():
            raise ends_at(t)
        q_dot[of_joints] = model.joint_sizes[of_joints] * least
        return q_dot

    run = scipy.integrate.solve_ivp(
        rates, (0.0, float(times[-1])), 0 * q, "DOP853", times, rtol=TOLERANCE, atol=TOLERANCE
    )
    if run.success:
        return q + run.y.T
    raise ends_at(run.t[-1])


def _least_torque(model: Model, times: Array, q: Array) -> Array:
    """Q (T, n_q) with the least ∫ Σ τ² dt from the state at t = 0 on, from q (T, n_q).

    The least over a whole motion: what is least at every time alone makes joints run away (J. M. Hollerbach, K. C. Suh,
    IEEE J. Robotics and Automation 3, 1987).
    """
    last = np.inf
    for _ in range(MOST_MOVES):
        q, squares, is_least = _less_torque(model, times, q)
        if is_least and squares > (1.0 - SETTLED) * last:
            return q
        last = squares
    raise SolveError(
        f'{model.scene.path}: redundancy = "least-torque": expected the least within {MOST_MOVES} moves',
        'none: "least-motion" needs none, or prescribe a joint by a trajectory',
    )


def _less_torque(model: Model, times: Array, q: Array) -> tuple[Array, float, bool]:
    """Q (T, n_q) with the least ∫ Σ τ² dt near q, this integral, and whether the search for it came to its end.

    Quintic B-splines, which leave the state at t = 0, lead away from q along what the path leaves free; the nearest
    posture on the path follows, so that nothing leaves its reach.
    """
    end, count, of_joints = float(times[-1]), INTERVALS + 3, model.tree.joint_columns
    knots = np.concatenate([np.zeros(5), np.linspace(0.0, end, INTERVALS + 1), np.full(5, end)])
    basis = scipy.interpolate.BSpline.design_matrix(times, knots, 5).toarray()[:, 2:]
    scales, seen = model.joint_sizes, slice(None, None, STRIDE)
    weights = np.sqrt(scipy.integrate.simpson(np.eye(len(times[seen])), x=times[seen]))[:, None] * scales
    still = np.zeros((3, len(weights), int(np.count_nonzero(~of_joints))))
    free = _left_free(model, times, q)
    for k in range(1, len(free)):  # the least turned from one time to the next
        U, _, V = np.linalg.svd(free[k].T @ free[k - 1])
        free[k] = free[k] @ U @ V
    ways = scales[of_joints, None] * np.stack(free)  # (T, joints, motions)

    def moved(shares: Array, at: slice) -> tuple[Array, Booleans]:
        best = q[at].copy()
        best[:, of_joints] += np.einsum("tjk,tk->tj", ways[at], basis[at] @ shares.reshape(count, -1))
        return model.constraints.postures(best, times[at])

    def moments(c: Array) -> Array:
        best, is_met = moved(c - 1.0, seen)
        driven = replace(model, rows=tuple(_rows(model.tree.nodes, times[seen], best)))
        mechanism = _core.SpatialPrescribedMotion(driven_mechanism(driven, has_motors=False), best[0])
        motion = prescribed_motion(driven, mechanism, still, times[seen], best)
        return (weights * motion.required).ravel() / size if is_met.all() else np.full(weights.size, OUT_OF_REACH)

    size, start = 1.0, np.ones(count * ways.shape[-1])  # at 1, where small steps are far above round-off of postures
    size = float(np.linalg.norm(moments(start))) or 1.0
    near = (start - LONGEST, start + LONGEST)
    best = scipy.optimize.least_squares(
        moments, start, diff_step=1e-5, bounds=near, ftol=1e-5, xtol=1e-5, max_nfev=TRIALS
    )
    return moved(best.x - 1.0, slice(None))[0], 2.0 * best.cost * size**2, best.success


def _most_observable(model: Model, times: Array, q: Array, count: int) -> tuple[Node, ...]:
    """The `count` joints with one coordinate whose share in the motion left free is never small at q (T, n_q).

    Nor does it change its sign, between outputs either: there the joint turns back, and tells two motions.

    Raises `SolveError` where no such joints tell it all along the path.
    """
    free, number = _left_free(model, times, q), np.cumsum(model.tree.joint_columns) - 1
    single = [node for node in model.tree.nodes if len(node.joint.units) == 1]
    best: tuple[float, tuple[Node, ...]] = (0.0, ())
    for nodes in combinations(single, count):
        columns = number[[node.v.start for node in nodes]]
        share = min(
            float(np.linalg.svd(N[columns], compute_uv=False)[-1]) if N.shape[1] == count else 0.0 for N in free
        )
        goes_back = any(np.linalg.det(a[columns] @ a.T @ b @ b[columns].T) < 0.0 for a, b in pairwise(free))
        best = max(best, (0.0 if goes_back else share, nodes), key=lambda one: one[0])
    if best[0] < TELLS:
        raise SolveError(
            f"{model.scene.path}: redundancy: expected joints that move in every motion which the path leaves free",
            "none that do all along it: prescribe a joint by a trajectory, or change the path",
        )
    return best[1]
