"""What an inverse analysis found, carried out again: the actuators of a scene, and the forces at any time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ...common.arrays import Array
from .. import _core
from ..model.model import Model
from ..scene.analysis import TimedAnalysis, output_times
from .planar_outcome import PlanarOutcome


@dataclass(frozen=True)
class PointActuator:
    """Forces at points of one body: the name of the point of each component, and the equations L_a F_a = Q_a."""

    points: tuple[str, ...]
    equations: _core.ActuationPoints


@dataclass(frozen=True)
class ActuatorSet:
    """Actuators by the body they sit on; `patches` know no limits, `limited_patches` theirs."""

    patches: Mapping[str, _core.Allocation] = field(default_factory=dict)
    limited_patches: Mapping[str, _core.Allocation] = field(default_factory=dict)
    points: Mapping[str, PointActuator] = field(default_factory=dict)


def motor_limits(model: Model) -> Array:
    """Largest moment (N·m, or N) of each motor, infinite where the scene gives none."""
    joints = {joint.name: joint for joint in model.scene.joint}
    return np.array([joints[name].motor_limits.moment for name in model.motors])


def actuation_source(source: PlanarOutcome) -> _core.ActuationSource:
    """The findings of an inverse analysis at any time of it, not at its outputs alone."""
    found = source.details.actuation_source(source)
    assert found is not None  # analyses that are replayed are recorded, or algebraic
    return found


def replay_times(source: PlanarOutcome, analysis: TimedAnalysis) -> Array:
    """Output times (T,) of a run under the actuation of `source`, s.

    With its pre-actuation and, where the run goes to the end of the path, its post-actuation.
    """
    after = source.details.post_actuation if analysis.end == source.analysis.last_time else 0.0
    return output_times(analysis.end, analysis.output_step, source.details.pre_actuation, after)
