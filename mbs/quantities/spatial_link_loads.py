"""All loads on a link over a motion in space, as multiples of unit loads: forces at interfaces, and of its inertia.

What a joint hands to the body that it carries is what that body and all that hangs on it need for their motion, less
what else acts there (Newton and Euler). Where motors carry the motion they do so in place of the forces along its
trajectories, as in `link_loads` of the plane: loops then transmit their share of M v̇ − Q (`split_forces`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from ...common.arrays import Array
from ...fe_models.modal_body.unit_loads import PAIRS, interface_load_names
from ..fields.field_types import split_point
from ..model.spatial_inverse import BodyForces, body_forces
from ..model.spatial_known_motion import required_forces
from ..model.spatial_motors import split_forces
from ..model.spatial_payloads import turns_as_a_body
from ..model.spatial_rows import SpatialRow
from ..model.spatial_transmission import rotors
from ..model.spatial_tree import Section
from ..model.spatial_wrench import Wrench, row_wrenches
from ..scene.spatial.bodies import SpatialPayload, tensor
from .link_loads import LinkLoads
from .spatial_motion import SpatialMotion
from .spatial_reactions import load_wrench

AtPoints = dict[str, Wrench]
"""What acts on a body by the name of its point, moments about the global origin."""


def link_loads_in_space(motion: SpatialMotion, bodies: Iterable[str]) -> dict[str, LinkLoads]:
    """Of each of `bodies`. Nothing where motors turn frames: what they do to a link acts at no interface."""
    if motion.model.scene.motors == "frame":
        return {}
    return _link_loads(motion, bodies, _forces_of_rows(motion))


def loads_in_equations(motion: SpatialMotion, bodies: Iterable[str]) -> dict[str, LinkLoads]:
    """Of each of `bodies`, as its equations of motion have them: forces along trajectories where these act."""
    return _link_loads(motion, bodies, zip(motion.model.rows, -motion.multipliers.T, strict=True))


def _link_loads(
    motion: SpatialMotion, bodies: Iterable[str], of_rows: Iterable[tuple[SpatialRow, Array]]
) -> dict[str, LinkLoads]:
    tree, state = motion.model.tree, motion.accelerated
    of_frames, gravity = state.of_frames(), np.array(motion.model.scene.gravity)
    needed = [body_forces(n, state, of, gravity) for n, of in zip(tree.nodes, of_frames, strict=True)]
    acting, found = _wrenches(motion, needed, (*of_rows, *motion.along_cut)), {}
    for name in bodies:
        number = tree.index[name]
        node, frame = tree.nodes[number], motion.frames[number]
        at_points = {point: _at_point(motion, name, point, wrench) for point, wrench in acting[number].items() if point}
        left = needed[number].modal.copy()
        for point, wrench in at_points.items():
            at = node.body.points[point]
            left -= wrench @ np.vstack([at.translation, at.rotation])
        for payload in motion.model.scene.payload:
            body, point = split_point(payload.point)
            if body == name and not turns_as_a_body(payload):  # others are bodies of their own
                at_points[point] = at_points.get(point, 0.0) + _of_mass(motion, payload)
        a, alpha = (
            np.einsum("tji,tj->ti", frame.F, x) for x in (of_frames[number].r - gravity, of_frames[number].Omega)
        )
        sizes = _of_frame(a, alpha, np.einsum("tji,tj->ti", frame.F, state.velocity(frame)[1]))
        for point, wrench in at_points.items():
            sizes |= dict(zip(interface_load_names([point]), wrench.T, strict=True))
        found[name] = LinkLoads(sizes, left)
    return found


def _of_frame(a: Array, alpha: Array, omega: Array) -> dict[str, Array]:
    """Sizes of the d'Alembert forces of the frame's motion, (T, 3) each in its axes; gravity is taken off a."""
    found = {f"t_{axis}": column for axis, column in zip("xyz", a.T, strict=True)}
    found |= {f"r_{axis}": column for axis, column in zip("xyz", alpha.T, strict=True)}
    return found | {f"omega_{name}": omega[:, i] * omega[:, j] for name, (i, j) in PAIRS.items()}


def _at_point(motion: SpatialMotion, body: str, point: str, wrench: Wrench) -> Array:
    """Force and moment there (T, 6) in axes of the body's frame."""
    at, F = motion.section(f"{body}.{point}"), motion.frames[motion.model.tree.index[body]].F
    there = wrench.seen_from(-at.r)
    return np.hstack([np.einsum("tji,tj->ti", F, x) for x in there])


