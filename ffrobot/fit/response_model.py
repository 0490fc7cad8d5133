"""FRFs of a robot's linear equations, with exact derivatives by parameters.

With Z = K + iωD − ω²M and rows J of the points' displacements, the receptance is H = J_r Z⁻¹ J_fᵀ, and

    dH = dJ_r X + Yᵀ dJ_fᵀ − Yᵀ dZ X,      X = Z⁻¹ J_fᵀ,  Y = Z⁻ᵀ J_rᵀ.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..common.arrays import Array, ComplexArray
from ..common.structs import struct
from ..map.pose_map import check_point
from ..mbs.linear.joint_conditions import COMPLIANT, free_coordinates
from ..mbs.linear.poses import PoseEvaluator
from ..mbs.posture.start import undeformed_posture
from ..mbs.scene.mechanism import Initial
from ..mbs.scene.space import SPACES
from ..run.prepare import with_scene
from ..run.solution import Solution
from .response_tests import Direction, MeasuredPose


@struct
class PoseEquations:
    """M, K, D (f, f) of free coordinates, and rows J (r, f) of displacements; they add and scale as vectors do."""

    M: Array
    K: Array
    D: Array
    J: Array

    def plus(self, other: PoseEquations, factor: float) -> PoseEquations:
        """The sum with `factor` times `other`."""
        pairs = zip(self.parts, other.parts, strict=True)
        return PoseEquations(*(mine + factor * its for mine, its in pairs))

    def slope(self, behind: PoseEquations, step: float) -> PoseEquations:
        """The quotient of the difference from `behind` and a `step`."""
        pairs = zip(self.parts, behind.parts, strict=True)
        return PoseEquations(*((mine - its) / step for mine, its in pairs))

    @property
    def parts(self) -> tuple[Array, Array, Array, Array]:
        """M, K, D and J."""
        return self.M, self.K, self.D, self.J

    def distance(self, other: PoseEquations) -> float:
        """The largest difference of the parts, each relative to its size."""
        pairs = zip(self.parts, other.parts, strict=True)
        return max(float(np.linalg.norm(a - b) / (np.linalg.norm(a) or 1.0)) for a, b in pairs)


Equations = Callable[[Array], Sequence[PoseEquations]]
"""The equations of all poses by the values (n,) of parameters, in the same coordinates for all of these."""


class Ends(NamedTuple):
    """Numbers (p,) of the rows of force and response of each FRF, and what they are."""

    force: list[int]
    response: list[int]
    rows: list[Direction]


def ends_of(pose: MeasuredPose) -> Ends:
    """Return the rows that the FRFs of a pose need, each once."""
    places: dict[tuple[str, bytes], int] = {}
    rows: list[Direction] = []

    def number(one: Direction) -> int:
        key = (one.point, one.axis.tobytes())
        if key not in places:
            places[key] = len(rows)
            rows.append(one)
        return places[key]

    force, response = ([number(getattr(one, end)) for one in pose.responses] for end in ("force", "response"))
    return Ends(force, response, rows)


def receptance(
    of: PoseEquations, ends: Ends, omega: Array, changes: Sequence[PoseEquations] = ()
) -> tuple[ComplexArray, ComplexArray]:
    """H (F, p) at `omega` (F,), rad/s, and its derivatives (n, F, p) along the `changes` of the equations."""
    w = omega[:, None, None]
    forces, responses = sorted(set(ends.force)), sorted(set(ends.response))
    f, r = [forces.index(k) for k in ends.force], [responses.index(k) for k in ends.response]
    Z = of.K + 1j * w * of.D - w**2 * of.M
    J_f, J_r = of.J[forces], of.J[responses]
    X = np.linalg.solve(Z, np.broadcast_to(J_f.T, (len(omega), *J_f.T.shape)))
    H = J_r @ X
    found = np.empty((len(changes), len(omega), len(f)), dtype=complex)
    if changes:
        Y = np.linalg.solve(Z.swapaxes(1, 2), np.broadcast_to(J_r.T, (len(omega), *J_r.T.shape))).swapaxes(1, 2)
        for k, change in enumerate(changes):
            dX = change.K @ X + 1j * w * (change.D @ X) - w**2 * (change.M @ X)
            dH = change.J[responses] @ X + Y @ change.J[forces].T - Y @ dX
            found[k] = dH[:, r, f]
    return np.asarray(H[:, r, f]), found


class PoseModel:
    """Makes `PoseEquations` of a robot in the pose of a test, with the same coordinates for all parameters.

    `initial`: the pose; None: the start of the scene. `motors`: "locked", they stand still, or "free".
    """

    def __init__(self, pose: MeasuredPose, initial: Initial | None, motors: str) -> None:
        self.pose, self._initial, self._motors = pose, initial, motors
        self.ends = ends_of(pose)
        self._free: Array | None = None
        self._rest: Array | None = None  # the first equilibrium

    def at(self, robot: Solution) -> PoseEquations:
        """The equations of a robot about its equilibrium. Raises `InputError` for points, `SolveError` without one."""
        if self._initial is not None:
            change = {"initial": self._initial, "trajectory": ()}
            robot = with_scene(robot, robot.scene.model_copy(update=change))
        q = undeformed_posture(robot.model).q
        first, *others = dict.fromkeys(row.point for row in self.ends.rows)
        for point in (first, *others):
            check_point(robot, point, f'test "{self.pose.test.name}"')
        linear, rest = PoseEvaluator(robot.model, q, first, others=others).linear_equations(q, self._rest)
        if self._free is None:
            self._rest = rest
            self._free = free_coordinates(linear, COMPLIANT).N if self._motors == "locked" else np.eye(len(linear.M))
        N, d = self._free, len(SPACES[robot.model.scene.space].translations)
        J = np.array([row.axis[:d] @ linear.points[row.point][:d] for row in self.ends.rows])
        return PoseEquations(N.T @ linear.M @ N, N.T @ linear.K @ N, N.T @ linear.D @ N, J @ N)
