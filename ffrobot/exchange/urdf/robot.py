"""What a URDF says of a robot (wiki.ros.org/urdf/XML), as read: nothing merged, nothing left out. SI units."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import chain, count
from typing import Literal

import numpy as np

from ...common.arrays import Array, as_floats
from ...common.keys import LONGEST_NAME
from ...common.rotations import of_rpy, point_inertia
from ...mbs.model.body import Body

Numbers3 = tuple[float, float, float]


def three(values: Iterable[float]) -> Numbers3:
    """Three numbers of Python's own."""
    x, y, z = map(float, values)
    return x, y, z


TYPES = ("revolute", "continuous", "prismatic", "planar", "floating", "fixed")
"""Types of joints that URDF has."""


@dataclass(frozen=True)
class Origin:
    """Pose of a frame in another: `xyz` (m), and `rpy` (rad) about the fixed axes x, y, z in this order."""

    xyz: Numbers3 = (0.0, 0.0, 0.0)
    rpy: Numbers3 = (0.0, 0.0, 0.0)

    @property
    def place(self) -> Place:
        """The pose with its rotation matrix."""
        return Place(np.array(self.xyz), of_rpy(*self.rpy))


@dataclass(frozen=True, eq=False)
class Place:
    """A frame in another: its origin d (3,) in m and its axes C (3, 3), columns, both in axes of the other."""

    d: Array
    C: Array

    def __matmul__(self, inner: Place) -> Place:
        """A frame in this one, in coordinates of the other."""
        return Place(self.d + self.C @ inner.d, self.C @ inner.C)


HERE = Place(np.zeros(3), np.eye(3))


@dataclass(frozen=True, eq=False)
class Inertial:
    """Mass (kg), center (3,) in m and inertia about it (3, 3) in kg·m², in axes of the link."""

    mass: float
    center: Array
    inertia: Array

    def seen_from(self, place: Place) -> Inertial:
        """Return mass properties in the frame in which the link's frame has the pose `place`."""
        return Inertial(self.mass, place.d + place.C @ self.center, place.C @ self.inertia @ place.C.T)

    def __add__(self, other: Inertial) -> Inertial:
        """Both together (parallel axes)."""
        mass = self.mass + other.mass
        if mass == 0.0:
            return Inertial(0.0, self.center, self.inertia + other.inertia)
        center = as_floats((self.mass * self.center + other.mass * other.center) / mass)
        inertia = self.inertia + other.inertia
        for part in (self, other):
            inertia = inertia + point_inertia(part.mass, part.center - center)
        return Inertial(mass, center, inertia)


MASSLESS = Inertial(0.0, np.zeros(3), np.zeros((3, 3)))


def inertial_of(body: Body, anchor: Array) -> Inertial:
    """Return mass properties of the undeformed body with attached masses, in the link's frame at `anchor` (3,), m.

    J_c = J0 − m (c·c I − c cᵀ) about the center c = s0/m (parallel axes).
    """
    center = body.first_moment / body.mass
    J: Array = body.inertia - point_inertia(body.mass, center)
    return Inertial(body.mass, center - anchor, (J + J.T) / 2)


@dataclass(frozen=True)
class MeshFile:
    """A mesh that a link shows: its file as the URDF names it, factors along its axes, place in the link."""

    filename: str
    scale: Numbers3
    origin: Origin


Shape = Literal["box", "cylinder", "capsule", "sphere"]


@dataclass(frozen=True)
class Primitive:
    """A shape about its center: a box of `size` x, y, z; a cylinder along z (radius, length); a sphere (radius,). m.

    A capsule (radius, length) is a cylinder with half a sphere on either end.
    """

    shape: Shape
    size: tuple[float, ...]
    origin: Origin


@dataclass(frozen=True, eq=False)
class UrdfLink:
    """A link: its mass and inertia (None: the URDF has none), and its shapes, to be seen and for collisions."""

    name: str
    inertial: Inertial | None
    visual: tuple[MeshFile | Primitive, ...] = ()
    collision: tuple[MeshFile | Primitive, ...] = ()


@dataclass(frozen=True)
class Mimic:
    """The coordinate is `multiplier` times that of the joint, plus `offset`."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True)
class UrdfJoint:
    """Joint of a URDF; `origin`: pose of the child's frame in the parent's at coordinate zero.

    `axis` is in axes of the child. `limits` are those attributes of <limit> that are there (lower, upper, effort,
    velocity), `dynamics` those of <dynamics> (damping, friction).
    """

    name: str
    type: str
    parent: str
    child: str
    origin: Origin = Origin()
    axis: Numbers3 = (1.0, 0.0, 0.0)
    limits: Mapping[str, float] = field(default_factory=dict)
    dynamics: Mapping[str, float] = field(default_factory=dict)
    mimic: Mimic | None = None


@dataclass(frozen=True)
class Robot:
    """Links and joints by name, in the order of the file; `root` is the link that no joint carries.

    `remarks` are on what is odd in the file, and on what is not read of it.
    """

    name: str
    links: Mapping[str, UrdfLink]
    joints: Mapping[str, UrdfJoint]
    root: str
    remarks: tuple[str, ...] = ()

    def joints_of(self, link: str) -> list[UrdfJoint]:
        """Return joints whose parent is this link."""
        return [joint for joint in self.joints.values() if joint.parent == link]


FORBIDDEN = str.maketrans({"/": "_", ".": "_"})


class Names:
    """Unique names in one list: the same for the same original, valid by `common.keys.check_name`."""

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._taken = set(taken)
        self._of = dict[str, str]()

    def __getitem__(self, original: str) -> str:
        if original not in self._of:
            name = "".join(c if c.isprintable() else "_" for c in original.translate(FORBIDDEN)).strip() or "_"
            name = name[: LONGEST_NAME - 4] if len(name) > LONGEST_NAME else name
            candidates = chain([name], (f"{name}_{number}" for number in count(2)))
            self._of[original] = next(candidate for candidate in candidates if candidate not in self._taken)
            self._taken.add(self._of[original])
        return self._of[original]

    @property
    def changed(self) -> dict[str, str]:
        """The new name of each original that could not stay."""
        return {original: name for original, name in self._of.items() if original != name}
