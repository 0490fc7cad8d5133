"""Planar robots written in Python, of bodies of their own."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ffrobot.mbs.analysis.forward import Forward
from ffrobot.mbs.analysis.pcid import Pcid
from ffrobot.mbs.model.build import build_model
from ffrobot.mbs.model.model import Model
from ffrobot.mbs.model.projection import projected
from ffrobot.scene.load import make_scene

PLACEHOLDER = {"mass": 1.0, "inertia": 1.0, "center": (0.0, 0.0)}  # the bodies themselves are passed beside the scene


@dataclass(frozen=True)
class Robot:
    """A scene with `Body`s of its own, and its model."""

    scene: object
    bodies: tuple
    tables: dict  # keys of the scene

    def body(self, name):
        return next(body for body in self.bodies if body.name == name)

    @cached_property
    def model(self) -> Model:
        return build_model(self.scene, self.bodies)


def make_model(bodies, **keys):
    """A robot of `bodies`; `keys` are those of a scene file."""
    tables = {"name": "test", "gravity": (0.0, -9.81), "analysis": [{"name": "rest", "kind": "static"}]} | keys
    tables["body"] = [
        {"name": body.name, "rigid": PLACEHOLDER | {"points": {name: (0.0, 0.0) for name in body.points}}}
        for body in bodies
    ]
    return Robot(make_scene(**tables), tuple(map(projected, bodies)), tables)


def pcid(name="inverse", end=1.0, output_step=0.01, **keys):
    return Pcid(name=name, kind="pcid", end=end, output_step=output_step, **keys)


def forward(name="forward", end=1.0, output_step=0.01, **keys):
    return Forward(name=name, kind="forward", end=end, output_step=output_step, **keys)


def revolute(name, first, second, **keys):
    return {"name": name, "type": "revolute", "between": (first, second), **keys}


def always(_):
    """The progress of runs that nobody watches."""
    return True


def relative(got, expected, scale=None):
    """Largest difference relative to the largest expected value."""
    return np.abs(got - expected).max() / (np.abs(expected).max() if scale is None else scale)
