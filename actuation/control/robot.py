"""What controllers ask of a robot: names, links, patches, linear and rigid models."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from ...common.arrays import Array, as_floats
from ...mbs.analysis.outcome import Outcome
from ...mbs.model.model import Model
from ...mbs.solve.linearisation import LinearEquations, LinearMechanism, labelled
from ..patches.link_patches import LinkPatches
from ..patches.voltages import voltage_gain
from .linear import voltages_at
from .rigid_arm import RigidArm, rigid_freedom
from .signals import check_joint, volts_on_file


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


@dataclass(frozen=True)
class Robot:
    """A robot about the motion of an inverse analysis.

    Attributes:
        model: its constraint equations are those of loops alone, its gears do not give.
        of_links: patches by link.
        source: the inverse analysis.
    """

    model: Model
    of_links: Mapping[str, LinkPatches]
    source: Outcome

    @property
    def path(self) -> Path:
        """Of the scene."""
        return self.model.scene.path

    @property
    def motor_joints(self) -> tuple[str, ...]:
        """Names of joints with motors, in the order of commands."""
        return tuple(self.model.motors)

    @property
    def motors(self) -> tuple[str, ...]:
        """Names of the coordinates of motors: "NAME", or "NAME 1", "NAME 2" of joints with several."""
        return tuple(name for joint in self.model.motors for name in self.coordinates(joint))

    def coordinates(self, joint: str) -> tuple[str, ...]:
        """Of a joint: its name, or "NAME 1", "NAME 2" where there are several."""
        check_joint(self.model, joint)
        return tuple(name.removeprefix("joint/") for name, _ in labelled(self.model, joint))

    @property
    def motors_fit(self) -> bool:
        """Whether there are as many motors as the mechanism with rigid links has freedom."""
        return len(self.motors) == rigid_freedom(self.model, self.source.q[0])

    @cached_property
    def links(self) -> Mapping[str, LinkModes]:
        """Flexible ones by name."""
        bodies = [node.body for node in self.model.tree.nodes if node.body.n_modes]
        return {body.name: LinkModes(body.mass, body.length or 1.0, body.stiffness) for body in bodies}

    @cached_property
    def patches(self) -> Mapping[str, PatchedLink]:
        """By link, with the modes that its layouts reach together."""
        return {name: self._patched(name, of_link) for name, of_link in self.of_links.items()}

    def _patched(self, name: str, of_link: LinkPatches) -> PatchedLink:
        reached, to_file = of_link.reached, self.model.tree.nodes[self.model.tree.index[name]].body.modal_transform
        inputs = [f"pzt/{layout}/{k}" for layout, of in of_link.arrays.items() for k in range(1, len(of.edges) + 1)]
        volts = np.vstack([volts_on_file(of_link, layout)[name] for layout in of_link.arrays])
        own = reached.coordinates(to_file.T).T
        return PatchedLink(
            tuple(inputs), tuple(of_link.arrays), np.sqrt(reached.stiffness[: reached.served]),
            voltage_gain(of_link.reach), reached.seen(volts), own,
        )  # fmt: skip

    def linear(self, row: int) -> tuple[LinearMechanism, Mapping[str, Array]]:
        """About output `row` of the motion, and what a unit of each voltage does along its s."""
        source = self.source
        linearisation = LinearEquations(self.model, source.q[row])
        found = linearisation.at(float(source.time[row]), source.q[row], source.v[row], source.a[row])
        return found, voltages_at(self.model, found, self.of_links)

    def rigid(self) -> RigidArm:
        """With rigid links. Raises `InputError` where the motors do not fit the mechanism."""
        return RigidArm(self.model, self.source.q[0])


def input_names(robot: Robot) -> tuple[str, ...]:
    """Names of all commands: motor moments "joint/NAME", then voltages "pzt/LAYOUT/k"."""
    voltages = [name for link in robot.patches.values() for name in link.inputs]
    return tuple([f"joint/{name}" for name in robot.motors] + voltages)


def estimate(volts: Array, count: int) -> Array:
    """(count, k) of coordinates from what patches read of them, volts (k, m): as many as patches distinguish."""
    return as_floats(np.linalg.pinv(volts[:, : min(volts.shape)])[:count])
