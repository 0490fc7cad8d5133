"""What is read off a motion in space: places of bodies and points, joint coordinates, path forces, motor moments.

All arrays are over the output times (T, …), SI units, global axes unless a name says otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...common.arrays import Array
from ...common.rotations import left_jacobian, quaternions
from ..model.spatial_model import SpatialModel, row_values
from ..model.spatial_tree import Motion, Node, Section


@dataclass(frozen=True)
class BodyMotion:
    """Of a body's frame: position (T, 3) m, quaternion (T, 4) of continuous sign, velocity and angular velocity (T, 3).

    `modal` and `modal_velocity` (T, n) are in the modes of the modal body file.
    """

    position: Array
    quaternion: Array
    velocity: Array
    angular_velocity: Array
    modal: Array
    modal_velocity: Array


@dataclass(frozen=True)
class PointMotion:
    """Of a section: position (T, 3) m, deflection Φp (T, 3) m in body axes, quaternion (T, 4) of continuous sign."""

    position: Array
    deflection: Array
    quaternion: Array


@dataclass(frozen=True)
class MotorForces:
    """τ (T, k) by joint, N·m or N, on its second side, and F_p (T, n) by body, what patches would have to supply."""

    moments: Mapping[str, Array]
    modal: Mapping[str, Array]


@dataclass(frozen=True)
class SpatialMotion:
    """States q (T, n_q), v and a (T, n_v) of a model's tree, and multipliers (T, rows) of its rows, at `time` (T,)."""

    model: SpatialModel
    time: Array
    q: Array
    v: Array
    a: Array
    multipliers: Array

    @cached_property
    def frames(self) -> list[Motion]:
        """Of all bodies, in the order of the tree."""
        return self.model.tree.frames(self.q)

    @cached_property
    def rows(self) -> tuple[Array, Array]:
        """C (T, rows) and C_v (T, rows, n_v)."""
        return row_values(self.model, self.q, self.time)

    def node(self, body: str) -> Node:
        """The node of a body."""
        return self.model.tree.nodes[self.model.tree.index[body]]

    def body(self, name: str) -> BodyMotion:
        """Of a body's frame and modes."""
        node, frame = self.node(name), self.frames[self.model.tree.index[name]]
        velocity = np.einsum("tij,tj->ti", frame.L, self.v)
        stored = node.body.modal_transform.T
        return BodyMotion(
            frame.r, continuous(quaternions(frame.F)), velocity[:, :3], velocity[:, 3:],
            self.q[:, node.p_q] @ stored, self.v[:, node.p_v] @ stored,
        )  # fmt: skip

    def section(self, point: str) -> Motion:
        """Of the section "BODY.POINT"."""
        return self.model.tree.motion(self.model.tree.section(point, np.eye(3)), self.q, self.frames)

    def point(self, point: str) -> PointMotion:
        """Of the section "BODY.POINT"."""
        found, (body, _, label) = self.section(point), point.partition(".")
        node = self.node(body)
        deflection = self.q[:, node.p_q] @ node.body.points[label].translation.T
        return PointMotion(found.r, deflection, continuous(quaternions(found.F)))

    def joint(self, name: str) -> tuple[Array, Array] | None:
        """Coordinates, unwrapped, and rates (T, k) of a joint; None where it has none, or closes a loop."""
        number = self.model.tree.carried.get(name)
        if number is None or not self.model.tree.nodes[number].joint.units:
            return None
        node = self.model.tree.nodes[number]
        x, x_dot = (node.joint.coordinates(values) for values in (self.q[:, node.q], self.v[:, node.v]))
        if not node.backwards:
            return x, x_dot
        h = 1e-6  # of a linear map, but for planar joints
        ahead, behind = (node.joint.turned_around(x + s * x_dot) for s in (h, -h))
        linear = node.joint.type != "planar"
        return node.joint.turned_around(x), node.joint.turned_around(x_dot) if linear else (ahead - behind) / (2 * h)

    def path_force(self, trajectory: str) -> Array:
        """−λ (T, m) of its rows: forces on the point, then moments on the section about global axes."""
        chosen = [k for k, row in enumerate(self.model.rows) if row.is_trajectory and row.owner == trajectory]
        return -self.multipliers[:, chosen]

    @cached_property
    def motor_forces(self) -> MotorForces:
        """What motors and modal forces do in place of the path's forces: Gᵀτ + EᵀF_p + C_mᵀν = −C_sᵀλ_s.

        In joint coordinates without loops τ are the components of the right side along the motors' coordinates and F_p
        those along the modes; loops share them out with ν.
        """
        model, C_v, is_loop = self.model, self.rows[1], self.model.loop_rows
        wanted = -np.einsum("tij,ti->tj", C_v[:, ~is_loop], self.multipliers[:, ~is_loop])
        columns = {name: model.sign(name) for name in model.motors}
        joints, motors = model.tree.joint_columns, np.concatenate([*model.motors.values(), np.zeros(0, dtype=int)])
        G = np.eye(model.tree.n_v)[motors.astype(int)]
        loops = C_v[:, is_loop]
        rows = np.concatenate([loops, np.broadcast_to(G, (len(self.time), *G.shape))], axis=1)
        found = np.array(
            [
                np.linalg.lstsq(of_one.T, right, rcond=None)[0]
                for of_one, right in zip(rows[:, :, joints], wanted[:, joints], strict=True)
            ]
        ).reshape(len(self.time), -1)
        left = wanted - np.einsum("tij,ti->tj", rows, found)
        moments, first = {}, loops.shape[1]
        for name, numbers in model.motors.items():
            moments[name] = columns[name] * found[:, first : first + len(numbers)]
            first += len(numbers)
        modal = {node.body.name: left[:, node.p_v] for node in model.tree.nodes}
        if model.scene.motors == "frame":
            self._move_to_frames(moments, modal)
        stored = {name: values @ np.linalg.pinv(self.node(name).body.modal_transform) for name, values in modal.items()}
        return MotorForces(moments, stored)

    def _move_to_frames(self, moments: Mapping[str, Array], modal: dict[str, Array]) -> None:
        """Motors that turn frames, not sections: what they do less on the modes, modal forces do more."""
        for joint in self.model.scene.motor_joints:
            if joint.units != ("rad",):
                continue
            node = self.model.tree.nodes[self.model.tree.carried[joint.name]]
            axis = self.model.tree.motion(node.inner, self.q, self.frames).F[:, :, 2]
            along = self.model.sign(joint.name) * moments[joint.name]
            for section, sign in ((node.outer, 1.0), (node.inner, -1.0)):
                if section.body >= 0:
                    body = self.model.tree.nodes[section.body].body.name
                    turn = np.einsum("ti,tij->tj", axis, self._spin_of_modes(section))
                    modal[body] = modal[body] + sign * along * turn

    def _spin_of_modes(self, section: Section) -> Array:
        """A J_l Φ_r (T, 3, n): the section's angular velocity by ṗ."""
        node = self.model.tree.nodes[section.body]
        Phi_r = node.body.points[section.point].rotation
        phi = self.q[:, node.p_q] @ Phi_r.T
        found: Array = self.frames[section.body].F @ left_jacobian(phi) @ Phi_r
        return found


def continuous(e: Array) -> Array:
    """Quaternions (T, 4) with signs that do not jump, the first e0 ≥ 0."""
    flips = np.sum(e[1:] * e[:-1], axis=1) < 0
    signs: Array = np.where(np.cumsum(np.append(False, flips)) % 2, -1.0, 1.0)
    return e * signs[:, None]
