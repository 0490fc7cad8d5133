"""The mechanism with rigid links: what joint accelerations take, as computed torque needs it."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...mbs.model.body import Body
from ...mbs.model.model import Model, build_model, row_values
from ...mbs.model.rows import ConstraintRow
from ...mbs.model.system import ZERO, MultibodySystem
from ...mbs.model.transmission import resistance

TOLERANCE, MOST_ITERATIONS = 1e-10, 20


def rigid_freedom(model: Model, q: Array) -> int:
    """How many independent joint coordinates the mechanism with rigid links has near q (n_q,)."""
    joints = model.tree.joint_columns
    C_v = row_values(model, q[None], np.zeros(1))[1][0][model.loop_rows][:, joints]
    return int(np.count_nonzero(joints)) - int(np.linalg.matrix_rank(C_v) if C_v.size else 0)


class RigidArm:
    """τ(γ, γ̇, γ̈) of all motors with rigid links, by the core, rotors and friction too, without loads.

    The motors' moments are the multipliers of γ = γ(t), affine in γ̈: one evaluation with γ̈ = 0, one for each motor.
    `q` (n_q,) of the tree of `model` is where its `angles` are. Raises `InputError` where the motors do not fit.
    """

    def __init__(self, model: Model, q: Array) -> None:
        freedom, count = rigid_freedom(model, q), sum(len(columns) for columns in model.motors.values())
        if count != freedom:
            raise InputError(
                f"{model.scene.path}: controller: expected motors that fit the mechanism ({freedom} of them), found"
                f" {count}"
            )
        scene = model.scene.model_copy(update={"load": (), "trajectory": ()})
        free = build_model(scene, [_rigid(node.body) for node in model.tree.nodes])
        motors = list(_motor_rows(free))
        self._model = replace(free, rows=(*free.rows, *motors))
        self._motors = np.arange(len(free.rows), len(free.rows) + len(motors))
        self._system = MultibodySystem(self._model)
        self._q: Array = np.zeros(free.tree.n_q)
        for own, node in zip(free.tree.nodes, model.tree.nodes, strict=True):
            self._q[own.q] = q[node.q]

    def angles(self) -> Array:
        """(motors,) where it stands."""
        found: Array = row_values(self._model, self._q[None], np.zeros(1))[0][0, self._motors]
        return found

    def place(self, gamma: Array) -> tuple[Array, Array]:
        """Coordinates q (n_q,) and C_v at motor angles gamma, by Newton from the last place."""
        q = self._q
        for _ in range(MOST_ITERATIONS):
            values, gradients = row_values(self._model, q[None], np.zeros(1))
            C, C_v = values[0], gradients[0]
            C[self._motors] -= gamma
            if np.abs(C).max() < TOLERANCE:
                break
            q = self._model.tree.integrate(q, -np.linalg.pinv(C_v) @ C)
        self._q = q
        return q, C_v

    def terms(self, gamma: Array, gamma_dot: Array) -> tuple[Array, Array]:
        """M (motors, motors) and h (motors,) of τ = M γ̈ + h."""
        q, C_v = self.place(gamma)
        rates = np.zeros(len(C_v))
        rates[self._motors] = gamma_dot
        v: Array = np.linalg.pinv(C_v) @ rates
        self._system.core.keep_independent_rows(q, v)
        friction = -resistance(self._model, q[None], v[None])[0]

        def moments(target: Array) -> Array:
            signs = self._system.row_signs
            multipliers = self._system.core.evaluate(q, v, signs * target, friction, None)[1]
            found: Array = -(signs * multipliers)[self._motors]
            return found

        h = moments(np.zeros(len(C_v)))
        return np.column_stack([moments(unit) - h for unit in np.eye(len(C_v))[self._motors]]), h

    def moments(self, gamma: Array, gamma_dot: Array, gamma_ddot: Array) -> Array:
        """τ (motors,) N·m, or N."""
        M, h = self.terms(gamma, gamma_dot)
        tau: Array = M @ gamma_ddot + h
        return tau


def _motor_rows(model: Model) -> list[ConstraintRow]:
    """The coordinates of all motors."""
    rows, nothing = [], np.zeros(3)
    for joint, columns in model.motors.items():
        node = model.tree.nodes[model.tree.carried[joint]]
        for k in map(int, columns):
            rows.append(
                ConstraintRow(
                    joint, "coordinate", node.inner, node.outer, nothing, nothing, coordinate=k,
                    q_index=node.q.start + k - node.v.start, sign=model.sign(joint), target=ZERO,
                )
            )  # fmt: skip
    return rows


def _rigid(body: Body) -> Body:
    """The undeformed body."""
    none, empty = np.zeros((3, 0)), np.zeros((0, 0))
    points = {name: replace(at, translation=none, rotation=none) for name, at in body.points.items()}
    return replace(
        body, S_bar=none, I_bar=np.zeros((3, 3, 0)), S_bar_kl=np.zeros((3, 3, 0, 0)), h_spin=np.zeros(0),
        S_spin=empty, stiffness=np.zeros(0), damping=empty, points=MappingProxyType(points), modal_transform=empty,
        reduction=None, attachment_modes=0, stiffening=None,
    )  # fmt: skip
