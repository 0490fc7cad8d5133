"""Keys of planar records as those of records in space, one function for each kind of record.

`given` are the keys that a scene gives, of a record or of a table of its file; what it leaves out is left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ....common.validation import Record

Keys = dict[str, Any]
Given = Mapping[str, Any]

NORMAL = (0.0, 0.0, 1.0)
"""Axis about which all joints turn; angles are counter-clockwise in the plane."""

ACROSS = 0.6  # moments of inertia about x and y over that about z: a body of no other shape than one in space may have


def given_keys(record: Record) -> Keys:
    """Those that the scene gives of a record."""
    return {key: getattr(record, key) for key in record.model_fields_set}


def place(x_y: Sequence[float]) -> tuple[float, float, float]:
    """Of the plane, (x, y) in m, in space."""
    x, y = x_y
    return x, y, 0.0


def inertia(J: float) -> tuple[float, float, float]:
    """Moments about x, y, z (kg·m²) of a body with J about z; the others are of no account in the plane."""
    return ACROSS * J, ACROSS * J, J


def rigid_keys(given: Given) -> Keys:
    """Of a rigid body."""
    points = {name: place(at) for name, at in given.get("points", {}).items()}
    return {
        "mass": given["mass"], "center": place(given["center"]), "inertia": inertia(given["inertia"]), "points": points
    }  # fmt: skip


def payload_keys(given: Given) -> Keys:
    """Of a mass on a point: its moment of inertia is about that point, where its center is."""
    turned = {"inertia": inertia(given["inertia"])} if "inertia" in given else {}
    return {**given, **turned}


def joint_keys(given: Given, turn: float = 0.0) -> Keys:
    """Of a joint; `turn` (rad) is how the second side stands on the first where a joint keeps that.

    A revolute joint has its angle as coordinate: 0 where both sides have the same axes, in the plane and in space.
    """
    found = {key: value for key, value in given.items() if (given["type"], key) != ("weld", "motor")}
    if "at" in given:
        found["at"] = place(given["at"])
    if given["type"] == "revolute":
        found["axis"] = NORMAL
    if given["type"] == "prismatic":
        found["axis"] = place(given["axis"])
    if given["type"] != "revolute" and turn:
        found["rpy"] = (0.0, 0.0, turn)
    return found


def load_keys(given: Given) -> Keys:
    """Of a load: the moment on a point is about z, that of a joint along its coordinate."""
    found = dict(given)
    if "point" in given and "moment" in given:
        found["mz"] = found.pop("moment")
    return found
