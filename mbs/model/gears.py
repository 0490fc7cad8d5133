"""Friction along joint coordinates, geared rotors, compliant gears.

Motors behind compliant gears are coordinates of their own, with springs to those of the joints.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ..joints.joint import Friction, GearedJoint, TwistSpring
from ..scene.analysis import Analysis
from .drives import Drive
from .model import Model
from .nodes import ConstraintRow, Node
from .tree import CompliantGear, KinematicTree


def elastic_joints(model: Model) -> list[Node]:
    """The bodies whose inboard joints have compliant gears, in the order of the tree."""
    return [node for node in model.tree.nodes if compliance(node) is not None]


def with_compliance(model: Model) -> Model:
    """The robot with the scene's compliant gears; motors and joint moments act on the motor side.

    The output of such a gear is a massless body of the tree. It turns on the first side of the joint by θ_m, the rotor
    N times as fast (M. W. Spong, J. Dyn. Syst. Meas. Control 109, 1987, with the rotor's whole angular velocity).
    Coordinates of outputs come last.
    """
    elastic = elastic_joints(model)
    if not elastic or model.tree.gears:
        return model
    none = {"stiffness": None, "position_limit": None, "viscous_friction": 0.0, "coulomb_friction": 0.0}
    labels = [f"{node.joint.name}/rotor" for node in elastic]
    tree = model.tree.with_outputs(
        [
            (node.joint.model_copy(update={"name": label, **none}), label, node.outer if node.backwards else node.inner)
            for node, label in zip(elastic, labels, strict=True)
        ]
    )
    outputs = tree.nodes[-len(elastic) :]
    without = {node.body.name: node.joint.model_copy(update={"rotor_inertia": 0.0}) for node in elastic}
    rigid = {node.body.name: replace(node, joint=without[node.body.name]) for node in elastic}
    tree.nodes = tuple(rigid.get(node.body.name, node) for node in tree.nodes)
    tree.gears = tuple(
        CompliantGear(output, rigid[node.body.name], node.sign, *of_gear)
        for output, node in zip(outputs, elastic, strict=True)
        if (of_gear := compliance(node)) is not None
    )
    more = np.zeros(len(outputs))
    loads = tuple(Drive(np.append(at, more), size) for at, size in model.modal_loads)
    return replace(model, tree=tree, rows=tuple(_rows_at_motors(model, tree)), modal_loads=loads)


def with_prescribed_motors(model: Model) -> Model:
    """The robot with its compliant gears where trajectories prescribe motors; otherwise unchanged.

    Raises `InputError` if other trajectories prescribe something else: no motor could do both.
    """
    if not any(path.motor for path in model.scene.trajectory):
        return model
    geared = with_compliance(model)
    outputs = {gear.motor.v.start for gear in geared.tree.gears}
    behind = {gear.joint.v.start for gear in geared.tree.gears}
    for row in geared.rows if outputs else ():
        if row.is_trajectory and (row.kind != "coordinate" or row.coordinate in behind):
            raise InputError(
                f'{model.scene.path}: trajectory: expected motors ("motor") in all of them, or in none, with compliant'
                " gears",
                f'"{row.owner}" with trajectories of motors',
            )
    return geared


def refuse_prescribed_motors(model: Model, analysis: Analysis) -> None:
    """Raise `InputError` for trajectories of motors with compliant gears in analyses that cannot follow them."""
    if any(path.motor for path in model.scene.trajectory) and elastic_joints(model):
        raise InputError(
            'kind: expected "pcid" or "static" with trajectories of motors with compliant gears',
            f'"{analysis.kind}": the robot behind them is not prescribed',
        )


def _rows_at_motors(model: Model, tree: KinematicTree) -> Iterator[ConstraintRow]:
    """The rows of the robot, those of trajectories of motors at the outputs of compliant gears."""
    motors = {path.name: path.motor for path in model.scene.trajectory if path.motor is not None}
    outputs = {gear.joint.joint.name: gear.motor for gear in tree.gears}
    for row in model.rows:
        output = outputs.get(motors.get(row.owner, "")) if row.is_trajectory else None
        if output is None:
            yield row
        else:  # the coordinate of an output counts as the joint of the scene does
            yield replace(row, a=output.inner, b=output.outer, coordinate=output.v.start, sign=1.0)


def compliance(node: Node) -> tuple[TwistSpring, float] | None:
    """Spring and damping (N·m·s/rad, N·s/m) of the gear in a body's inboard joint; None if it is rigid."""
    joint = node.joint
    if not isinstance(joint, GearedJoint) or joint.stiffness is None:
        return None
    return TwistSpring.of(joint.stiffness), joint.damping


def gear_matrices(tree: KinematicTree, q: Array) -> tuple[Array, Array]:
    """K (N·m/rad, N/m) and D (N·m·s/rad, N·s/m), (n_v, n_v), of compliant gears at q (n_q,), SI."""
    K, D = np.zeros((2, tree.n_v, tree.n_v))
    for gear in tree.gears:
        twist = np.zeros(tree.n_v)
        twist[gear.motor.v.start], twist[gear.joint.v.start] = 1.0, -gear.sign
        K += gear.spring.slope(gear.twist(q, np.zeros(tree.n_v))[0]) * np.outer(twist, twist)
        D += gear.damping * np.outer(twist, twist)
    return K, D


def resistance(model: Model, q: Array, v: Array) -> Array:
    """Negative forces (T, n_v) of friction in all joints, cut ones too, at q (T, n_q) and v (T, n_v), all SI."""
    force = model.along_cut.resistance(q, v)
    for column, friction in _frictions(model.tree):
        force[:, column] += friction.resistance(v[:, column])
    return force


def friction_damping(model: Model, q: Array, *, is_at_rest: bool = False) -> Array:
    """The damping matrix (n_v, n_v), N·m·s/rad or N·s/m, at q (n_q,), SI: viscous, at rest also dry friction."""
    D = model.along_cut.damping(q, is_at_rest=is_at_rest)
    for column, friction in _frictions(model.tree):
        D[column, column] += friction.damping(is_at_rest=is_at_rest)
    return D


def _frictions(tree: KinematicTree) -> Iterator[tuple[int, Friction]]:
    for node in tree.nodes:
        yield from zip(range(node.v.start, node.v.stop), node.joint.frictions, strict=False)
