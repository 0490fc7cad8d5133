"""The mechanism with rigid links: what joint accelerations take, as computed torque needs it at every sample."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from ...common.arrays import Array, as_floats
from ...common.errors import InputError
from ...mbs import _core
from ...mbs.analysis.planar_outcome import PlanarOutcome
from ...mbs.model.model import ZERO, Constraint, Model
from ...mbs.model.planar_body import PlanarBody, PlanarPoint
from ...mbs.model.planar_tree import PlanarTree
from ...mbs.model.system import MechanismSystem
from ...mbs.solve.initial_state import undeformed_state

TOLERANCE, MOST_ITERATIONS = 1e-10, 20


class RigidArm:
    """τ(γ, γ̇, γ̈) of all motors with rigid links, by the equations of motion of the core, rotors and friction too.

    The motors' moments are the multipliers of γ = γ(t), affine in γ̈: one evaluation with γ̈ = 0, one for each motor.
    Raises `InputError` where the motors do not fit the mechanism.
    """

    def __init__(self, model: Model, source: PlanarOutcome | None = None) -> None:
        """`source` is the motion at whose start its `angles` are."""
        if len(model.motors) != model.degrees_of_freedom:
            raise InputError(
                f"{model.scene.path}: controller: expected motors that fit the mechanism ({model.degrees_of_freedom} of"
                f" them), found {len(model.motors)}"
            )
        rigid = replace(model, bodies=tuple(_rigid(body) for body in model.bodies), modal_loads=(), loads=())
        self._at_rest = self._assembly(rigid, None)
        self._still = PlanarTree(self._at_rest)
        self._moved = [PlanarTree(self._assembly(rigid, name)) for name in model.motors]
        names = [c.owner if c.component == "motor" else "" for c in self._at_rest.constraints]
        self._motors = np.array([names.index(name) for name in model.motors])
        self._q, self._source = undeformed_state(self._at_rest).q, source

    @staticmethod
    def _assembly(model: Model, accelerated: str | None) -> MechanismSystem:
        one = _core.TimeFunction.polynomial(np.array([0.0, 1.0]), np.array([[0.5, 0.0, 0.0]]))
        motors = [
            Constraint(row, one if name == accelerated else ZERO, name, "motor", is_trajectory=True)
            for name, row in model.motors.items()
        ]
        # joint angles of the initial guess are met by no target: `_place` moves the arm to the angles it is asked for
        return MechanismSystem(model, [*model.joints, *motors])

    def place(self, gamma: Array) -> tuple[Array, Array]:
        """Coordinates q and C_q at joint angles gamma, by Newton from the last place."""
        system, q = self._at_rest.system, self._q.copy()
        rest = np.zeros_like(q)
        for _ in range(MOST_ITERATIONS):
            C, _, C_q = system.constraints(0.0, q, rest)
            C[self._motors] -= gamma
            q -= np.linalg.solve(C_q, C)
            if np.abs(C).max() < TOLERANCE:
                break
        self._q = q
        return q, C_q

    def angles(self) -> Array:
        """Joint angles (motors,) at the start of its motion, links taken as straight."""
        source = self._source
        assert source is not None
        frames = source.q[0][source.assembly.frame_coordinates]
        q = np.zeros_like(self._q)
        q[self._at_rest.frame_coordinates] = frames
        C = self._at_rest.system.constraints(0.0, q, np.zeros_like(q))[0]
        angles: Array = C[self._motors]
        return angles

    def terms(self, gamma: Array, gamma_dot: Array) -> tuple[Array, Array]:
        """M (motors, motors) and h (motors,) of τ = M γ̈ + h."""
        q, C_q = self.place(gamma)
        rates = np.zeros(len(C_q))
        rates[self._motors] = gamma_dot
        v = as_floats(np.linalg.solve(C_q, rates))
        state = self._still.state(q, v)  # the same in all of these trees
        h, *moved = (-tree.both.at(0.0, *state).multipliers[0][self._motors] for tree in (self._still, *self._moved))
        return np.column_stack(moved) - h[:, None], h

    def moments(self, gamma: Array, gamma_dot: Array, gamma_ddot: Array) -> Array:
        """τ (motors,) N·m."""
        M, h = self.terms(gamma, gamma_dot)
        tau: Array = M @ gamma_ddot + h
        return tau


def _rigid(body: PlanarBody) -> PlanarBody:
    """The undeformed body."""
    none = np.zeros(0)
    points = {name: PlanarPoint(at.position, np.zeros((2, 0)), none) for name, at in body.points.items()}
    empty = np.zeros((0, 0))
    return replace(
        body, stiffness=none, damping=empty, S_bar=np.zeros((2, 0)), h=none, j=none, S_tilde=empty, m_xy=empty,
        points=MappingProxyType(points), modal_transform=empty, stiffening=None,
    )  # fmt: skip
