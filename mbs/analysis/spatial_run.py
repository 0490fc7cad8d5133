"""What an analysis of a scene in space starts from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ...common.arrays import Array
from ..model.spatial_model import SpatialModel
from .drive import Progress
from .outcome import EarlierRun, Outcome

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


@dataclass(frozen=True)
class SpatialContext:
    """What the run of an analysis in space starts from.

    Attributes:
        model: the robot, with the rows of all joints that close loops and of all trajectories.
        runs: of the analyses before, by name.
        progress: see `drive.Progress`.
        supply: what patches do.
        at_points: what driving forces are at the actuation points.
        earlier: a run of this analysis to go on with; None from the start.
    """

    model: SpatialModel
    runs: Mapping[str, Outcome]
    progress: Progress
    supply: Supply = no_patches
    at_points: ForcesAtPoints = no_points
    earlier: EarlierRun | None = None
