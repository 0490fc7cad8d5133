"""Keys of the mechanism in a scene: bodies, joints, trajectories, loads, and the initial state."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import Field, PrivateAttr

from ...common.deferred import Table
from ...common.keys import Title
from ...common.validation import Record
from .._core import TimeFunction
from ..fields.field_types import GROUND, NotEmpty, Quantity, Reference, Referring, under
from ..fields.spelling import IN_PLANE, Vector
from ..joints.joint import JointRecord
from ..joints.joints import AnyJoint
from .bodies import BodyKeys, Payload, Tool
from .loads import Load
from .topology import Edge, Topology, spanning_forest
from .trajectories import Trajectory

Word = Literal["up", "down", "right", "left", "noflip", "flip", "positive", "negative"]
"""How a joint stands in one of several postures: see `posture.branches`."""

Numbers = Quantity | tuple[Quantity, ...]


class Initial(Referring):
    """State at t = 0; values of bodies and joints are guesses that the constraints correct.

    Where kinematic loops alone constrain, joints with values keep them if the other joints can close the loops.
    A joint with values behind a compliant gear keeps them, too, where its motor follows a trajectory: the gear starts
    twisted. Without values, or with state = "static", it starts as the gear lets it.
    In planar scenes with `joints` or `joint_rates`, a frame without an own angle or rate follows the coordinate of its
    inboard joint (default 0); without them, its angle and rate are 0.
    """

    state: Literal["undeformed", "static"] = "undeformed"
    """State of the links: undeformed, or static equilibrium under gravity and loads."""
    angles: Annotated[dict[str, Quantity], IN_PLANE] = Field(default_factory=dict)
    """Guess of each body frame's absolute angle, against the global x axis, rad (or such as "60*deg")."""
    rates: Annotated[dict[str, Quantity], IN_PLANE] = Field(default_factory=dict)
    """Guess of their rates, rad/s."""
    joints: dict[str, Numbers] = Field(default_factory=dict)
    """Guess of each joint's coordinates, rad or m (or such as "60*deg"); lists for several; default 0; in planar
    scenes instead of angles of bodies. Spherical joints: a rotation vector; free ones: position and rotation vector, in
    the axes of the first side."""
    joint_rates: dict[str, Numbers] = Field(default_factory=dict)
    """Their rates, rad/s or m/s; spherical and free joints: angular velocity in the axes of the second side, after
    the velocity in those of the first."""

    branch: dict[str, Word] = Field(default_factory=dict)
    """Which of several postures that meet the constraints at t = 0, by joint. Elbow: "up" or "down", its joint is above
    or below the straight line between the joints (or the tool) next to it. Shoulder: "right" or "left", a positive turn
    raises or lowers the end of the arm along the axis of the joint before. Wrist: "noflip" or "flip", a
    positive or negative turn leads the axis of the joint before to that of the joint after. Any joint: "positive" or
    "negative", the sign of the coordinate within ±180°. Of those the nearest to the guess."""

    refers_to = (
        ("angles", "body"),
        ("rates", "body"),
        ("joints", "joint"),
        ("joint_rates", "joint"),
        ("branch", "joint"),
    )
    _named: dict[str, frozenset[str]] = PrivateAttr(default_factory=dict)

    def named(self, table: Literal["joints", "joint_rates"]) -> frozenset[str]:
        """Names of joints with values in the file: their own, or those of both bodies that they connect."""
        return self._named.get(table, frozenset(getattr(self, table)))

    def naming(self, **named: frozenset[str]) -> Self:
        """A copy that counts only joints `named`, by table, as given in the file, though others have values."""
        copy = self.model_copy()
        copy._named = named
        return copy


