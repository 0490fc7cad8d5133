"""What an analysis may use when it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ...common.arrays import Array
from ..model.model import Model
from ..model.spatial_model import SpatialModel
from .drive import Progress
from .outcome import EarlierRun, Outcome
from .planar_outcome import PlanarOutcome
from .replay import ActuatorSet

ModalForces = Mapping[str, Array]
"""By body, (T, n) on the modes of its file."""

Supply = Callable[[ModalForces, bool], ModalForces]
"""What patches do of modal forces, within their limits or not; bodies without patches are left out."""


def no_patches(wanted: ModalForces, limited: bool) -> ModalForces:
    """Nothing."""
    return {}


ForcesAtPoints = Callable[[Outcome], Mapping[str, Array]]
"""By "BODY.POINT" what a run's driving forces are there: (T, 3) N, global axes."""


def no_points(run: Outcome) -> Mapping[str, Array]:
    """None."""
    return {}


@dataclass(frozen=True, kw_only=True)
class _Start:
    """What the run of an analysis starts from, in the plane and in 3D.

    Attributes:
        progress: see `drive.Progress`.
        is_replayed: whether a later analysis takes its actuation.
        earlier: an earlier run of the same analysis, to go on with; None from the start.
    """

    progress: Progress
    is_replayed: bool = False
    earlier: EarlierRun | None = None


@dataclass(frozen=True, kw_only=True)
class Context(_Start):
    """What the run of an analysis in 3D starts from.

    Attributes:
        model: the robot, with the constraint equations of all joints that close loops and of all trajectories.
        outcomes: of the analyses before, by name.
        supply: what patches do.
        at_points: what driving forces are at the actuation points.
    """

    model: SpatialModel
    outcomes: Mapping[str, Outcome]
    supply: Supply = no_patches
    at_points: ForcesAtPoints = no_points


@dataclass(frozen=True, kw_only=True)
class PlanarContext(_Start):
    """What the run of an analysis in the plane starts from.

    Attributes:
        model: the robot.
        outcomes: of the analyses before, by name.
        make_actuators: the actuators of the scene, fresh for one run, which has raised masses or not (`raised_mass`).
    """

    model: Model
    outcomes: Mapping[str, PlanarOutcome]
    make_actuators: Callable[[bool], ActuatorSet]

    def source(self, name: str | None) -> PlanarOutcome | None:
        """The outcome of an earlier analysis; None where there is no name."""
        return None if name is None else self.outcomes[name]


AnyContext = Context | PlanarContext
