"""What controllers ask of a robot, in the plane or in space: names, links, patches, linear and rigid models."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from ...common.arrays import Array, as_floats
from ...mbs.solve.linearisation import LinearMechanism


@dataclass(frozen=True)
class LinkModes:
    """A flexible link: `mass` (kg), `length` (m), and the `stiffness` ω² (n,) (rad²/s²) of its modal coordinates p."""

    mass: float
    length: float
    stiffness: Array


@dataclass(frozen=True)
class PatchedLink:
    """The k patches of one link, and the m coordinates of it that they are to serve, the lowest first.

    Attributes:
        inputs: names of their voltages, which are those of their readings.
        layouts: names that sensors know them by.
        omega: (m,) rad/s of these coordinates.
        gain: (k, m) volts per force on each of these coordinates.
        volts: (k, m) that the patches read per unit of each.
        own: (m, n) these coordinates from all modal coordinates p of the link.
    """

    inputs: tuple[str, ...]
    layouts: tuple[str, ...]
    omega: Array
    gain: Array
    volts: Array
    own: Array


class RigidMotion(Protocol):
    """The mechanism with rigid links, rotors and friction too: what motors do for accelerations of their joints."""

    def angles(self) -> Array:
        """(motors,) at the start of the reference."""

    def terms(self, gamma: Array, gamma_dot: Array) -> tuple[Array, Array]:
        """M (motors, motors) and h (motors,) of τ = M γ̈ + h."""

    def moments(self, gamma: Array, gamma_dot: Array, gamma_ddot: Array) -> Array:
        """τ (motors,) N·m."""


class Robot(Protocol):
    """A robot about the motion of an inverse analysis.

    Attributes:
        path: of the scene.
        motor_joints: names of the joints with motors.
        motors: of the motors' coordinates, "NAME", or "NAME 1", "NAME 2" of joints with several.
        links: flexible ones by name.
        patches: by link.
        motors_fit: whether there are as many motors as the mechanism with rigid links has freedom.
    """

    @property
    def path(self) -> Path:
        """See above."""

    @property
    def motor_joints(self) -> tuple[str, ...]:
        """See above."""

    @property
    def motors(self) -> tuple[str, ...]:
        """See above."""

    @property
    def links(self) -> Mapping[str, LinkModes]:
        """See above."""

    @property
    def patches(self) -> Mapping[str, PatchedLink]:
        """See above."""

    @property
    def motors_fit(self) -> bool:
        """See above."""

    def coordinates(self, joint: str) -> tuple[str, ...]:
        """Names of the coordinates of a joint."""

    def linear(self, row: int) -> tuple[LinearMechanism, Mapping[str, Array]]:
        """About output `row` of the motion, and what a unit of each voltage does along its s."""

    def rigid(self) -> RigidMotion:
        """With rigid links. Raises `InputError` where the motors do not fit the mechanism."""


def input_names(robot: Robot) -> tuple[str, ...]:
    """Names of all commands: motor moments "joint/NAME", then voltages "pzt/LAYOUT/k"."""
    voltages = [name for link in robot.patches.values() for name in link.inputs]
    return tuple([f"joint/{name}" for name in robot.motors] + voltages)


def estimate(volts: Array, count: int) -> Array:
    """(count, k) of coordinates from what patches read of them, volts (k, m): as many as patches are told apart."""
    return as_floats(np.linalg.pinv(volts[:, : min(volts.shape)])[:count])
