"""Variables of FMUs; a forward motion as co-simulation FMUs have it, and what the core's library reads."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...actuation.control.linear_model import StateSpace
from ...actuation.control.signals import ORDERS
from ...actuation.patches.link_patches import LinkPatches
from ...common.arrays import Array
from ...fe_models.modal_body import ModalBody
from ...mbs import _core
from ...mbs.analysis.forward import Forward
from ...mbs.joints.joints import JOINT_TYPES, FreeJoint
from ...mbs.linear.statics import initial_state
from ...mbs.model.model import Model
from ...mbs.model.nodes import Node
from ...mbs.model.system import MultibodySystem
from ...mbs.posture.start import undeformed_posture
from ...mbs.run.integrator_choice import integrator_of
from ...mbs.run.integrators import METHODS

UNITS: Mapping[str, Mapping[str, int]] = {
    "1": {},
    "rad": {"rad": 1},
    "m": {"m": 1},
    "rad/s": {"rad": 1, "s": -1},
    "m/s": {"m": 1, "s": -1},
    "rad/s2": {"rad": 1, "s": -2},
    "m/s2": {"m": 1, "s": -2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "kg0.5.m": {},
    "kg0.5.m/s": {},
    "kg0.5.m/s2": {},
}
"""Exponents of SI base units. Those of modal coordinates of unit mass are not whole, which FMI has no way to say."""

RATE = "rate of "


@dataclass(frozen=True)
class Variable:
    """A name of the linear model, its unit (of `UNITS`) and a few words."""

    name: str
    unit: str
    description: str


def joint_units(scene: Mapping[str, Any]) -> dict[str, str]:
    """Unit of each coordinate of the joints of a scene, by "NAME", or "NAME 1", "NAME 2" of joints with several."""
    units = dict[str, str]()
    for joint in scene.get("joint", ()):
        record = JOINT_TYPES[joint["type"]]  # types that the plane has too have the same units there
        of_joint = record.units or record.guess_units
        units |= {_numbered(joint["name"], k, len(of_joint)): unit for k, unit in enumerate(of_joint, 1)}
    return units


def linear_variables(
    model: StateSpace, units: Mapping[str, str]
) -> tuple[tuple[Variable, ...], tuple[Variable, ...], tuple[Variable, ...]]:
    """States, inputs and outputs; `units` of the joints' coordinates, see `joint_units`.

    FMI wants names once: a motor is "joint/NAME/moment", as in results, since "joint/NAME" is an output, "state "
    stands before a state whose name an output has, too, and "measured " before patches that are sensors.
    """
    seen, driven = model.output_names, model.input_names
    if model.step:  # a controller reads, and commands
        seen, driven = driven, seen
    readings = tuple(
        Variable(f"measured {name}" if name.startswith("pzt/") else name, *_coordinate(name, units)) for name in seen
    )
    acting, states = tuple(_input(name, units) for name in driven), []
    for name in model.state_names:
        unit, description = _coordinate(name.removeprefix(RATE), units)
        if name.startswith(RATE):
            unit, description = f"{unit}/s", f"rate of the {description}"
        states.append(Variable(f"state {name}" if name in model.output_names else name, unit, description))
    return (tuple(states), readings, acting) if model.step else (tuple(states), acting, readings)


def _input(name: str, units: Mapping[str, str]) -> Variable:
    kind, _, rest = name.partition("/")
    if kind == "joint":
        return motor(rest, units[rest])
    place, _, last = rest.rpartition("/")
    if kind == "pzt":
        return voltage(place, int(last))
    return Variable(name, "N", f"force on {place} along {last}")


def motor(name: str, unit: str) -> Variable:
    """Return the input variable of the motor of a joint coordinate with this unit ("rad" or "m")."""
    what, of_force = ("force", "N") if unit == "m" else ("moment", "N.m")
    return Variable(f"joint/{name}/moment", of_force, f"{what} of the motor of {name}")


def voltage(layout: str, number: int) -> Variable:
    """Return the input variable of patch `number` of a layout, V."""
    return Variable(f"pzt/{layout}/{number}", "V", f"voltage of patch {number} of {layout}")


def _coordinate(name: str, units: Mapping[str, str]) -> tuple[str, str]:
    stem, _, measure = name.rpartition("/")
    if measure in ORDERS and "/" in stem:  # of a sensor
        unit, what = _coordinate(stem, units)
        of = {"rate": f"{unit}/s", "gyro": "rad/s"}.get(measure, f"{unit}/s2")
        return of, f"{measure} of the {what}"
    kind, _, rest = name.partition("/")
    place, _, last = rest.rpartition("/")
    if kind == "state":  # of a controller
        return "1", f"state {rest}"
    if kind == "strain":
        return "1", f"strain at {rest}"
    if kind == "pzt":
        return "V", f"voltage that patch {last} of {place} measures"
    if kind == "modal":
        return "kg0.5.m", f"modal coordinate {last} of {place}"
    if kind == "point":
        return "m", f"place of {place} along {last}"
    if kind == "frame" and place:  # in the plane
        return "rad" if last == "angle" else "m", f"{last} of the frame of {place}"
    if kind == "frame":  # in space
        body, _, number = rest.rpartition(" ")
        return FreeJoint.guess_units[int(number) - 1], f"coordinate {number} of the frame of {body}"
    of = "coordinate of the motor of" if kind == "motor" else "coordinate of joint"
    return units[rest], f"{of} {rest}"


COMPONENTS = ("xx", "yy", "zz", "yz", "xz", "xy")  # the last three are 2 ε, as in modal body files
AXES = "xyz"

Input = tuple[Variable, Array]
"""A variable, and what a unit of it does along v (n_v,)."""


@dataclass(frozen=True)
class ForwardUnit:
    """Inputs and outputs, and the `data` of the model.

    The library numbers inputs, then outputs; `references` are the numbers of those that the FMU has.
    """

    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    references: tuple[int, ...]
    data: _core.ForwardModel


def forward_unit(
    model: Model, voltages: Iterable[Input], links: Mapping[str, ModalBody], analysis: Forward, axes: str = AXES
) -> ForwardUnit:
    """The motion of `analysis` from its initial state under moments of motors and `voltages` of patches.

    `links` are the modal bodies of flexible bodies, whose strains are outputs where their files have some; places of
    points are outputs along `axes`.

    Raises `InputError` and `SolveError` as the analysis itself does.
    """
    data, start = MultibodySystem(model).forward_model(), initial_state(model, undeformed_posture(model))
    data.q, data.v = start.q, start.v
    data.method = METHODS[integrator_of(model, analysis.integrator)]
    data.spectral_radius, data.tolerance = analysis.spectral_radius, analysis.tolerance
    data.duration = analysis.last_time
    inputs = [*_motors(model), *voltages]
    linear = [*_joints(model), *_modes(model), *_strains(model, links)]
    places = list(_places(model))
    data.inputs = [direction for _, direction in inputs]
    data.linear, data.places = [output for _, output in linear], [output for _, output in places]
    outputs = [(variable, True) for variable, _ in linear]
    outputs += [
        (Variable(f"point/{point}/{axis}", "m", f"place of {point} along {axis}"), axis in axes)
        for point, _ in places
        for axis in AXES
    ]
    references = [*range(len(inputs)), *(k for k, (_, is_one) in enumerate(outputs, len(inputs)) if is_one)]
    chosen = tuple(variable for variable, is_one in outputs if is_one)
    return ForwardUnit(tuple(each for each, _ in inputs), chosen, tuple(references), data)


def _numbered(joint: str, number: int, count: int) -> str:
    return f"{joint} {number}" if count > 1 else joint


def _motors(model: Model) -> Iterator[Input]:
    """Behind a compliant gear they act on its motor."""
    units = {joint.name: joint.units for joint in model.scene.joint}
    for joint, columns in model.motors.items():
        for k, (column, unit) in enumerate(zip(columns, units[joint], strict=True), 1):
            variable = motor(_numbered(joint, k, len(columns)), unit)
            yield variable, model.sign(joint) * np.eye(model.tree.n_v)[column]


def voltages_of_patches(model: Model, patches: Mapping[str, LinkPatches]) -> Iterator[Input]:
    """Yield the inputs of all patches that voltages drive: variable, and direction (n_v,) of a unit voltage."""
    for of_link in patches.values():
        directions = model.modal_directions(of_link.per_volt)
        for layout, array in of_link.arrays.items():
            rows = directions[of_link.columns(layout)] if array.layout.is_driven else ()
            yield from ((voltage(layout, k), row) for k, row in enumerate(rows, 1))


def _joints(model: Model) -> Iterator[tuple[Variable, _core.LinearOutput]]:
    """Coordinates and rates of joints that the state has as they are, and of motors before compliant gears."""
    tree = model.tree
    for joint in model.scene.joint:
        node = tree.nodes[tree.carried[joint.name]] if joint.name in tree.carried else None
        if node is None or not has_own_coordinates(node):
            continue
        columns, sign = model.columns(joint.name), node.sign
        for k, (column, unit) in enumerate(zip(columns, joint.units, strict=True), 1):
            name, entry = _numbered(joint.name, k, len(columns)), node.q.start + int(column) - node.v.start
            entries = (entry, tree.n_q + int(column))
            yield from _with_rate(f"joint/{name}", f"joint {name}", unit, entries, sign)
    for gear in tree.gears:
        name, entries = gear.joint.joint.name, (gear.motor.q.start, tree.n_q + gear.motor.v.start)
        yield from _with_rate(f"motor/{name}", f"the motor of {name}", "rad", entries, 1.0)


def _with_rate(
    name: str, of: str, unit: str, entries: tuple[int, int], sign: float
) -> Iterator[tuple[Variable, _core.LinearOutput]]:
    yield Variable(name, unit, f"coordinate of {of}"), _core.LinearOutput([entries[0]], [sign])
    yield Variable(f"{name}/rate", f"{unit}/s", f"rate of {of}"), _core.LinearOutput([entries[1]], [sign])


def has_own_coordinates(node: Node) -> bool:
    """Whether the joint's coordinates are entries of q, but for a sign."""
    joint = node.joint
    return bool(joint.units) and joint.q_count == joint.freedoms and not (joint.type == "planar" and node.backwards)


