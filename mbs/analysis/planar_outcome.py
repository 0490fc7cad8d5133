"""What an analysis in the plane computed, in absolute coordinates: (R, θ, p) of each body side by side."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ...common.arrays import Array
from .. import _core
from ..model.planar_tree import PlanarTree
from ..model.raised_mass import coordinate_factors, modal_factors
from ..model.system import MechanismSystem
from .outcome import AnyOutcome, GearMotion


@dataclass(frozen=True, kw_only=True)
class PlanarOutcome(AnyOutcome):
    """What an analysis computed; `gears` by joint, of inverse analyses with elastic gears.

    Where links were divided, it is told of the one link; `in_pieces` is what was computed, and `point_names` say which
    point of which piece a point of the link is there. `look_closer` finds the same, as computed, with times between.
    `integrated` is what was integrated, and what `continuation` is of, where that is not `assembly`: see `raised_mass`.
    """

    assembly: MechanismSystem
    gears: Mapping[str, GearMotion] = field(default_factory=dict)
    integrated: MechanismSystem | None = field(default=None, repr=False)
    in_pieces: PlanarOutcome | None = field(default=None, repr=False)
    look_closer: Callable[[], PlanarOutcome] | None = field(default=None, repr=False)
    point_names: Mapping[str, str] = field(default_factory=dict, repr=False)

    @property
    def path(self) -> Path:
        """Of the scene."""
        return self.assembly.model.scene.path

    @property
    def computed(self) -> PlanarOutcome:
        """The outcome as computed: that of the pieces where links were divided, else itself."""
        return self.in_pieces or self

    @property
    def closer(self) -> PlanarOutcome:
        """The outcome as computed, at its outputs and between: see `samples`. Itself where nothing is between."""
        found = self.computed
        return found if found.look_closer is None else found.look_closer()

    @property
    def lambda_(self) -> Array:
        """(T, constraints) multipliers."""
        return self.motion.multipliers

    @property
    def residual(self) -> Array:
        """(T, 3) of C, Ċ, C̈, relative to their terms."""
        assert self.motion.residual is not None
        return self.motion.residual

    @property
    def tau(self) -> Array | None:
        """(T, motors) N·m (N for prismatic joints)."""
        return self.forces.tau

    @property
    def F_p(self) -> Array | None:
        """(T, modes of all bodies) N/√kg."""
        return self.forces.F_p

    def recorded_actuation(self) -> _core.ActuationSource | None:
        """Of the steps that were recorded."""
        if self.continuation is None or self.continuation.recording is None:
            return None
        assembly = self.integrated or self.assembly
        motors = () if self.tau is None else assembly.model.motors.values()
        return _core.TreeActuation(PlanarTree(assembly, motors).both, self.continuation.recording)

    def coordinates(self, body: str) -> slice:
        """Columns of (R, θ, p) of a body in q, v and a."""
        i = self.assembly.index[body]
        first = int(self.assembly.first[i])
        return slice(first, first + 3 + self.assembly.model.bodies[i].n_modes)

    def modal_columns(self, *bodies: str) -> slice:
        """Columns of a body in `F_p`, or of several that follow each other."""
        first, last = (self.assembly.index[name] for name in (bodies[0], bodies[-1]))
        begin, end = (int(self.assembly.first[i]) - 3 * i for i in (first, last))
        return slice(begin, end + self.assembly.model.bodies[last].n_modes)

    @property
    def motor_moments(self) -> Array | None:
        """`tau`, but of elastic gears what their motors must do: (T, motors) N·m."""
        if self.tau is None or not self.gears:
            return self.tau
        motors = enumerate(self.assembly.model.motors)
        columns = [self.gears[joint].moment if joint in self.gears else self.tau[:, k] for k, joint in motors]
        return np.column_stack(columns)

    def in_coordinates_of(self, reported: MechanismSystem) -> PlanarOutcome:
        """A motion with raised masses as one of `reported`, the same mechanism without."""
        if all(a is b for a, b in zip(self.assembly.model.bodies, reported.model.bodies, strict=True)):
            return self
        factors, motion, F_p = coordinate_factors(reported.model), self.motion, self.F_p
        return replace(
            self,
            assembly=reported,
            motion=replace(motion, q=motion.q / factors, v=motion.v / factors, a=motion.a / factors),
            forces=replace(self.forces, F_p=None if F_p is None else F_p * modal_factors(reported.model)),
            integrated=self.assembly,
        )
