"""Linear models about an equilibrium or a motion: the analysis `kind = "linear"`."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import combinations, groupby
from typing import Literal

from ...common.structs import struct
from ...mbs.analysis.operating_points import InstantAnalysis, find_operating_points, places_of
from ...mbs.fields.field_types import PointReference, Reference, under
from ...mbs.linear.joint_conditions import JointCondition, RobotModes, joint_conditions
from ...mbs.linear.linearisation import LinearEquations, LinearMechanism
from ...mbs.model.model import Model
from ...mbs.run.record import Details, Run
from ..context import ActuatedContext
from ..patches.link_patches import LinkPatches
from .linear_model import LinearModel, robot_modes, state_space
from .margins import Suggestion, unhurried_gains
from .reachability import Reachability, controllability, observability
from .records import Sensor
from .signals import make_signals, readings_at
from .zeros import Zeros, zeros

MOST_WORK = 2e8  # pairs whose zeros are computed, times cubed coordinates: some seconds


@struct
class LinearModels(Details):
    """Linear models at the times of an analysis, with modes, controllability, observability and zeros at each time.

    `controllable`: by motors and patches together; `observable`: by joints and points together; `zeros` by
    (inputs, outputs): from each motor to its own joint and to each coordinate of a point, from all motors to their
    joints (the frequencies with locked joints), and to as many coordinates of a point. `suggested`: gains of joint PD
    controllers for all models and the longest sample time (s) for them. `conditions`: modes and compliance with joints
    "locked", and with motors locked behind "compliant" gears.
    """

    models: tuple[LinearModel, ...]
    modes: tuple[RobotModes, ...]
    controllable: tuple[Reachability, ...]
    observable: tuple[Reachability, ...]
    zeros: Mapping[tuple[str, ...], tuple[Zeros, ...]]
    suggested: tuple[Suggestion, float] | None
    conditions: tuple[Mapping[str, JointCondition], ...]

    @property
    def times(self) -> tuple[float, ...]:
        """Times of the models, s."""
        return tuple(model.time for model in self.models)

    @property
    def advice(self) -> str:
        """Text with first gains for the motors; empty where none are known."""
        if self.suggested is None:
            return ""
        gains, sample_time = self.suggested
        return f"joint PID to start with: {gains.in_words()}, sampled every {1e3 * sample_time:g} ms or faster"


def _pairs(model: LinearModel) -> list[tuple[str, ...]]:
    """(inputs …, outputs …), as many of each; where all would take minutes, without those to other outputs."""
    motors = model.motors
    places = [name for name in model.output_names if name.startswith("point/") and name.count("/") == 2]  # no sensors
    own = [(motor, motor) for motor in motors]
    single = [(motor, output) for motor in motors for output in (motor, *places)]
    single = next((pairs for pairs in (single, own) if len(pairs) * model.freedom**3 <= MOST_WORK), [])
    if len(motors) < 2:
        return [*single]
    together = [(*motors, *motors)]
    for _, of_point in groupby(places, key=lambda place: place.rpartition("/")[0]):
        together += [(*motors, *chosen) for chosen in combinations(of_point, len(motors))]
    return [*single, *together]


class Linear(InstantAnalysis):
    """The robot as x' = A x + B u, y = C x + D u: `about` the static equilibrium, or an earlier analysis at `times`.

    `points` are outputs and disturbance inputs of the model, readings of `sensor` outputs.
    """

    kind: Literal["linear"]
    points: tuple[PointReference, ...] | None = None
    """Points whose motion is an output and at which disturbances act; by default those of trajectories, or all tips."""
    sensor: tuple[Sensor, ...] = ()
    """Sensors whose readings are outputs, too: exact and continuous, without noise, filters, delay and limits."""

    refers_to = (("points", "body"),)

    def references(self) -> Iterator[Reference]:
        """Yield references to points and to what `sensor` measures."""
        yield from super().references()
        for k, sensor in enumerate(self.sensor, 1):
            yield from under(f"sensor no. {k}", sensor.references())

    def run(self, context: ActuatedContext) -> Run:
        """The operating points, with details `LinearModels`. Raises `SolveError` in singular postures."""
        run, about = find_operating_points(context, self)
        free = about.model
        linearization = LinearEquations(free, about.q[0], places_of(context, self.points))
        states = zip(about.time, about.q, about.v, about.a, strict=True)
        mechanisms = [
            with_voltages(free, linearization.at(float(t), q, v, a), context.patches) for t, q, v, a in states
        ]
        signals = make_signals(free, context, self.sensor, context.whole)
        models = tuple(state_space(one, readings_at(free, one, signals)) for one in mechanisms)
        acting = [name for name in models[0].input_names if not name.startswith("force/")]
        seen = [name for name in models[0].output_names if not name.startswith("modal/")]
        details = LinearModels(
            models=models,
            modes=tuple(robot_modes(model) for model in models),
            controllable=tuple(controllability(model, acting) for model in models),
            observable=tuple(observability(model, seen) for model in models),
            zeros={
                pair: tuple(zeros(model, pair[: len(pair) // 2], pair[len(pair) // 2 :]) for model in models)
                for pair in _pairs(models[0])
            },
            suggested=unhurried_gains(models),
            conditions=tuple(map(joint_conditions, mechanisms)),
        )
        return replace(run, details=details)


def with_voltages(model: Model, mechanism: LinearMechanism, patches: Mapping[str, LinkPatches]) -> LinearMechanism:
    """The mechanism with inputs "pzt/LAYOUT/k" after its motors: generalized forces of 1 V."""
    found = {name: column for name, column in mechanism.inputs.items() if name.startswith("joint/")}
    for of_link in patches.values():
        along_s = model.modal_directions(of_link.per_volt) @ mechanism.transformation
        for layout in of_link.arrays:
            found |= {f"pzt/{layout}/{k}": row for k, row in enumerate(along_s[of_link.columns(layout)], 1)}
    return replace(mechanism, inputs={**found, **mechanism.inputs})
