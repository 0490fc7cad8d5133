"""What motors and modal forces do in place of the forces on a path: the split of generalized forces. SI units."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, as_list
from ...common.rotations import left_jacobian, left_jacobian_slope
from ...common.structs import struct
from .. import _core
from .drives import Command
from .model import Model
from .system import MultibodySystem


@struct
class MotorForces:
    """Motor forces τ (T, k) by joint, N·m or N, on its second side, and modal forces F_p (T, n) by body, of patches.

    F_p belongs to the modes of the modal body file.
    """

    moments: Mapping[str, Array]
    modal: Mapping[str, Array]


def driven_system(model: Model) -> MultibodySystem:
    """The model in the core, with forces along the coordinates of its motors."""
    return MultibodySystem(model, commands=[Command(along) for joint in model.motors for along in model.along(joint)])


def driven_mechanism(model: Model, *, has_motors: bool = True) -> _core.SpatialDriven:
    """Build the core's mechanism under the loads of its scene, with its motors unless `has_motors` is false."""
    system = driven_system(model)
    driven = _core.SpatialDriven(system.core, system.scene, (~model.loop_rows).tolist())
    if has_motors:
        _add_motors(driven, model)
    return driven


def fastest_mechanism(model: Model, *, has_motors: bool = True) -> _core.PlanarDriven | _core.SpatialDriven:
    """Return a mechanism of the core, planar for open chains in a plane if their equations are equal."""
    system = driven_system(model)
    if model.loop_rows.any() or system.plane is None:
        return driven_mechanism(model, has_motors=has_motors)
    return integrated_mechanism(system, has_motors=has_motors)


def integrated_mechanism(
    system: MultibodySystem, *, has_motors: bool = True
) -> _core.PlanarDriven | _core.SpatialDriven:
    """Return the mechanism as integrated: planar if all motion is in one plane."""
    (core, scene, rows), model = system.integrated, system.model
    is_path = [model.rows[k].is_trajectory for k in rows]
    driven: _core.PlanarDriven | _core.SpatialDriven
    if isinstance(core, _core.PlanarModel):
        driven = _core.PlanarDriven(core, scene, is_path)
    else:
        driven = _core.SpatialDriven(core, scene, is_path)
    if has_motors:
        _add_motors(driven, model)
    return driven


def _add_motors(driven: _core.PlanarDriven | _core.SpatialDriven, model: Model) -> None:
    turning = turning_motors(model)
    for joint, coordinates in model.motors.items():
        for coordinate in coordinates.tolist():
            driven.add_motor(coordinate, model.sign(joint), joint in turning)


def path_forces(model: Model, times: Array, q: Array, multipliers: Array) -> Array:
    """Generalized forces −C_sᵀλ_s (T, n_v), N, N·m, N/√kg, of path constraints with multipliers λ (T, rows)."""
    return driven_mechanism(model).path_forces(as_list(times), q, multipliers * model.row_signs)


def frames_in_core(model: Model, q: Array) -> list[tuple[Array, Array]]:
    """Return axes (3, 3) and origin (3,), m, of all bodies in the core's frames of them, at q (n_q,).

    The core has frames where they suit the joints.
    """
    places, frames = model.tree.places(q[None]), driven_system(model).core.frames(q, np.zeros(model.tree.n_v))
    own = [places.frame(number) for number in range(len(frames))]
    return [(of.R.T @ at.F[0], of.R.T @ (at.r[0] - of.r)) for of, at in zip(frames, own, strict=True)]


def path_forces_on_bodies(model: Model, times: Array, q: Array, multipliers: Array) -> dict[str, Array]:
    """Return, by body, path forces (T, 6 + n) on it: N, N·m on its frame in its axes, N/√kg on its modes."""
    driven = driven_mechanism(model, has_motors=False)
    on_bodies = driven.path_forces_on_bodies(as_list(times), q, multipliers * model.row_signs)
    by_body = {}
    for node, (axes, origin), forces in zip(model.tree.nodes, frames_in_core(model, q[0]), on_bodies, strict=True):
        force, moment = forces[:, :3], forces[:, 3:6]
        on_frame = [force @ axes, (moment - np.cross(origin, force)) @ axes]
        by_body[node.body.name] = np.hstack([*on_frame, forces[:, 6:]])
    return by_body


class SplitForces(NamedTuple):
    """τ (T, k), N·m or N, by joint, EᵀF_p (T, n_v), N/√kg, and λ_c (T, constraint equations of loops), N or N·m."""

    moments: dict[str, Array]
    left: Array
    loops: Array


def split_forces(model: Model, q: Array, wanted: Array) -> SplitForces:
    """Solve Gᵀτ + EᵀF_p − C_cᵀλ_c = `wanted` (T, n_v) at q (T, n_q): mbs/core/recursion/inverse/motors.h."""
    tau, left, multipliers = driven_mechanism(model).split(q, wanted)
    return SplitForces(model.by_motor(tau), left, multipliers)


def motor_forces(model: Model, q: Array, wanted: Array) -> MotorForces:
    """Return motor torques and modal forces that make `wanted` (T, n_v), N, N·m, N/√kg, at q (T, n_q)."""
    moments, left, _ = split_forces(model, q, wanted)
    stored = {node.body.name: left[:, node.p_v] @ node.body.on_file for node in model.tree.nodes}
    return MotorForces(moments, stored)


class FrameShare(NamedTuple):
    """Modal forces of a unit torque of a motor that turns frames, beside its torque along the joint.

    `direction` (n_v,), and `slope` (n_v, n_v), its derivative along v: the axis turns with the section.
    """

    direction: Array
    slope: Array


def frame_share(model: Model, joint: str, q: Array) -> FrameShare:
    """The share −Φ_rᵀ J_l(φ) z of both sections, turned by φ = Φ_r p, for a revolute joint's motor at q (n_q,).

    Why: core/recursion/motion/frame_motor.h.
    """
    tree = model.tree
    direction, slope = np.zeros(tree.n_v), np.zeros((tree.n_v, tree.n_v))
    node = tree.nodes[tree.carried[joint]]
    for section, side in ((node.outer, 1.0), (node.inner, -1.0)):
        if section.body >= 0 and section.point:
            of = tree.nodes[section.body]
            Phi_r, axis = of.body.points[section.point].rotation, side * section.triad[:, 2]
            phi = Phi_r @ q[of.p_q]
            direction[of.p_v] -= Phi_r.T @ left_jacobian(phi) @ axis
            slope[of.p_v, of.p_v] -= Phi_r.T @ left_jacobian_slope(phi, axis) @ Phi_r
    return FrameShare(direction, slope)


def turning_motors(model: Model) -> list[str]:
    """Joints with one angle, that of sections, whose motors turn frames in place of these."""
    if model.scene.motors != "frame":
        return []
    tree = model.tree
    return [
        joint.name
        for joint in model.scene.motor_joints
        if joint.units == ("rad",) and not tree.nodes[tree.carried[joint.name]].inner.still
    ]


def motor_commands(model: Model) -> Iterator[Command]:
    """Yield the effect of a unit command of each motor on the second side of its joint, in order of `Model.motors`."""
    turning = turning_motors(model)
    for joint, columns in model.motors.items():
        frame = (model.tree.carried[joint], model.sign(joint)) if joint in turning else None
        yield from (Command(direction, frame) for direction in model.sign(joint) * np.eye(model.tree.n_v)[columns])
