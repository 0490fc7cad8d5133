"""Variables of a linear model as an FMU has them: names, units, what they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...actuation.control.linear_model import LinearModel
from ...mbs.joints.free import FreeJoint
from ...mbs.joints.joints import JOINT_TYPES

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
    found = {}
    for joint in scene.get("joint", ()):
        record = JOINT_TYPES[joint["type"]]  # types that the plane has too have the same units there
        units = record.units or record.guess_units
        for number, unit in enumerate(units, 1):
            found[f"{joint['name']} {number}" if len(units) > 1 else str(joint["name"])] = unit
    return found


def inputs_of(model: LinearModel, units: Mapping[str, str]) -> tuple[Variable, ...]:
    """Motors, voltages, forces at points; `units` of the joints' coordinates, see `joint_units`.

    A motor is "joint/NAME/moment" here, as in results, since "joint/NAME" is an output; FMI wants names once.
    """
    return tuple(_input(name, units) for name in model.input_names)


def outputs_of(model: LinearModel, units: Mapping[str, str]) -> tuple[Variable, ...]:
    """Joint coordinates, places of points, modal coordinates."""
    return tuple(Variable(name, *_coordinate(name, units)) for name in model.output_names)


def states_of(model: LinearModel, units: Mapping[str, str]) -> tuple[Variable, ...]:
    """Independent coordinates and their rates; "state " before a name which an output has too."""
    taken = set(model.output_names)
    found = []
    for name in model.state_names:
        unit, description = _coordinate(name.removeprefix(RATE), units)
        if name.startswith(RATE):
            unit, description = f"{unit}/s", f"rate of the {description}"
        found.append(Variable(f"state {name}" if name in taken else name, unit, description))
    return tuple(found)


def derivatives_of(states: tuple[Variable, ...]) -> tuple[Variable, ...]:
    """Of each state."""
    return tuple(
        Variable(f"der({each.name})", f"{each.unit}2" if each.unit.endswith("/s") else f"{each.unit}/s", "")
        for each in states
    )


def _input(name: str, units: Mapping[str, str]) -> Variable:
    kind, _, rest = name.partition("/")
    if kind == "joint":
        slides = units[rest] == "m"
        words = f"{'force' if slides else 'moment'} of the motor of {rest}"
        return Variable(f"{name}/moment", "N" if slides else "N.m", words)
    if kind == "pzt":
        layout, _, number = rest.rpartition("/")
        return Variable(name, "V", f"voltage of patch {number} of {layout}")
    point, _, axis = rest.rpartition("/")
    return Variable(name, "N", f"force on {point} along {axis}")


def _coordinate(name: str, units: Mapping[str, str]) -> tuple[str, str]:
    """Unit and description of a coordinate of the robot."""
    kind, _, rest = name.partition("/")
    place, _, last = rest.rpartition("/")
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