class MechanismKeys(Record):
    """The keys of a scene that concern the mechanism; lists of tables keep the singular name of the file."""

    name: Title
    """Name of the scene."""
    space: Literal["planar", "spatial"] = "planar"
    """Dimension of the motion."""
    gravity: Vector
    """Acceleration of gravity, m/s², global axes."""
    motors: Literal["section", "frame"] = "section"
    """Reference of motors and, in planar scenes, joint coordinates: sections at the joint, or frames of the bodies."""
    geometric_stiffening: bool | Literal["auto"] | None = None
    """Stiffness of links depends on their loads; "auto": if these change it by more than 1 %. Default: on for
    subdivided links only, except links with loads between the ends of a segment."""
    redundancy: Literal["least-torque", "least-motion"] | None = None
    """Redundancy resolution with undeformed links: "least-torque" minimizes the integral of squared motor torques from
    the state at t = 0, "least-motion" the sum of squared joint velocities at every time (translations relative to the
    robot's size). Default: the redundant motion is unactuated."""
    body: Annotated[tuple[BodyKeys, ...], NotEmpty]
    """Links and rigid bodies."""
    tool: tuple[Tool, ...] = ()
    """Frames of tools, fixed to points of bodies."""
    joint: tuple[AnyJoint, ...] = ()
    """Joints between bodies, or to the ground; bodies without a joint are free."""
    trajectory: tuple[Table[Trajectory], ...] = ()
    """Prescribed motions."""
    load: tuple[Table[Load], ...] = ()
    """Prescribed forces, torques and voltages."""
    payload: tuple[Table[Payload], ...] = ()
    """Masses on points."""
    initial: Table[Initial] = Initial.model_construct()
    """Initial state."""

    @property
    def is_planar(self) -> bool:
        """Whether the mechanism is projected on the plane z = 0, by declaration."""
        return self.space == "planar"

    @property
    def load_functions(self) -> tuple[TimeFunction, ...]:
        """The components of all loads over time."""
        return tuple(size for load in self.load for size in load.components.values())

    @property
    def edges(self) -> list[Edge]:
        """All joints as edges between bodies, ranked by where loops are cut.

        Loops are cut first at spherical joints, those without a value in [initial] before others. Then come joints
        without forces, with friction or loads, with a value, with a rate, and last with a rotor or a trajectory. Motors
        without rotors, and joints whose coordinates analyses read, belong to the tree.
        """
        return [Edge(joint.between, self._rank(joint)) for joint in self.joint]

    def _rank(self, joint: AnyJoint) -> int:
        values, rates = self.initial.named("joints"), self.initial.named("joint_rates")
        if not joint.locates:
            return 6 + (joint.name not in values | rates)
        if joint.loop_equations is None or joint.asks_for_coordinate:
            return 0
        if getattr(joint, "rotor_inertia", 0.0):
            return 1
        if joint.name in self.read_joints:
            return 0
        if any(trajectory.coordinate_of == joint.name for trajectory in self.trajectory):
            return 1
        if joint.name in rates:
            return 2
        if joint.name in values:
            return 3
        return 4 if joint.frictions or any(load.joint == joint.name for load in self.load) else 5

    @property
    def read_joints(self) -> frozenset[str]:
        """Names of joints whose coordinates analyses read."""
        return frozenset()

    @property
    def topology(self) -> Topology:
        """Joint that carries each body, and joints that close loops, by indices of `joint`."""
        return spanning_forest([body.name for body in self.body], self.edges)

    @property
    def motor_joints(self) -> tuple[AnyJoint, ...]:
        """Joints with motors: by default all that move in open chains, and none in kinematic loops."""
        default = self.topology.is_open_chain
        return tuple(joint for joint in self.joint if joint.has_motor(default))

    @property
    def tool_point(self) -> str | None:
        """Point of the last path of a point, else of the last tool; None without either."""
        points = [*(tool.reference for tool in self.tool), *self.path_points]
        return points[-1] if points else None

    @property
    def path_points(self) -> list[str]:
        """Points that follow paths, one for each path of a point."""
        return [path.point for path in self.trajectory if path.point is not None]

    def references(self) -> Iterator[Reference]:
        """Yield all references of the scene's records, with their full keys."""
        for joint in self.joint:
            yield from under(joint.label, joint.references())
        for tool in self.tool:
            yield from under(f'tool "{tool.name}"', tool.references())
        for path in self.trajectory:
            yield from under(f'trajectory "{path.name}"', path.references())
        for table in ("load", "payload"):
            for k, record in enumerate(getattr(self, table), 1):
                yield from under(f"{table} no. {k}", record.references())
        yield from (replace(reference, key=f"initial.{reference.key}") for reference in self.initial.references())


class MechanismScene(MechanismKeys):
    """A validated scene, with the absolute `path` of its file and the raw `text` that results files carry."""

    path: Path
    text: str


S = TypeVar("S", bound=MechanismKeys)
Values = Mapping[str, float]


def in_3d(scene: S) -> S:
    """A planar scene with initial guesses of joints in place of those of bodies; spatial scenes unchanged.

    The guess of a revolute joint is the angle of its second body on the first, in rad; welds and prismatic joints keep
    that angle. Likewise for rates. A body that no joint carries has guesses of a planar joint of its name.
    """
    if scene.space != "planar":
        return scene
    initial = scene.initial
    angles = _of_bodies(scene, initial.angles, initial.joints)
    rates = _of_bodies(scene, initial.rates, initial.joint_rates)
    turning = [joint for joint in scene.joint if joint.type == "revolute"]
    floating = [body for body, carrier in scene.topology.carriers.items() if carrier is None]

    def guesses(of_bodies: Values) -> dict[str, Any]:
        return {joint.name: _turn(of_bodies, joint) for joint in turning} | {
            body: (0.0, 0.0, of_bodies.get(body, 0.0)) for body in floating
        }

    start = {
        "joints": guesses(angles) | initial.joints,
        "joint_rates": guesses(rates) | initial.joint_rates,
        "angles": {},
        "rates": {},
    }

    def named(of_joints: Mapping[str, Any], of_bodies: Values) -> frozenset[str]:
        between = (joint.name for joint in turning if {*joint.bodies} <= {GROUND, *of_bodies})
        return frozenset({*of_joints, *between})

    kept = initial.naming(
        joints=named(initial.joints, initial.angles), joint_rates=named(initial.joint_rates, initial.rates)
    )
    joints = tuple(
        joint if joint.type == "revolute" else joint.model_copy(update={"rpy": (0.0, 0.0, _turn(angles, joint))})
        for joint in scene.joint
    )
    return scene.model_copy(update={"joint": joints, "initial": kept.model_copy(update=start)})


def _turn(of_bodies: Values, joint: JointRecord) -> float:
    """Second body against the first, by absolute angles or rates."""
    first, second = (0.0 if body == GROUND else of_bodies.get(body, 0.0) for body in joint.bodies)
    return second - first


def _of_bodies(scene: MechanismKeys, given: Values, of_joints: Mapping[str, Any]) -> dict[str, float]:
    """Angles or rates by body: where not given, that of the body that carries it and what the joint between adds.

    All others are 0 where joints have no guesses, too. Trees avoid prismatic joints, then those without a guess.
    """
    angles = dict(given)
    if not of_joints:
        return angles
    edges = [
        Edge(joint.between, 2 * (joint.type == "prismatic") + (joint.name not in of_joints)) for joint in scene.joint
    ]
    for body, carrier in spanning_forest([body.name for body in scene.body], edges).carriers.items():
        if carrier is not None and body not in angles:
            joint = scene.joint[carrier.joint]
            turn = of_joints.get(joint.name, 0.0) if joint.type == "revolute" else 0.0
            angles[body] = angles.get(carrier.parent, 0.0) + (turn if joint.between[1] == carrier.own else -turn)
    return angles
