"""From a scene and its bodies to the measures, motors and loads that all analyses share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.validation import did_you_mean, quoted
from .. import _core
from .._core import StateFunction, TimeFunction
from ..joints.measure import Marker, Measure, marker_at
from ..joints.transmission import ElasticGear, Friction
from ..scene.loads import Load
from ..scene.mechanism import MechanismScene
from .planar_body import PlanarBody
from .transmissions import joint_frictions, joint_rotors

ZERO = _core.TimeFunction.constant(0.0)


@dataclass(frozen=True)
class Constraint:
    """A measure that is held at `target`(t): `component` of the joint or trajectory `owner`."""

    measure: Measure
    target: TimeFunction
    owner: str
    component: str
    is_trajectory: bool


@dataclass(frozen=True)
class ModalLoad:
    """Modal forces `vector` (n,), N/√kg, times `magnitude`(t) on one body, in the coordinates of its `PlanarBody`."""

    body: str
    vector: Array
    magnitude: TimeFunction


@dataclass(frozen=True)
class Model:
    """A scene with its bodies: everything analyses share."""

    scene: MechanismScene
    bodies: tuple[PlanarBody, ...]
    modal_loads: tuple[ModalLoad, ...]
    joints: tuple[Constraint, ...]
    trajectories: tuple[Constraint, ...]
    motors: dict[str, Measure]
    loads: tuple[tuple[Measure, TimeFunction], ...]
    rotors: tuple[tuple[Measure, float], ...] = ()
    frictions: tuple[tuple[Measure, Friction], ...] = ()
    state_forces: tuple[tuple[Marker, StateFunction], ...] = ()
    gears: tuple[ElasticGear, ...] = ()  # empty where gears are taken for rigid (see `analysis.elastic_joints`)

    def body(self, name: str) -> PlanarBody:
        """The body of that name."""
        return next(body for body in self.bodies if body.name == name)

    @property
    def links(self) -> tuple[PlanarBody, ...]:
        """The bodies of the scene, without rotors."""
        return self.bodies[: len(self.bodies) - len(self.gears)]

    @property
    def degrees_of_freedom(self) -> int:
        """Degrees of freedom with rigid links and gears, counted: coordinates less joint constraints."""
        return 3 * len(self.bodies) - len(self.joints) - len(self.gears)


def build_model(scene: MechanismScene, bodies: Sequence[PlanarBody], modal_loads: Sequence[ModalLoad] = ()) -> Model:
    """Check every reference of the scene to points of its bodies and lay out measures.

    Raises `InputError` when a point does not exist, or named motors do not fit the mechanism.
    """
    _check_points(scene, {body.name: body for body in bodies})
    joints = tuple(
        Constraint(measure, ZERO, joint.name, measure.label.rpartition(", ")[2], is_trajectory=False)
        for joint in scene.joint
        for measure in scene.constraints(joint)
    )
    trajectories = tuple(
        Constraint(measure, trajectory.components[component], trajectory.name, component, is_trajectory=True)
        for trajectory in scene.trajectory
        for component, measure in trajectory.measures(scene.coordinate).items()
    )
    motors = {joint.name: scene.coordinate(joint.name) for joint in scene.motor_joints}
    model = Model(
        scene, tuple(bodies), tuple(modal_loads), joints, trajectories, motors,
        tuple(load_measures(scene, scene.load)), tuple(joint_rotors(scene)), tuple(joint_frictions(scene)),
        tuple(_state_forces(scene)),
    )  # fmt: skip
    named = any(joint.asks_for_motor for joint in scene.joint)
    if named and trajectories and len(motors) != model.degrees_of_freedom:
        raise InputError(
            f"{scene.path}: joint: expected as many motors as the mechanism has degrees of freedom"
            f" ({model.degrees_of_freedom}), found {len(motors)} ({quoted(motors)})"
        )
    return model


def load_measures(scene: MechanismScene, loads: Sequence[Load]) -> Iterator[tuple[Measure, TimeFunction]]:
    """Along what given loads act, and their magnitudes (N or N·m) over time."""
    for load in loads:
        yield from load.measures(scene.coordinate)


def _state_forces(scene: MechanismScene) -> Iterator[tuple[Marker, StateFunction]]:
    for load in scene.load:
        if load.point is not None and load.force is not None:
            yield marker_at(load.point), load.force


def _check_points(scene: MechanismScene, bodies: dict[str, PlanarBody]) -> None:
    """Raise `InputError` for a reference to a point that its body has not, and that the equations need."""
    for reference in scene.references():
        if not reference.needs_marker or reference.body_and_point is None:
            continue
        body, point = reference.body_and_point
        known = bodies[body].points
        if point not in known:
            raise InputError(
                f'{scene.path}: {reference.key}: expected a point of "{body}" ({quoted(known)}), found'
                f' "{reference.name}"{did_you_mean(point, known)}'
            )
        stiffening = bodies[body].stiffening
        if stiffening is not None and point not in stiffening.K_points:
            raise InputError(
                f"{scene.path}: {reference.key}: expected, with geometric_stiffening, a point whose loads' geometric"
                f" stiffness is in the modal body file ({quoted(stiffening.K_points)}), found"
                f' "{reference.name}"'
            )
