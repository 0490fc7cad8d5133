"""From a scene and its bodies to a model: the tree, and constraint equations that close loops or follow paths.

With `motors = "frame"` angles of revolute joints are between frames of bodies, not sections, where modes turn the
sections about the axis alone. Where they tilt the axis, the moment between frames has no angle with its virtual work.
"""

import copy
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...common.errors import InputError, did_you_mean, quoted
from ...common.rotations import smallest_turn
from .._core import TimeFunction
from ..fields.field_types import GROUND
from ..fields.spelling import NORMAL
from ..joints.joint import JointRecord
from ..joints.joints import FreeJoint, PlanarJoint
from ..scene.mechanism import MechanismScene
from ..scene.topology import Edge, spanning_forest
from ..scene.trajectories import Trajectory
from .body import Body
from .masses import welded_payloads
from .model import Model
from .nodes import ConstraintRow, Section, rows_of_joint
from .tree import KinematicTree, cut_coordinates, cut_row, loop_rows, with_auxiliary_rotors


def build_model(scene: MechanismScene, bodies: Sequence[Body]) -> Model:
    """Make tree and constraint equations of a scene. Raises `InputError` for missing points or impossible equations."""
    _check_points(scene, {body.name: body for body in bodies})
    carried = list(welded_payloads(scene))
    joints = (*scene.joint, *(weld for _, weld in carried))
    names = [*(body.name for body in scene.body), *(body.name for body, _ in carried)]
    topology = spanning_forest(names, [*scene.edges, *(Edge(weld.between) for _, weld in carried)])
    floating = PlanarJoint if scene.is_planar else FreeJoint
    tree = KinematicTree([*(body for body, _ in carried), *bodies], joints, topology, floating)
    tree = with_coordinates_of_frames(tree) if scene.motors == "frame" else tree
    tree, rows = with_auxiliary_rotors(tree)
    rows = [*(row for joint in tree.loops for row in loop_rows(scene, tree, joint)), *rows]
    rows += [row for trajectory in scene.trajectory for row in _path_rows(scene, tree, trajectory)]
    return Model(scene, tree, tuple(rows), tuple(cut_coordinates(scene, tree)))


def _path_rows(scene: MechanismScene, tree: KinematicTree, path: Trajectory) -> Iterator[ConstraintRow]:
    if path.coordinate_of is not None:
        joint = next(each for each in scene.joint if each.name == path.coordinate_of)
        label = f'{scene.path}: trajectory "{path.name}": {"joint" if path.motor is None else "motor"}'
        if len(joint.units) != 1:
            raise InputError(
                f"{label}: expected a joint with one coordinate", f'"{joint.name}", {len(joint.units)} coordinates'
            )
        if path.motor is not None and joint not in scene.motor_joints:
            raise InputError(f"{label}: expected a joint with a motor", f'"{joint.name}", which has none')
        yield row_of_joint(tree, joint, path.name, path.components["value"])
        return
    unit, ground = np.eye(3), tree.section(GROUND)
    if path.angle is not None:
        section, triad = tree.section(path.angle), smallest_turn(np.array(path.axis or NORMAL))
        target = path.components["value"]
        yield ConstraintRow(path.name, "turn", ground, section, triad[:, 2], triad[:, 0], target=target)
        return
    section = tree.section(str(path.point))
    for component, target in path.components.items():
        e = unit["xyz".index(component)]
        yield ConstraintRow(path.name, "point", ground, section, e, e, target=target)
    if path.orientation is None:
        return
    if path.tool_axis is None:
        yield from (ConstraintRow(path.name, "rotation", ground, section, e, e, law=path.orientation) for e in unit)
    else:
        tool = section._replace(triad=section.triad @ smallest_turn(np.array(path.tool_axis)))
        for f in unit[:2]:
            yield ConstraintRow(path.name, "dot", tool, ground, f, unit[2], law=path.orientation)


def row_of_joint(tree: KinematicTree, joint: JointRecord, owner: str, target: TimeFunction) -> ConstraintRow:
    """The equation, of `owner`, by which a joint with one coordinate, in a tree or cut, follows `target`."""
    if joint.name not in tree.carried:
        return replace(cut_row(tree, joint), owner=owner, is_trajectory=True, target=target)
    node = tree.nodes[tree.carried[joint.name]]
    (row,) = rows_of_joint(owner, node, np.r_[node.v], [target], node.sign)
    return row


def _check_points(scene: MechanismScene, bodies: dict[str, Body]) -> None:
    """Raise `InputError` for a reference to a point that its body has not."""
    for reference in scene.references():
        if (place := reference.body_and_point) is None:
            continue
        body, point = place
        if point not in bodies[body].points:
            known = bodies[body].points
            raise InputError(
                f'{scene.path}: {reference.key}: expected a point of "{body}" ({quoted(known)})',
                f'"{reference.name}"{did_you_mean(point, known)}',
            )
        stiffening = bodies[body].stiffening
        if stiffening is not None and point not in stiffening.K_points:
            raise InputError(
                f"{scene.path}: {reference.key}: expected, with geometric_stiffening, a point whose loads' geometric"
                f" stiffness is in the modal body file ({quoted(stiffening.K_points)})",
                f'"{reference.name}"',
            )


ALONG = 1e-12  # of the largest rotation of modes: round-off of those across an axis about which all turn


def with_coordinates_of_frames(tree: KinematicTree) -> KinematicTree:
    """The tree with angles between frames in revolute joints where modes turn sections about the axis alone."""
    changed, joints = copy.copy(tree), (*(node.joint for node in tree.nodes), *tree.loops)
    changed.on_frames = frozenset(
        joint.name
        for joint in joints
        if joint.type == "revolute" and all(_turns_about_z(tree, side) for side in tree.sides(joint))
    )
    changed.nodes = tuple(
        replace(node, inner=node.inner._replace(still=True), outer=node.outer._replace(still=True))
        if node.joint.name in changed.on_frames
        else node
        for node in tree.nodes
    )
    return changed


def _turns_about_z(tree: KinematicTree, section: Section) -> bool:
    """Whether modes turn a section about z of its triad alone."""
    if section.body < 0 or not section.point:
        return True
    body = tree.nodes[section.body].body
    rotation = body.points[section.point].rotation
    if body.stiffening is not None:
        rotation = np.hstack([rotation, body.stiffening.at(section.point)[3:].reshape(3, -1)])
    across = section._replace(still=True).turned(rotation)
    return bool(np.abs(across).max(initial=0.0) <= ALONG * np.abs(rotation).max(initial=0.0))
