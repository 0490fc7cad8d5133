"""What a robot is like in one posture: torques, sag, natural frequencies, stiffness, manipulability, response."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, SolveError, quoted
from ..model.gears import with_compliance
from ..model.known_motion import State
from ..model.model import Model
from ..model.nodes import Section
from ..posture.start import relaxed_gears
from ..scene.space import SPACES
from .joint_conditions import (
    COMPLIANT,
    LOCKED,
    FreeCoordinates,
    JointCondition,
    free_coordinates,
    frequency_response,
    joint_conditions,
    translational_stiffness,
)
from .linearisation import LinearEquations, LinearMechanism, labelled
from .statics import Statics

NONE = np.zeros(0)
Judge = Callable[[FreeCoordinates, Array, Array], Mapping[str, Array]]
"""Further findings, by name: of free coordinates, rows J (d, f) of the point's translations along s, in global axes,
and the axes (3, 3) of the point, in rows; of a point without own axes the global ones."""
FREE = 1e-12  # of the largest stiffness: less lets the robot move


class PoseEvaluator:
    """Evaluates undeformed postures of a robot with motors locked; links and compliant gears deform under loads.

    Attributes:
        motors: names of the coordinates of motors, in the order of `torque`.
        segments: pairs of sections, straight lines between which show the robot: from that at which a body is carried
            to those at which it carries others, and to the point.
    """

    def __init__(
        self,
        model: Model,
        q: Array,
        point: str,
        *,
        count: int = 0,
        omega: Array = NONE,
        others: Sequence[str] = (),
        judge: Judge | None = None,
    ) -> None:
        """`q` (n_q,) is any posture of `model`; `count` frequencies are kept, and responses at `omega` (F,), rad/s.

        `others`: further points of `linear_equations`. `judge` makes further findings of each condition.
        """
        self._judge = judge
        self.model = with_compliance(model.without_paths())
        self.space, self.point, self._count, self._omega = SPACES[model.scene.space], point, count, omega
        self._linear, self._statics = LinearEquations(self.model, self._all(q), [point, *others]), Statics(self.model)
        shafts = [name for name in self._linear.names if name.startswith("motor/")]
        driven = {name for joint in self.model.motors for name, _ in labelled(self.model, joint)}
        direct = [name for name in self._linear.names if name in driven]
        if len(direct) < len(driven):
            raise InputError(
                f"{model.scene.path}: joint: expected no more motors than degrees of freedom", quoted(model.motors)
            )
        self.motors = (*(name for name in direct if name.replace("joint/", "motor/") not in shafts), *shafts)
        tree, segments = self.model.tree, list[tuple[Section, Section]]()
        for number, node in enumerate(tree.nodes):
            ends = [other.inner for other in tree.nodes if other.inner.body == number]
            if point.partition(".")[0] == node.body.name:
                ends.append(tree.section(point))
            segments += [(node.outer, end) for end in ends]
        self.segments = tuple(segments)

    def at(self, q: Array) -> dict[str, Array]:
        """Findings by name in the undeformed posture q (n_q,), SI. Raises `SolveError` where there is no equilibrium.

        Of the point, with d axes, k translations and rotations: `place` and `sag` (d,) m, `manipulability`, √det(J Jᵀ)
        of its velocity by rates of joints with motors (Yoshikawa, 1985); by "joints_locked/…", "joints_compliant/…":
        `frequency` (count,) Hz, `compliance` (k, k) SI, `stiffness` (d,) and `least_stiffness` N/m, its `direction`
        (d,), `response` (F, d) m/N. Of the robot: `torque` (motors,) N·m or N, `robot` (segments, 2, 3) m.
        """
        q, tree = self._all(q), self.model.tree
        before = self._place(q)
        rest = np.zeros(tree.n_v)
        straight, (mechanism, bent) = self._linear.at(0.0, q, rest, rest), self._equilibrium(q)
        torque = np.array([mechanism.force[mechanism.names.index(name)] for name in self.motors])
        values = {"place": before, "sag": self._place(bent) - before, "torque": torque}
        d = len(self.space.translations)
        columns = [straight.names.index(name.replace("motor/", "joint/")) for name in self.motors]
        stretches = np.linalg.svd(straight.points[self.point][:d, columns], compute_uv=False)
        values["manipulability"] = np.array(float(np.prod(stretches)) if len(columns) >= d else 0.0)
        for condition, at in joint_conditions(mechanism).items():
            of_condition = self._of_condition(at)
            if len(self._omega):
                response = frequency_response(at.free, mechanism.of_tool(self.point), self._omega)
                of_condition["response"] = np.abs(response[:, :d])
            if self._judge is not None:
                J, axes = mechanism.points[self.point], np.eye(3)
                if self.point in mechanism.tool_axes:
                    axes[:d, :d] = mechanism.tool_axes[self.point][:d, :d]
                of_condition |= self._judge(at.free, J[:d], axes)
            values |= {f"joints_{condition}/{name}": value for name, value in of_condition.items()}
        places = tree.places(q[None])
        values["robot"] = np.array([[places.at(end).r[0] for end in pair] for pair in self.segments])
        return values

    def _all(self, q: Array) -> Array:
        """With the coordinates of motors behind compliant gears that are not strained."""
        more = np.zeros(self.model.tree.n_q - len(q))
        return relaxed_gears(self.model, State(np.append(q, more), np.zeros(self.model.tree.n_v))).q

    def _place(self, q: Array) -> Array:
        tree = self.model.tree
        return self.space.along(tree.places(q[None]).at(tree.section(self.point)).r[0])

    def linear_equations(self, q: Array, near: Array | None = None) -> tuple[LinearMechanism, Array]:
        """The linear equations about the equilibrium near the undeformed q (n_q,), and its coordinates, rad and m.

        `near`: coordinates of a similar robot's equilibrium, from which this one is sought in place of q. Raises
        `SolveError` where there is no stable one.
        """
        return self._equilibrium(self._all(q) if near is None else near)

    def _equilibrium(self, q: Array) -> tuple[LinearMechanism, Array]:
        """The linear equations in the equilibrium near q (n_q,) with motors locked, and its coordinates."""
        rest, bent = np.zeros(self.model.tree.n_v), self._statics.equilibrium(q, self.model.motor_columns)
        mechanism = self._linear.at(0.0, bent, rest, rest)
        K = free_coordinates(mechanism, COMPLIANT if self.model.tree.gears else LOCKED).K
        values = np.linalg.eigvalsh(K)
        if len(values) and abs(values).min() <= FREE * values[-1]:
            raise SolveError("joints without motors leave the robot free to move")
        if len(values) and values[0] < 0.0:
            raise SolveError("no stable equilibrium near the posture with straight links")
        return mechanism, bent

    def _of_condition(self, at: JointCondition) -> dict[str, Array]:
        C, frequency = at.compliance[self.point], at.modes.frequency
        frequency = np.append(frequency[frequency > 0.0], np.full(self._count, np.nan))[: self._count]
        stiffness, d = translational_stiffness(C), len(self.space.translations)
        along, least, direction = stiffness or (np.zeros(d), 0.0, np.full(d, np.nan))
        return {
            "frequency": frequency,
            "compliance": C,
            "stiffness": along,
            "least_stiffness": np.array(least),
            "direction": direction,
        }
