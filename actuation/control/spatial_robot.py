"""What controllers ask of a robot in space."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from ...common.arrays import Array, as_floats
from ...mbs.analysis.outcome import Outcome
from ...mbs.model.spatial_model import SpatialModel
from ...mbs.solve.linearisation import LinearMechanism
from ...mbs.solve.spatial_linearisation import SpatialLinearisation, labelled
from ..patches.spatial_patches import LinkPatches
from ..patches.voltages import voltage_gain
from .robot import LinkModes, PatchedLink
from .spatial_linear import patch_voltages_in_space
from .spatial_rigid_arm import SpatialRigidArm, rigid_freedom
from .spatial_signals import check_joint, volts_on_file


@dataclass(frozen=True)
class SpatialRobot:
    """See `Robot`; `model` has rows of loops alone and gears that do not give, `source` is the inverse analysis."""

    model: SpatialModel
    of_links: Mapping[str, LinkPatches]
    source: Outcome

    @property
    def path(self) -> Path:
        """Of the scene."""
        return self.model.scene.path

    @property
    def motor_joints(self) -> tuple[str, ...]:
        """In the order of commands."""
        return tuple(self.model.motors)

    @property
    def motors(self) -> tuple[str, ...]:
        """By coordinate."""
        return tuple(name for joint in self.model.motors for name in self.coordinates(joint))

    def coordinates(self, joint: str) -> tuple[str, ...]:
        """Its name, or "NAME 1", "NAME 2" where there are several."""
        check_joint(self.model, joint)
        return tuple(name.removeprefix("joint/") for name, _ in labelled(self.model, joint))

    @property
    def motors_fit(self) -> bool:
        """With rigid links."""
        return len(self.motors) == rigid_freedom(self.model, self.source.q[0])

    @cached_property
    def links(self) -> Mapping[str, LinkModes]:
        """Bodies with modes."""
        bodies = [node.body for node in self.model.tree.nodes if node.body.n_modes]
        return {body.name: LinkModes(body.mass, body.length or 1.0, body.stiffness) for body in bodies}

    @cached_property
    def patches(self) -> Mapping[str, PatchedLink]:
        """Of the modes that the layouts of each link reach together."""
        return {name: self._patched(name, of_link) for name, of_link in self.of_links.items()}

    def _patched(self, name: str, of_link: LinkPatches) -> PatchedLink:
        reached, to_file = of_link.reached, self.model.tree.nodes[self.model.tree.index[name]].body.modal_transform
        inputs = [f"pzt/{layout}/{k}" for layout, of in of_link.arrays.items() for k in range(1, len(of.edges) + 1)]
        volts = np.vstack([volts_on_file(of_link, layout)[name] for layout in of_link.arrays])
        own = as_floats(np.linalg.solve(reached.T, to_file[reached.rows]))
        return PatchedLink(
            tuple(inputs), tuple(of_link.arrays), np.sqrt(reached.stiffness[: reached.served]),
            voltage_gain(of_link.reach), reached.seen(volts), own,
        )  # fmt: skip

    def linear(self, row: int) -> tuple[LinearMechanism, Mapping[str, Array]]:
        """About one output of the motion."""
        source = self.source
        linearisation = SpatialLinearisation(self.model, source.q[row])
        found = linearisation.at(float(source.time[row]), source.q[row], source.v[row], source.a[row])
        return found, patch_voltages_in_space(self.model, found, self.of_links)

    def rigid(self) -> SpatialRigidArm:
        """With rigid links."""
        return SpatialRigidArm(self.model, self.source.q[0])
