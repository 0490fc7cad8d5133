"""The model of a robot that analyses share: tree and constraint equations, with natural sizes. SI units."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np

from ...common.arrays import Array, Booleans, Indices
from ...common.errors import quoted
from ...common.structs import struct
from ..scene.mechanism import MechanismScene
from .drives import Drive
from .kinematics import Kinematics
from .nodes import ConstraintRow, Node
from .tree import AlongCut, CutCoordinate, KinematicTree

TOLERANCE = 1e-13  # of constraints, relative to the size of the robot
MET = 1e3 * TOLERANCE  # what counts as met where round-off hinders
NO_SLOPE = 1e-12  # in natural sizes: round-off of equations that hold by themselves
LARGEST_TURN = 0.5  # rad (and sizes of the robot) that a Newton step may move: keeps to the branch of the guess


class Constraints(Kinematics):
    """Constraint equations C(q, t) = 0 of a model, one for each of its `rows`, SI."""

    def __init__(self, model: "Model") -> None:
        super().__init__(model.tree.nodes, rows=model.rows)
        self._rows, self._row_sizes, self._joint_sizes = model.rows, model.row_sizes, model.joint_sizes

    @cached_property
    def _senses(self) -> tuple[list[str], Kinematics]:
        """Cosines that distinguish parallel from opposite axes of "dot" rows, positive if parallel, with row owners.

        Of z of b against z of a and, of joints that do not turn, x against x. An owner's rows are of x and y of a with
        z of b and, of such joints, of x of a with y of b.
        """
        aligned, turning = dict[str, list[ConstraintRow]](), list[ConstraintRow]()
        for row in (row for row in self._rows if row.kind == "dot"):
            aligned.setdefault(row.owner, []).append(row)
        for first, second, *still in (rows for rows in aligned.values() if len(rows) > 1):
            turning.append(replace(first, f=np.cross(first.f, second.f)))
            turning += [replace(row, g=np.cross(row.g, first.g)) for row in still]
        return [row.owner for row in turning], Kinematics(self.nodes, rows=turning)

    def natural_gradients(self, q: Array, times: Array, sizes: Array | None = None) -> Array:
        """C_v (T, rows, n_v), no unit, at q (T, n_q), SI, and `times` (T,), s, to find its rank.

        Equations are relative to natural sizes, coordinates to `sizes` (n_v,), by default those of joints.
        """
        sizes = self._joint_sizes if sizes is None else sizes
        C_v = self.values(q, times)[1] * sizes / self._row_sizes[:, None]
        return np.where(np.abs(C_v) > NO_SLOPE, C_v, 0.0)

    def turned_over(self, q: Array, times: Array) -> dict[str, Booleans]:
        """By name (T,) whether a loop joint or tool axis is turned by π at q (T, n_q), SI, and `times` (T,), s.

        "dot" equations, which do not distinguish senses of parallel axes, are 0 there, too.
        """
        owners, senses = self._senses
        if not owners:
            return {}
        against = senses.values(q, times)[0] < 0.0
        return {owner: against[:, [other == owner for other in owners]].any(axis=1) for owner in owners}

    def posture(self, q: Array, t: float, locked: Booleans | None = None) -> Array | None:
        """Project q (n_q,), SI, onto C(q, t) = 0 at t (s), joints `locked` (n_v,) stay; None without convergence."""
        solved, is_met = self.postures(q[None], np.array([t]), locked)
        return solved[0] if is_met[0] else None

    def postures(self, q: Array, times: Array, locked: Booleans | None = None) -> tuple[Array, Booleans]:
        """Project q (T, n_q), SI, onto C(q, t) = 0 at `times` (T,), s; return it and flags (T,) of convergence.

        Joints not `locked` (n_v,) move by least steps. A joint or tool axis turned by π does not count as converged.
        """
        moved, left = self.moved(q, times, locked=locked)
        is_met = left <= MET
        for is_turned_over in self.turned_over(moved, times).values():
            is_met &= ~is_turned_over
        return moved, is_met

    def moved(
        self, q: Array, times: Array, beside: Array | None = None, locked: Booleans | None = None
    ) -> tuple[Array, Array]:
        """Project q (T, n_q), SI, onto C = `beside` (T, rows), SI, default 0, at `times` (T,), s; with residuals (T,).

        Newton's method takes least steps of joints not `locked` (n_v,); modal coordinates stay. Residuals have no unit,
        relative to natural sizes, NaN where not finite.
        """
        more = np.zeros((0, 0)) if beside is None else self.signs * beside
        scales = self._joint_sizes if locked is None else np.where(locked, 0.0, self._joint_sizes)
        # Coordinates by themselves have no branches
        farthest = np.inf if all(row.kind == "coordinate" for row in self._rows) else LARGEST_TURN
        return self.core.postures(
            self.scene, times.tolist(), q, beside=more, scales=scales, sizes=self._row_sizes, largest_step=farthest
        )


@struct
class Model:
    """A scene in space with its bodies, which all analyses share. SI units.

    `rows` are the constraint equations, `cut` coordinates of joints at which loops are cut; `modal_loads` act beside
    the loads of the scene.
    """

    scene: MechanismScene
    tree: KinematicTree
    rows: tuple[ConstraintRow, ...]
    cut: tuple[CutCoordinate, ...] = ()
    modal_loads: tuple[Drive, ...] = ()

    @property
    def loop_rows(self) -> Booleans:
        """Whether constraint equations (rows,) close loops."""
        return np.array([not row.is_trajectory for row in self.rows], dtype=bool)

    @property
    def row_signs(self) -> Array:
        """Signs (rows,), no unit: −1 where the core's equation has the coordinate of a reversed joint, else 1."""
        return np.array([row.sign for row in self.rows])

    @cached_property
    def constraints(self) -> Constraints:
        """Constraint equations in the core."""
        return Constraints(self)

    @cached_property
    def along_cut(self) -> AlongCut:
        """Values and rates of joint coordinates at which loops are cut, by states of the tree."""
        return AlongCut(self.tree, self.cut)

    @cached_property
    def motors(self) -> dict[str, Array]:
        """Indices (k,) in v of the k motor coordinates of each joint, in the scene's order."""
        return {joint.name: _in_order(self.driven(joint.name)) for joint in self.scene.motor_joints}

    @property
    def sticking(self) -> list[str]:
        """Advice on joints with dry friction; none without any."""
        names = [joint.name for joint in self.scene.joint if any(one.coulomb > 0 for one in joint.frictions)]
        return [f"dry friction of {quoted(names)} jumps where these stop: raise friction_speed"] if names else []

    @property
    def motor_columns(self) -> Indices:
        """Indices (motors,) in v of all motor coordinates."""
        return np.array([column for columns in self.motors.values() for column in columns], dtype=np.intp)

    def by_motor(self, values: Array) -> dict[str, Array]:
        """Columns (…, k) of `values` (…, motors and any others), of any unit, by joint with motors."""
        motors = self.motors
        parts = np.split(values, np.cumsum([len(columns) for columns in motors.values()]), axis=-1)
        return dict(zip(motors, parts[:-1], strict=True))

    def columns(self, joint: str) -> Array:
        """Indices (k,) in v of the coordinates of a tree joint, in the scene's order; none of a spherical one."""
        return _in_order(self.tree.nodes[self.tree.carried[joint]])

    def joint_of(self, row: ConstraintRow) -> str:
        """The scene's joint whose coordinate, or whose motor's, a constraint equation prescribes."""
        behind = {gear.motor.v.start: gear.joint.joint.name for gear in self.tree.gears}
        return behind.get(row.coordinate, self.tree.nodes[row.b.body].joint.name)

    def measures_way(self, row: ConstraintRow) -> bool:
        """Whether a constraint equation is in m; others are in rad, or cosines."""
        if row.kind == "coordinate":
            return self.tree.nodes[row.b.body].joint.units == ("m",)
        return row.kind in ("point", "slide")

    def along(self, joint: str) -> Array:
        """Directions ±1 in v (k, n_v) of moments on the second side of a joint along its k coordinates."""
        return self.sign(joint) * np.eye(self.tree.n_v)[_in_order(self.driven(joint))]

    def sign(self, joint: str) -> float:
        """−1 where the tree traverses the joint from its second side to its first, else 1."""
        return self.driven(joint).sign

    def driven(self, joint: str) -> Node:
        """The node that torques on a joint turn: its body, or its motor behind a compliant gear."""
        behind = {gear.joint.joint.name: gear.motor for gear in self.tree.gears}
        return behind.get(joint, self.tree.nodes[self.tree.carried[joint]])

    def without_paths(self) -> "Model":
        """The robot without trajectories, with constraint equations of loops alone."""
        return replace(self, rows=tuple(row for row in self.rows if not row.is_trajectory))

    def modal_directions(self, on_modes: Mapping[str, Array]) -> Array:
        """Generalized forces (k, n_v), N/√kg, of k forces (n, k), N/√kg, on the modes of files by body."""
        (count,) = {forces.shape[1] for forces in on_modes.values()}
        directions = np.zeros((count, self.tree.n_v))
        for node in self.tree.nodes:
            if node.body.name in on_modes:
                directions[:, node.p_v] = on_modes[node.body.name].T @ node.body.modal_transform
        return directions

    def compliance(self, forces: Array, others: Array) -> Array:
        """Static deflections (k, m) of modes by generalized `forces` (k, n_v) along `others` (m, n_v), SI."""
        return np.sum([forces[:, of.p_v] / of.body.stiffness @ others[:, of.p_v].T for of in self.tree.nodes], axis=0)

    @cached_property
    def size(self) -> float:
        """Size of the robot, m: the largest distance of two named points of a body, or 1 m without any."""
        sizes = [
            float(np.linalg.norm(at.position - other.position))
            for node in self.tree.nodes
            for at in node.body.points.values()
            for other in node.body.points.values()
        ]
        return max(sizes, default=0.0) or 1.0

    @cached_property
    def row_sizes(self) -> Array:
        """Natural sizes (rows,) of the constraint equations: 1 rad, or the robot's size, m."""
        return np.array([self.size if self.measures_way(row) else 1.0 for row in self.rows])

    @cached_property
    def joint_sizes(self) -> Array:
        """Natural sizes (n_v,) of joint coordinates: 1 rad or the robot's size, m; 0 for modes, which stay."""
        all_sizes = np.zeros(self.tree.n_v)
        for node in self.tree.nodes:
            units = node.joint.units or node.joint.guess_units
            sizes = np.array([1.0 if unit == "rad" else self.size for unit in units])
            all_sizes[node.v] = node.joint.state(sizes) if node.joint.units else sizes
        return all_sizes

    @cached_property
    def natural_sizes(self) -> Array:
        """Natural sizes (n_v,): 1 rad or the robot's size, m, for joints, √J for modes (`Body.largest_moment` J)."""
        sizes = self.joint_sizes.copy()
        for node in self.tree.nodes:
            sizes[node.p_v] = np.sqrt(node.body.largest_moment)
        return sizes

    def path_errors(self, times: Array, q: Array) -> dict[str, Array]:
        """Path errors (T, m), m or rad, by trajectory, at `times` (T,), s, and q (T, n_q), SI."""
        C, owners = self.constraints.values(q, times)[0], [row.owner if row.is_trajectory else "" for row in self.rows]
        return {path.name: C[:, [owner == path.name for owner in owners]] for path in self.scene.trajectory}


def _in_order(node: Node) -> Array:
    ordered = node.joint.coordinates(np.arange(node.v.start, node.v.stop))[: len(node.joint.units)]
    return ordered[::-1] if node.backwards and node.joint.type == "universal" else ordered
