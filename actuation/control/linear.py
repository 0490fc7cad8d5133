"""Linear models about an equilibrium or a motion: the analysis `kind = "linear"`, and what is worth telling of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Literal

from ...mbs.analysis.operating_points import InstantAnalysis, operating_points
from ...mbs.analysis.outcome import Details
from ...mbs.analysis.planar_outcome import PlanarOutcome
from ...mbs.fields.field_types import PointReference
from ...mbs.fields.references import Reference
from ...mbs.model.model import Model
from ...mbs.solve.linearisation import Linearisation
from ..context import ActuatedContext, place_of
from ..patches.patches import PatchArray
from .linear_model import LinearModel, linear_model
from .modes import Reach, RobotModes, controllability, observability, robot_modes
from .suggestion import Suggestion, unhurried_gains
from .zeros import Zeros, zeros


class Linear(InstantAnalysis):
    """The robot as x' = A x + B u, y = C x + D u: `about` the static equilibrium, or an earlier analysis at `times`.

    `points` are outputs and disturbance inputs of the model.
    """

    kind: Literal["linear"]
    points: tuple[PointReference, ...] | None = None
    """Points whose motion is an output and at which disturbances act; by default those of trajectories, or all tips."""

    needs_actuators = True

    def references(self) -> Iterator[Reference]:
        """The points."""
        for point in self.points or ():
            yield Reference("points", point, needs_marker=True)

    def run(self, context: ActuatedContext) -> PlanarOutcome:
        """The operating points, with `LinearModels` about them."""
        outcome = operating_points(context.model, self, context.source(self.source))
        whole = context.whole
        points = self.points or default_points(context.model if whole is None else whole.model)
        places = {point: place_of(whole, point) for point in points}
        return replace(outcome, details=analyse(linear_models(outcome, context.patches, places)))


@dataclass(frozen=True)
class LinearModels(Details):
    """Linear models at the times of an analysis, with their modes, reach and zeros, one of each per time.

    `controllable`: by motors and patches together; `observable`: by joints and points together; `zeros` by
    (inputs, outputs): from each motor to its own joint and to each coordinate of a point, from all motors to their
    joints (the frequencies with held joints), and to as many coordinates of a point. `suggested`: gains of joint PD
    controllers and the longest sample time (s) for them, of all models.
    """

    models: tuple[LinearModel, ...]
    modes: tuple[RobotModes, ...]
    controllable: tuple[Reach, ...]
    observable: tuple[Reach, ...]
    zeros: Mapping[tuple[str, ...], tuple[Zeros, ...]]
    suggested: tuple[Suggestion, float] | None = None

    @property
    def advice(self) -> str:
        """Gains for the motors to start with, in words; empty where none are known."""
        if self.suggested is None:
            return ""
        gains, sample_time = self.suggested
        return f"joint PID to start with: {gains.in_words()}, sampled every {1e3 * sample_time:g} ms or faster"


def linear_models(
    outcome: PlanarOutcome, patches: Mapping[str, PatchArray], points: Sequence[str] | Mapping[str, str] | None = None
) -> tuple[LinearModel, ...]:
    """The linear models about the rows of `outcome`, which know of the `points`, or of those of trajectories.

    `points` are as `Linearisation` takes them.
    """
    model = outcome.assembly.model
    linearisation = Linearisation(model, outcome.q[0], points or default_points(model))
    rows = zip(outcome.time, outcome.q, outcome.v, outcome.a, strict=True)
    return tuple(linear_model(linearisation.at(float(t), q, v, a), patches) for t, q, v, a in rows)


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


def default_points(model: Model) -> tuple[str, ...]:
    """The points of trajectories; where there are none, the tips of all bodies that have one."""
    points = [trajectory.point for trajectory in model.scene.trajectory if trajectory.point is not None]
    tips = [f"{body.name}.tip" for body in model.bodies if "tip" in body.points]
    return tuple(dict.fromkeys(points or tips))


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
