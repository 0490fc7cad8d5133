"""What controllers ask of a robot in the plane."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from ...common.arrays import Array
from ...mbs.analysis.planar_outcome import PlanarOutcome
from ...mbs.model.model import Model
from ...mbs.solve.linearisation import LinearMechanism, linearise
from ..patches.patches import PatchArray
from ..patches.voltages import voltage_gain
from .linear_model import patch_voltages
from .rigid_arm import RigidArm
from .robot import LinkModes, PatchedLink
from .signals import volts_per_modal_coordinate


@dataclass(frozen=True)
class PlanarRobot:
    """See `Robot`; `arrays` are the patches by link, `source` the motion of the inverse analysis."""

    model: Model
    arrays: Mapping[str, PatchArray]
    source: PlanarOutcome

    @property
    def path(self) -> Path:
        """Of the scene."""
        return self.model.scene.path

    @property
    def motor_joints(self) -> tuple[str, ...]:
        """In the order of commands."""
        return tuple(self.model.motors)

    motors = motor_joints

    @property
    def motors_fit(self) -> bool:
        """With rigid links."""
        return len(self.model.motors) == self.model.degrees_of_freedom

    def coordinates(self, joint: str) -> tuple[str, ...]:
        """Its only one."""
        return (joint,)

    @cached_property
    def links(self) -> Mapping[str, LinkModes]:
        """Bodies with modes."""
        return {
            body.name: LinkModes(body.mass, body.length or 1.0, body.stiffness)
            for body in self.model.bodies
            if body.n_modes
        }

    @cached_property
    def patches(self) -> Mapping[str, PatchedLink]:
        """Of the eigenmodes of each link: attachment modes are not served."""
        return {name: self._patched(name, array) for name, array in self.arrays.items()}

    def _patched(self, name: str, array: PatchArray) -> PatchedLink:
        body = self.model.body(name)
        inputs = tuple(f"pzt/{name}/{k}" for k in range(1, len(array.edges) + 1))
        omega = np.sqrt(body.stiffness[: body.n_eigenmodes])
        return PatchedLink(
            inputs, (name,), omega, voltage_gain(array), volts_per_modal_coordinate(array), np.eye(body.n_modes)
        )

    def linear(self, row: int) -> tuple[LinearMechanism, Mapping[str, Array]]:
        """About one output of the motion."""
        source = self.source
        found = linearise(self.model, float(source.time[row]), source.q[row], source.v[row], source.a[row])
        return found, patch_voltages(found, self.arrays)

    def rigid(self) -> RigidArm:
        """With rigid links."""
        return RigidArm(self.model, self.source)