def _of_mass(motion: SpatialMotion, payload: SpatialPayload) -> Array:
    """Force and moment (T, 6) of a payload's inertia and weight on its point, axes of the body (Newton and Euler)."""
    tree, state, body = motion.model.tree, motion.accelerated, split_point(payload.point)[0]
    section = tree.section(payload.point, np.eye(3))
    at, of = motion.section(payload.point), state.of_section(section, state.of_frames())
    Omega, J = state.velocity(at)[1], at.F @ tensor(payload.inertia) @ at.F.transpose(0, 2, 1)
    arm = at.F @ np.array(payload.center)
    a = of.r + np.cross(of.Omega, arm) + np.cross(Omega, np.cross(Omega, arm)) - np.array(motion.model.scene.gravity)
    spin = np.einsum("tij,tj->ti", J, Omega)
    force, moment = -payload.mass * a, -np.einsum("tij,tj->ti", J, of.Omega) - np.cross(Omega, spin)
    F = motion.frames[tree.index[body]].F
    return np.hstack([np.einsum("tji,tj->ti", F, x) for x in (force, moment + np.cross(arm, force))])


def _wrenches(
    motion: SpatialMotion, needed: list[BodyForces], of_rows: Iterable[tuple[SpatialRow, Array]]
) -> list[AtPoints]:
    """On points of each body, in the order of the tree; `of_rows` has the forces (T,) of rows that act."""
    tree = motion.model.tree
    acting: list[AtPoints] = [{} for _ in tree.nodes]

    def put(section: Section, wrench: Wrench) -> None:
        if section.body >= 0:
            at = acting[section.body]
            at[section.point] = at[section.point].plus(wrench) if section.point in at else wrench

    for row, size in of_rows:
        on_a, on_b = row_wrenches(tree, row, size, motion.q, motion.time, motion.frames)
        put(row.a, on_a)
        put(row.b, on_b)
    loads = [(load.point, load.components) for load in motion.model.scene.load if load.point is not None]
    for point, components in (*loads, *motion.applied):
        put(tree.section(point, np.eye(3)), load_wrench(motion, point, components))
    for rotor in rotors(motion.accelerated):
        moment = rotor.torque[:, None] * rotor.axis + rotor.gyroscopic
        put(rotor.first, Wrench(np.zeros_like(moment), -moment))
    totals = []
    for of_body, frame, known in zip(needed, motion.frames, acting, strict=True):
        total = Wrench(of_body.force, of_body.moment).seen_from(frame.r)
        for wrench in known.values():
            total = total.plus(wrench, -1.0)
        totals.append(total)
    for number in reversed(range(len(tree.nodes))):
        node, total = tree.nodes[number], totals[number]
        put(node.outer, total)
        put(node.inner, Wrench(-total.force, -total.moment))
        if node.inner.body >= 0:
            totals[node.inner.body] = totals[node.inner.body].plus(total)
    return acting


def _forces_of_rows(motion: SpatialMotion) -> Iterator[tuple[SpatialRow, Array]]:
    """Rows that act, each with its force (T,): joints that close loops, and paths where motors do not fit."""
    model = motion.model
    loops, motors = int(model.loop_rows.sum()), sum(len(columns) for columns in model.motors.values())
    if not motion.is_prescribed or loops + motors != int(model.tree.joint_columns.sum()):
        yield from zip(model.rows, -motion.multipliers.T, strict=True)
        return
    total = required_forces(model, motion.accelerated, motion.time)
    shared = split_forces(model, motion.q, motion.frames, motion.rows[1], total).loops
    yield from zip((row for row in model.rows if not row.is_trajectory), shared.T, strict=True)
