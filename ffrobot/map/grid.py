"""The grid of a map: `NAME=FIRST:LAST:COUNT` or `NAME=VALUE,VALUE` from the command line, made axes of a robot."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from pydantic import TypeAdapter, ValidationError

from ..common.arrays import Array
from ..common.errors import InputError, did_you_mean, quoted
from ..common.numbers import MOST_RUNS
from ..common.tables import shown
from ..mbs.fields.field_types import Quantity
from ..mbs.scene.space import SPACES
from ..mbs.solve.workspace import GridAxis
from ..scene.scene import Scene

MOST_AXES = 3
_number = TypeAdapter(Quantity)


def parse_grid(texts: Sequence[str], scene: Scene) -> tuple[GridAxis, ...]:
    """The axes of a grid over the joints of `scene`, or over x, y, z of a point.

    Raises `InputError` where a text is no axis, and for joints and places that are mixed, unknown, or too many.
    """
    axes = tuple(_axis(text, scene) for text in texts)
    names = [axis.name for axis in axes]
    if twice := {name for name in names if names.count(name) > 1}:
        raise InputError(f"--over: expected each joint or direction once, found {quoted(sorted(twice))} again")
    if len({axis.is_place for axis in axes}) > 1:
        raise InputError(f"--over: expected joints alone or directions of a point alone, found {quoted(names)}")
    if not 1 <= len(axes) <= MOST_AXES:
        raise InputError(f"--over: expected one to {MOST_AXES} axes, found {len(axes)}")
    if (count := math.prod(len(axis.values) for axis in axes)) > MOST_RUNS:
        raise InputError(f"--over: expected at most {MOST_RUNS} poses, found {count}")
    return axes


def _axis(text: str, scene: Scene) -> GridAxis:
    name, equals, values = (part.strip() for part in text.partition("="))
    places = ["xyz"[k] for k in SPACES[scene.space].translations]
    units = {joint.name: joint.units[0] for joint in scene.joint if joint.units}
    joints = list(units)
    if not equals or name not in (*joints, *places):
        raise InputError(
            f"--over: expected NAME=FIRST:LAST:COUNT of a joint ({quoted(joints)}) or of {quoted(places)}, found"
            f' "{shown(text)}"{did_you_mean(name, joints)}'
        )
    return GridAxis(name, _values(values, text), name not in joints, units.get(name, "m"))


def _values(text: str, whole: str) -> Array:
    pieces = text.split(":")
    try:
        if len(pieces) == 3:
            count = int(pieces[2])
            if not 1 <= count <= MOST_RUNS:
                raise ValueError
            return np.linspace(_number.validate_python(pieces[0]), _number.validate_python(pieces[1]), count)
        if len(pieces) == 1:
            return np.array([_number.validate_python(each) for each in text.split(",")])
    except (ValueError, ValidationError):
        pass
    raise InputError(
        f"--over: expected NAME=FIRST:LAST:COUNT or NAME=VALUE,VALUE, such as shoulder=-90*deg:90*deg:31, found"
        f' "{shown(whole)}"'
    )
