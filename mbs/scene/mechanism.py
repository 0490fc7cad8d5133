"""What a scene says of a mechanism: bodies, joints, trajectories, loads, and the state it starts from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

from ...common.names import Title
from ...common.validation import Record
from ..fields.field_types import NotEmpty, Vector2
from ..fields.references import Reference, under
from ..joints.joints import Joint
from ..joints.measure import Measure
from .bodies import Body, Payload
from .initial import Initial
from .loads import Load
from .topology import Edge, Topology, spanning_forest
from .trajectories import Trajectory


class MechanismKeys(Record):
    """The keys of a scene file that concern the mechanism; lists of tables keep the singular name they have there.

    `geometric_stiffening` "auto" includes it if the loads of a run change the stiffness of a link by more than 1 %.
    """

    name: Title
    """Name of the scene."""
    space: Literal["planar", "spatial"] = "planar"
    """Dimension of the motion."""
    gravity: Vector2
    """Acceleration of gravity, m/s², global axes."""
    motors: Literal["section", "frame"] = "section"
    """Reference of motors and joint coordinates: sections at the joint, or frames of the bodies."""
    geometric_stiffening: bool | Literal["auto"] = False
    """Stiffness of links depends on their loads; "auto": if these change it by more than 1 %."""
    body: Annotated[tuple[Body, ...], NotEmpty]
    """Links and rigid bodies."""
    joint: tuple[Joint, ...] = ()
    """Joints between bodies, or to the ground."""
    trajectory: tuple[Trajectory, ...] = ()
    """Prescribed motions."""
    load: tuple[Load, ...] = ()
    """Prescribed forces, moments and voltages."""
    payload: tuple[Payload, ...] = ()
    """Masses on points."""
    initial: Initial = Initial()
    """Initial state."""

    @property
    def topology(self) -> Topology:
        """Which joint carries which body, by numbers of `joint`."""
        edges = [Edge(joint.between, int(not joint.locates)) for joint in self.joint]
        return spanning_forest([body.name for body in self.body], edges)

    @property
    def motor_joints(self) -> tuple[Joint, ...]:
        """Joints with a motor: by default all that move in an open chain, and none in a closed loop."""
        default = self.topology.is_open_chain
        return tuple(joint for joint in self.joint if joint.has_motor(default))

    def coordinate(self, joint: str) -> Measure:
        """The coordinate of a joint by its name, as `motors` defines it. Raises `KeyError` where it has none."""
        measures = {each.name: each.coordinate(self.motors) for each in self.joint}
        measure = measures[joint]
        if measure is None:
            raise KeyError(joint)
        return measure

    def constraints(self, joint: Joint) -> tuple[Measure, ...]:
        """The constraints C_m of a joint; the angle that some of them keep is that of the initial guess."""
        angles = self.guessed_angles
        first, second = (angles.get(body, 0.0) for body in joint.bodies)
        return joint.constraints(second - first)

    @property
    def guessed_angles(self) -> dict[str, float]:
        """Of body frames, rad; 0 of those left out."""
        return self._along_tree(self.initial.angles, self.initial.joints)

    @property
    def guessed_rates(self) -> dict[str, float]:
        """Of body frames, rad/s; 0 of those left out."""
        return self._along_tree(self.initial.rates, self.initial.joint_rates)

    def _along_tree(self, of_bodies: Mapping[str, float], of_joints: Mapping[str, float]) -> dict[str, float]:
        """By body, where not given what the one that carries it has and the joint between them adds."""
        found = dict(of_bodies)
        if not of_joints:
            return found
        for body, carrier in self.topology.carriers.items():
            if carrier is not None and body not in found:
                joint = self.joint[carrier.joint]
                turn = of_joints.get(joint.name, 0.0) if joint.type == "revolute" else 0.0
                found[body] = found.get(carrier.parent, 0.0) + (turn if joint.between[1] == carrier.own else -turn)
        return found

    def references(self) -> Iterator[Reference]:
        """All that records of the scene refer to, with their full keys."""
        records: list[tuple[str, Joint | Trajectory | Load | Payload]] = [(joint.label, joint) for joint in self.joint]
        records += [(f'trajectory "{trajectory.name}"', trajectory) for trajectory in self.trajectory]
        records += [(f"load no. {k}", load) for k, load in enumerate(self.load, 1)]
        records += [(f"payload no. {k}", payload) for k, payload in enumerate(self.payload, 1)]
        for label, record in records:
            yield from under(label, record.references())
        yield from (replace(found, key=f"initial.{found.key}") for found in self.initial.references())


class MechanismScene(MechanismKeys):
    """A validated scene, with the absolute `path` of its file and the raw `text` that results files carry."""

    path: Path
    text: str
