"""Variables of a linear model as an FMU has them: names, units, what they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ...actuation.control.linear_model import LinearModel

UNITS: Mapping[str, Mapping[str, int]] = {
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


def inputs_of(model: LinearModel, on_ways: frozenset[str]) -> tuple[Variable, ...]:
    """Motors, voltages, forces at points; `on_ways` are the joints that slide.

    A motor is "joint/NAME/moment" here, as in results, since "joint/NAME" is an output; FMI wants names once.
    """
    return tuple(_input(name, on_ways) for name in model.input_names)


def outputs_of(model: LinearModel, on_ways: frozenset[str]) -> tuple[Variable, ...]:
    """Joint coordinates, places of points, modal coordinates."""
    return tuple(Variable(name, *_coordinate(name, on_ways)) for name in model.output_names)


def states_of(model: LinearModel, on_ways: frozenset[str]) -> tuple[Variable, ...]:
    """Independent coordinates and their rates; "state " before a name which an output has too."""
    taken = set(model.output_names)
    found = []
    for name in model.state_names:
        unit, description = _coordinate(name.removeprefix(RATE), on_ways)
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


def _input(name: str, on_ways: frozenset[str]) -> Variable:
    kind, _, rest = name.partition("/")
    if kind == "joint":
        slides = rest in on_ways
        words = f"{'force' if slides else 'moment'} of the motor of {rest}"
        return Variable(f"{name}/moment", "N" if slides else "N.m", words)
    if kind == "pzt":
        layout, _, number = rest.rpartition("/")
        return Variable(name, "V", f"voltage of patch {number} of {layout}")
    point, _, axis = rest.rpartition("/")
    return Variable(name, "N", f"force on {point} along {axis}")


def _coordinate(name: str, on_ways: frozenset[str]) -> tuple[str, str]:
    """Unit and description of a coordinate of the robot."""
    kind, _, rest = name.partition("/")
    place, _, last = rest.rpartition("/")
    if kind == "modal":
        return "kg0.5.m", f"modal coordinate {last} of {place}"
    if kind == "point":
        return "m", f"place of {place} along {last}"
    if kind == "frame":
        return (
            ("rad", f"angle of the frame of {place}") if last == "angle" else ("m", f"{last} of the frame of {place}")
        )
    of = "coordinate of the motor of" if kind == "motor" else "coordinate of joint"
    return "m" if rest in on_ways else "rad", f"{of} {rest}"
