"""Freedom that paths leave to a robot, as six components do to seven joints: settled with rigid links.

The motion of the joints along the path is found with undeformed links, by the criterion that the scene names. Of the
joints those that tell the motion left free best then follow it, as joints that the scene prescribes do: with flexible
links these and the path are followed exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from ...common.arrays import Array, as_floats, null_space
from ...common.errors import InputError, SolveError
from ...common.libraries import scipy
from .. import _core
from ..fields.waypoints import spline
from ..model.model import Model, constraint_rates
from ..model.motors import driven_mechanism
from ..model.nodes import Node, coordinate_row
from .posture import Mobility, joint_scales, mobility, natural_gradients, row_sizes
from .prescribed import joint_places, prescribed_motion
from .start import undeformed_posture

OWNER = "redundancy"  # of the rows that this adds
NODES = 401  # of the splines that joints follow
TOLERANCE = 1e-9  # of the motion with rigid links
INTERVALS = 4  # of the splines among which that of least moments is
STRIDE = 20  # of these nodes at which moments count
OUT_OF_REACH = 1e3
MOST_STEPS = 60  # to the least moments: most motions take 10 to 25
RANK = 1e-6  # of the largest singular value
TELLS = 0.02  # share of a motion left free that joints must have at all times to tell it


def resolved(model: Model, end: float) -> Model:
    """Return the robot with a row for each redundant freedom from 0 to `end` (s), by the scene's `redundancy`.

    Raises `InputError` where the criterion has nothing to resolve, `SolveError` where it leads nowhere.
    """
    criterion = model.scene.redundancy
    if criterion is None or all(not row.is_trajectory for row in model.rows):
        return model
    start = undeformed_posture(model)
    free = mobility(model, start.q)
    _check(model, criterion, free)
    times = as_floats(np.linspace(0.0, end, NODES)) if end > 0 else np.zeros(1)
    q = _least_motion(model, start.q, times)
    nodes = _most_observable(model, q, times, free.freedom - free.followed)
    if not end > 0:
        return _with_prescribed_joints(model, nodes, np.array([0.0, 1.0]), np.repeat(q, 2, axis=0), degree=1)
    return _with_prescribed_joints(
        model, nodes, times, _least_torque(model, nodes, times, q) if criterion == "least-torque" else q
    )


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


def _with_prescribed_joints(model: Model, nodes: Sequence[Node], times: Array, q: Array, degree: int = 5) -> Model:
    """With rows by which the joints of `nodes` follow q (T, n_q) at `times` (T,), a spline between."""
    values = np.stack([node.sign * q[:, node.q.start] for node in nodes], axis=1)
    targets = zip(nodes, spline(times, values, degree), strict=True)
    rows = [coordinate_row(OWNER, node, target, sign=node.sign) for node, target in targets]
    return replace(model, rows=(*model.rows, *rows))


def _least_motion(model: Model, q: Array, times: Array) -> Array:
    """Q (T, n_q) from q (n_q,) on, with the least v at every time (D. Whitney, IEEE Trans. MMS-10, 1969)."""
    if len(times) == 1:
        return q[None]
    scales, places, rest = joint_scales(model), joint_places(model), np.zeros((1, model.tree.n_v))

    def ends_at(t: float) -> SolveError:
        return SolveError(
            f"{model.scene.path}: redundancy: the motion of least size ends at t = {t:.6g} s: the joints cannot follow"
            " the path there; start in another posture, or prescribe a joint by a trajectory"
        )

    def rates(t: float, way: Array) -> Array:
        at, now, q_dot = (q + way)[None], np.array([t]), np.zeros_like(q)
        C_v = natural_gradients(model, at, now, scales)[0][:, model.tree.joint_columns]
        left = constraint_rates(model, at, rest, now)[0] / row_sizes(model)
        least = -np.linalg.pinv(C_v, rcond=RANK) @ left
        if np.abs(C_v @ least + left).max() > RANK * np.abs(left).max():
            raise ends_at(t)
        q_dot[places] = scales[model.tree.joint_columns] * least
        return q_dot

    run = scipy.integrate.solve_ivp(
        rates, (0.0, float(times[-1])), 0 * q, "DOP853", times, rtol=TOLERANCE, atol=TOLERANCE
    )
    if run.success:
        return q + run.y.T
    raise ends_at(run.t[-1])


def _least_torque(model: Model, nodes: Sequence[Node], times: Array, q: Array) -> Array:
    """Q (T, n_q), of which the joints of `nodes` count, with the least ∫ Σ τ² dt from the state at t = 0 on.

    The motions of these joints are those of q and quintic B-splines that leave place and rate at t = 0 as they are. The
    least over a whole motion: what is least at every time alone makes joints run away (J. M. Hollerbach, K. C. Suh,
    IEEE J. Robotics and Automation 3, 1987).
    """
    end, count = float(times[-1]), INTERVALS + 5
    knots = np.concatenate([np.zeros(5), np.linspace(0.0, end, INTERVALS + 1), np.full(5, end)])
    basis = [scipy.interpolate.BSpline.design_matrix(t, knots, 5).toarray()[:, 2:] for t in (times, times[::STRIDE])]
    places, scales = [node.q.start for node in nodes], joint_scales(model)
    weights = np.sqrt(scipy.integrate.simpson(np.eye(len(times[::STRIDE])), x=times[::STRIDE]))[:, None] * scales
    still, start = np.zeros((3, len(weights), int(np.count_nonzero(~model.tree.joint_columns)))), q[::STRIDE]

    def moved(c: Array, which: int) -> Array:
        best = (q if which == 0 else start).copy()
        best[:, places] += basis[which] @ c.reshape(count - 2, len(places))
        return best

    def moments(c: Array) -> Array:
        driven = _with_prescribed_joints(model, nodes, times, moved(c, 0))
        try:
            mechanism = _core.SpatialPrescribedMotion(driven_mechanism(driven, has_motors=False), start[0])
            motion = prescribed_motion(driven, mechanism, still, times[::STRIDE], moved(c, 1))
        except SolveError:  # out of reach: worse than anything within it
            return np.full(weights.size, OUT_OF_REACH)
        return (weights * motion.required).ravel() / size

    size = 1.0
    size = float(np.linalg.norm(moments(np.zeros((count - 2) * len(places))))) or 1.0
    best = scipy.optimize.least_squares(
        moments, np.zeros((count - 2) * len(places)), diff_step=1e-6, ftol=1e-8, xtol=1e-6, max_nfev=MOST_STEPS
    )
    if not best.success:
        raise SolveError(
            f'{model.scene.path}: redundancy = "least-torque": expected the least within {MOST_STEPS} steps',
            'none: "least-motion" needs none, or prescribe a joint by a trajectory',
        )
    return moved(best.x, 0)


def _most_observable(model: Model, q: Array, times: Array, count: int) -> tuple[Node, ...]:
    """The `count` joints with one coordinate whose share in the motion left free is never small at q (T, n_q).

    Raises `SolveError` where no such joints tell it all along the path.
    """
    scales = joint_scales(model)
    joints = np.eye(len(scales))[:, scales > 0]
    free = [joints @ null_space(C_v @ joints, RANK) for C_v in natural_gradients(model, q, times, scales)]
    single = [node for node in model.tree.nodes if len(node.joint.units) == 1]
    best: tuple[float, tuple[Node, ...]] = (0.0, ())
    for nodes in combinations(single, count):
        columns = [node.v.start for node in nodes]
        share = min(
            float(np.linalg.svd(N[columns], compute_uv=False)[-1]) if N.shape[1] == count else 0.0 for N in free
        )
        best = max(best, (share, nodes), key=lambda one: one[0])
    if best[0] < TELLS:
        raise SolveError(
            f"{model.scene.path}: redundancy: expected joints that move in every motion which the path leaves free",
            "none that do all along it: prescribe a joint by a trajectory, or change the path",
        )
    return best[1]
