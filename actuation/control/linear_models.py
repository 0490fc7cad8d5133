"""What is worth telling of linear models: modes, reach, zeros and gains for their motors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from ...mbs.analysis.outcome import Details
from ...mbs.solve.joint_conditions import JointCondition, RobotModes
from .linear_model import LinearModel
from .modes import Reach, Zeros, controllability, observability, robot_modes, zeros
from .suggestion import Suggestion, unhurried_gains


@dataclass(frozen=True)
class LinearModels(Details):
    """Linear models at the times of an analysis, with their modes, reach and zeros, one of each per time.

    `controllable`: by motors and patches together; `observable`: by joints and points together; `zeros` by
    (inputs, outputs): from each motor to its own joint and to each coordinate of a point, from all motors to their
    joints (the frequencies with locked joints), and to as many coordinates of a point. `suggested`: gains of joint PD
    controllers and the longest sample time (s) for them, of all models. `conditions`: see `joint_conditions`.
    """

    models: tuple[LinearModel, ...]
    modes: tuple[RobotModes, ...]
    controllable: tuple[Reach, ...]
    observable: tuple[Reach, ...]
    zeros: Mapping[tuple[str, ...], tuple[Zeros, ...]]
    suggested: tuple[Suggestion, float] | None = None
    conditions: tuple[Mapping[str, JointCondition], ...] = ()

    @property
    def times(self) -> tuple[float, ...]:
        """Of the models, s."""
        return tuple(model.time for model in self.models)

    @property
    def advice(self) -> str:
        """Gains for the motors to start with, in words; empty where none are known."""
        if self.suggested is None:
            return ""
        gains, sample_time = self.suggested
        return f"joint PID to start with: {gains.in_words()}, sampled every {1e3 * sample_time:g} ms or faster"


def analyse(models: tuple[LinearModel, ...]) -> LinearModels:
    """Modes, reach and zeros of the models."""
    first = models[0]
    acting = [name for name in first.input_names if not name.startswith("force/")]
    seen = [name for name in first.output_names if not name.startswith("modal/")]
    return LinearModels(
        models,
        tuple(robot_modes(model) for model in models),
        tuple(controllability(model, acting) for model in models),
        tuple(observability(model, seen) for model in models),
        {pair: tuple(zeros(model, *_split(pair)) for model in models) for pair in _pairs(first)},
        unhurried_gains(models),
    )


def _pairs(model: LinearModel) -> list[tuple[str, ...]]:
    """(inputs …, outputs …), as many of each."""
    motors = [name for name in model.input_names if name.startswith("joint/")]
    places = [name for name in model.output_names if name.startswith("point/")]
    single = [(motor, output) for motor in motors for output in (motor, *places)]
    together = [(*motors, *motors)] if len(motors) > 1 else []
    if len(motors) > 1:
        for of_point in _by_point(places).values():
            together += [(*motors, *chosen) for chosen in combinations(of_point, len(motors))]
    return [*single, *together]


def _by_point(places: Sequence[str]) -> dict[str, list[str]]:
    """The coordinates "point/BODY.POINT/x" of each point."""
    found: dict[str, list[str]] = {}
    for place in places:
        found.setdefault(place.rpartition("/")[0], []).append(place)
    return found


def _split(pair: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    half = len(pair) // 2
    return pair[:half], pair[half:]