def _modes(model: Model) -> Iterator[tuple[Variable, _core.LinearOutput]]:
    """Modal coordinates of the file of each body: of a planar scene those that move in its plane."""
    for node in model.tree.nodes:
        entries = list(range(node.p_q.start, node.p_q.stop))
        for k, row in enumerate(node.body.modal_transform, 1):
            if np.any(row):
                name = node.body.name
                variable = Variable(f"modal/{name}/{k}", "kg0.5.m", f"modal coordinate {k} of {name}")
                yield variable, _core.LinearOutput(entries, row.tolist())


def _strains(model: Model, links: Mapping[str, ModalBody]) -> Iterator[tuple[Variable, _core.LinearOutput]]:
    """At the points of links where their files have strains, in axes of the link: what the modes make of them."""
    for node in model.tree.nodes:
        name, entries = node.body.name, list(range(node.p_q.start, node.p_q.stop))
        if name not in links:
            continue
        for label, point in links[name].stress.items():
            for component, row in zip(COMPONENTS, point.strain @ node.body.modal_transform, strict=True):
                if np.any(row):
                    variable = Variable(
                        f"strain/{name}.{label}/{component}", "1", f"strain {component} at {label} of {name}"
                    )
                    yield variable, _core.LinearOutput(entries, row.tolist())


def _places(model: Model) -> Iterator[tuple[str, _core.PlaceOutput]]:
    for number, node in enumerate(model.tree.nodes):
        for label, at in node.body.points.items():
            K = [] if node.body.stiffening is None else list(node.body.stiffening.at(label)[:3])
            yield f"{node.body.name}.{label}", _core.PlaceOutput(number, at.position, at.translation, K)
