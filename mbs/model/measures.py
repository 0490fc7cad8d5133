"""Scalar rows between two points: what joints, trajectories, motors and loads are made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _core
from ..fields.field_types import GROUND, split_point
from ..scene.mechanism_records import Joint, Trajectory
from ..scene.scene import Scene, SceneKeys

FRAME = ""  # instead of a point's name: the frame of the body itself


@dataclass(frozen=True)
class Marker:
    """One end of a row: a point of a body (or its frame, point = FRAME), or a position on the ground (body None)."""

    body: str | None
    point: str = FRAME
    position: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Measure:
    """value = motion of `b` relative to `a`; `label` names it in messages, `carries_moment` tells N·m from N."""

    label: str
    kind: _core.MeasureKind
    a: Marker
    b: Marker
    direction: tuple[float, float] = (0.0, 0.0)  # of a slide: normal to its axis, in the axes of a
    gear_ratios: tuple[float, float] = (0.0, 0.0)  # (n_b, n_a) of n_b α_b − n_a α_a
    offset: float = 0.0

    @property
    def carries_moment(self) -> bool:
        """Whether the force along the row is a moment."""
        return bool(self.kind in (_core.MeasureKind.angle, _core.MeasureKind.gear))


def joint_rows(scene: Scene, joint: Joint) -> tuple[Measure, ...]:
    """The constraints C_m of a joint. Welds and prismatic joints keep the relative angle of the initial guess."""
    a, b = (_end(side, joint.at) for side in joint.between)
    label = f'joint "{joint.name}"'
    together = (Measure(f"{label}, x", _core.MeasureKind.x, a, b), Measure(f"{label}, y", _core.MeasureKind.y, a, b))
    if joint.type == "revolute":
        return together
    offset = _guessed_angle(scene, b) - _guessed_angle(scene, a)
    aligned = Measure(f"{label}, angle", _core.MeasureKind.angle, a, b, offset=offset)
    if joint.type == "weld":
        return (*together, aligned)
    x, y = _unit_axis(joint)
    return (Measure(f"{label}, across the axis", _core.MeasureKind.slide, a, b, direction=(-y, x)), aligned)


def joint_coordinate(scene: Scene, joint: Joint) -> Measure:
    """The joint's own coordinate: angle of the second on the first (as `motors` defines it), or way along the axis."""
    a, b = (_end(side, joint.at) for side in joint.between)
    label = f'joint "{joint.name}"'
    if joint.type == "prismatic":
        return Measure(f"{label}, along the axis", _core.MeasureKind.slide, a, b, direction=_unit_axis(joint))
    if scene.motors == "frame":
        a, b = (Marker(end.body, FRAME, end.position) for end in (a, b))
    return Measure(f"{label}, angle", _core.MeasureKind.angle, a, b)


def trajectory_rows(scene: Scene, trajectory: Trajectory) -> dict[str, Measure]:
    """The specified-trajectory constraints C_s by component ("x", "y" or "value"); their values equal the target."""
    label, ground = f'trajectory "{trajectory.name}"', Marker(None)
    if trajectory.joint is not None:
        joint = next(joint for joint in scene.joint if joint.name == trajectory.joint)
        row = joint_coordinate(scene, joint)
        return {"value": Measure(label, row.kind, row.a, row.b, direction=row.direction)}
    if trajectory.angle is not None:
        body, _, point = trajectory.angle.partition(".")
        return {"value": Measure(label, _core.MeasureKind.angle, ground, Marker(body, point))}
    assert trajectory.point is not None
    end = Marker(*split_point(trajectory.point))
    return {c: Measure(f"{label}, {c}", getattr(_core.MeasureKind, c), ground, end) for c in trajectory.components}


def is_open_chain(scene: SceneKeys) -> bool:
    """Whether the joints form trees: no joint closes a loop."""
    part_of = {name: name for name in (GROUND, *(body.name for body in scene.body))}

    def part(name: str) -> str:
        while part_of[name] != name:
            name = part_of[name]
        return name

    for joint in scene.joint:
        first, second = (part(side.partition(".")[0]) for side in joint.between)
        if first == second:
            return False
        part_of[first] = second
    return True


def motor_joints(scene: SceneKeys) -> tuple[Joint, ...]:
    """Joints with a motor: by default all that move in an open chain, and none in a closed loop."""
    default = is_open_chain(scene)
    return tuple(
        joint for joint in scene.joint if joint.type != "weld" and (default if joint.motor is None else joint.motor)
    )


def _end(side: str, at: tuple[float, float]) -> Marker:
    return Marker(None, FRAME, at) if side == GROUND else Marker(*split_point(side))


def _guessed_angle(scene: Scene, end: Marker) -> float:
    return 0.0 if end.body is None else scene.initial.angles.get(end.body, 0.0)


def _unit_axis(joint: Joint) -> tuple[float, float]:
    assert joint.axis is not None
    x, y = np.array(joint.axis) / np.hypot(*joint.axis)
    return float(x), float(y)
