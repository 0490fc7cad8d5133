"""FRFs of a robot's linear equations, with exact derivatives by parameters.

With Z = K + iωD − ω²M and rows J of the points' displacements, the receptance is H = J_r Z⁻¹ J_fᵀ, and

    dH = dJ_r X + Yᵀ dJ_fᵀ − Yᵀ dZ X,      X = Z⁻¹ J_fᵀ,  Y = Z⁻ᵀ J_rᵀ.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..common.arrays import Array, ComplexArray
from ..map.pose_map import check_point
from ..mbs.linear.joint_conditions import COMPLIANT, free_coordinates, vibration
from ..mbs.linear.poses import PoseEvaluator
from ..mbs.posture.start import undeformed_posture
from ..mbs.scene.mechanism import Initial
from ..mbs.scene.space import SPACES
from ..run.prepare import with_scene
from ..run.solution import Solution
from .frf_measured import MeasuredPose

Equations = Callable[[Array], Sequence[Array]]
"""`stacked` equations of all poses by the values (n,) of parameters, in the same coordinates for all of these."""


def stacked(M: Array, K: Array, D: Array, J: Array) -> Array:
    """One array (3 f + r, f), which adds and scales, of M, K, D (f, f) and rows J (r, f) of `MeasuredPose.ends`."""
    return np.vstack([M, K, D, J])


def unstacked(equations: Array) -> list[Array]:
    """M, K, D and J."""
    f = equations.shape[1]
    return np.split(equations, [f, 2 * f, 3 * f])


def receptance(
    equations: Array, pose: MeasuredPose, changes: Sequence[Array] = ()
) -> tuple[ComplexArray, ComplexArray]:
    """H (F, p), m/N, where a pose was measured, and its derivatives (n, F, p) along `changes` of the equations."""
    (M, K, D, J), f, r = unstacked(equations), pose.ends.force, pose.ends.response
    X, w = vibration(M, K, D, J, pose.omega), pose.omega[:, None, None]
    H: ComplexArray = np.asarray((J @ X)[:, r, f], dtype=complex)
    slopes = np.empty((len(changes), *H.shape), dtype=complex)
    if len(changes):
        Y = vibration(M.T, K.T, D.T, J, pose.omega).swapaxes(1, 2)
        for k, (dM, dK, dD, dJ) in enumerate(map(unstacked, changes)):
            dX = dK @ X + 1j * w * (dD @ X) - w**2 * (dM @ X)
            slopes[k] = (dJ @ X + Y @ dJ.T - Y @ dX)[:, r, f]
    return H, slopes


class PoseModel:
    """Makes the equations of a robot in the pose of a test, with the same coordinates for all parameters.

    `initial`: the pose; None: the start of the scene. `motors`: "locked", they stand still, or "free".
    """

    def __init__(self, pose: MeasuredPose, initial: Initial | None, motors: str) -> None:
        self.pose, self._initial, self._motors = pose, initial, motors
        self._free: Array | None = None
        self._rest: Array | None = None  # the first equilibrium

    def at(self, robot: Solution) -> Array:
        """The `stacked` equations about the equilibrium. Raises `InputError` for points, `SolveError` without one."""
        if self._initial is not None:
            change = {"initial": self._initial, "trajectory": ()}
            robot = with_scene(robot, robot.scene.model_copy(update=change))
        q = undeformed_posture(robot.model).q
        first, *others = dict.fromkeys(row.point for row in self.pose.ends.directions)
        for point in (first, *others):
            check_point(robot, point, f'test "{self.pose.test.name}"')
        linear, rest = PoseEvaluator(robot.model, q, first, others=others).linear_equations(q, self._rest)
        if self._free is None:
            self._rest = rest
            self._free = free_coordinates(linear, COMPLIANT).N if self._motors == "locked" else np.eye(len(linear.M))
        N, d = self._free, len(SPACES[robot.model.scene.space].translations)
        J = np.array([np.array(row.axis[:d]) @ linear.points[row.point][:d] for row in self.pose.ends.directions])
        return stacked(N.T @ linear.M @ N, N.T @ linear.K @ N, N.T @ linear.D @ N, J @ N)
