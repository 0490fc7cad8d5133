"""What an analysis may use when it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ..model.model import Model
from .drive import Progress
from .outcome import EarlierRun
from .planar_outcome import PlanarOutcome
from .replay import ActuatorSet


@dataclass(frozen=True)
class Context:
    """What the run of an analysis starts from.

    Attributes:
        model: the robot.
        outcomes: of the analyses before, by name.
        make_actuators: the actuators of the scene, fresh for one run, which has raised masses or not (`raised_mass`).
        progress: see `drive.Progress`.
        is_replayed: whether a later analysis takes its actuation.
        earlier: an earlier run of the same analysis, to go on with.
    """

    model: Model
    outcomes: Mapping[str, PlanarOutcome]
    make_actuators: Callable[[bool], ActuatorSet]
    progress: Progress
    is_replayed: bool = False
    earlier: EarlierRun | None = None

    def source(self, name: str | None) -> PlanarOutcome | None:
        """The outcome of an earlier analysis; None where there is no name."""
        return None if name is None else self.outcomes[name]
