"""All loads on a link over a motion as multiples of unit loads: forces at interfaces, and of its inertia. SI units.

Forces in joints are by Newton and Euler, in the core (docs/theory.md, Stresses). Where motors carry the motion they do
so in place of the forces along its trajectories: loops then transmit their share of M v̇ − Q (`split_forces`).
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...fe_models.modal_body.unit_loads import PAIRS, interface_load_names
from ..fields.field_types import split_point
from ..model.known_motion import MotionForces, motion_forces, required_forces
from ..model.masses import turns_as_a_body
from ..model.nodes import Section
from ..model.system import MultibodySystem, split_forces
from ..run.record import Run
from ..scene.bodies import tensor
from .motion import acting_forces, system_of
from .supply import behind_gears


class LinkLoads(NamedTuple):
    """Loads on a link during a motion."""

    sizes: Mapping[str, Array]  # (T,) SI, of unit loads by their names (`fe_models.modal_body.unit_loads`)
    modal_force: Array  # (T, n) N/√kg, of patches on modes of the equations


def loads_on_links(run: Run, bodies: Iterable[str]) -> dict[str, LinkLoads]:
    """Loads on `bodies`; {} where motors turn frames.

    Motors that are as many as degrees of freedom act in place of forces on paths.
    """
    if run.model.scene.motors == "frame":
        return {}
    model, behind = run.model, behind_gears(run)
    if not run.is_prescribed or model.loop_rows.sum() + len(model.motor_columns) != int(model.tree.joint_columns.sum()):
        return _link_loads(run, bodies, acting_forces(behind))
    # Motors carry the motion, in place of forces on its paths
    multipliers, wanted = np.zeros_like(run.multipliers), required_forces(MultibodySystem(model), run, run.time)
    multipliers[:, model.loop_rows] = split_forces(model, run.q, wanted).loops
    return _link_loads(run, bodies, motion_forces(system_of(behind), behind, run.time, multipliers))


def loads_in_equations(run: Run, bodies: Iterable[str]) -> dict[str, LinkLoads]:
    """The loads that the equations apply to `bodies`, trajectory forces included."""
    return _link_loads(run, bodies, acting_forces(behind_gears(run)))


def _link_loads(run: Run, bodies: Iterable[str], forces: MotionForces) -> dict[str, LinkLoads]:
    tree, gravity, loads = run.model.tree, np.array(run.model.scene.gravity), {}
    for name in bodies:
        number = tree.index[name]
        node, F = tree.nodes[number], forces.axes(number)
        at_points = _at_points(F, *forces.on_sections(number))
        left = forces.found.modal[:, node.p_v].copy()
        for point, wrench in at_points.items():
            at = node.body.points[point]
            left -= wrench @ np.vstack([at.translation, at.rotation])
        for payload in run.model.scene.payload:
            body, point = split_point(payload.point)
            if body == name and not turns_as_a_body(run.model.scene, payload):  # others are bodies of their own
                of_point = acting_forces(run).of_point(payload.point)
                force = -payload.mass * (of_point.a - gravity)
                on_point = _in_axes_of(F, (force, -of_point.alpha @ tensor(payload.inertia)))  # it turns about z alone
                at_points[point] = at_points.get(point, 0.0) + on_point
        a, alpha, omega = forces.of_body(number)
        # The d'Alembert forces of the frame's motion
        a, alpha, omega = np.hsplit(_in_axes_of(F, (a - gravity, alpha, omega)), 3)
        sizes = {f"{load}_{axis}": of[:, k] for load, of in (("t", a), ("r", alpha)) for k, axis in enumerate("xyz")}
        sizes |= {f"omega_{pair}": omega[:, i] * omega[:, j] for pair, (i, j) in PAIRS.items()}
        for point, wrench in at_points.items():
            sizes |= dict(zip(interface_load_names([point]), wrench.T, strict=True))
        loads[name] = LinkLoads(sizes, left)
    return loads


def _at_points(F: Array, sections: Sequence[Section], wrenches: Array) -> dict[str, Array]:
    """(T, 6) by point, in axes of the body F (T, 3, 3); without what turns its frame and not the section."""
    of_points = dict[str, Array]()
    for section, own in zip(sections, np.split(wrenches @ F, len(sections), axis=1), strict=True):
        if section.point:
            own[:, 1] = section.turned(own[:, 1, :, None])[..., 0]
            of_points[section.point] = of_points.get(section.point, 0.0) + own.reshape(-1, 6)
    return of_points


def _in_axes_of(F: Array, vectors: Iterable[Array]) -> Array:
    """Vectors (T, 3) side by side, from global axes to those of a triad F (T, 3, 3)."""
    return (np.stack(tuple(vectors), axis=1) @ F).reshape(len(F), -1)
