"""Joints as they are built: rotors behind gears, friction, gears that give."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from .. import _core
from ..scene.mechanism_records import Joint
from ..scene.scene import Scene
from .measures import Marker, Measure, joint_coordinate


@dataclass(frozen=True)
class Friction:
    """−(c γ̇ + τ_c tanh(γ̇/γ̇_s)) on the coordinate γ of a joint: `viscous` c (N·m·s), `coulomb` τ_c (N·m), γ̇_s."""

    viscous: float
    coulomb: float
    speed: float


def joint_rotors(scene: Scene) -> Iterator[tuple[Measure, float]]:
    """Rows whose rate u is that of a rotor, and the inertia J of its kinetic energy ½ J u².

    A rotor on the first body a of a joint turns at N α̇_b − (N − 1) α̇_a behind a gear of ratio N (Spong 1987 neglects
    the part of α̇_a: his approximation is N² J γ̇²/2). The angles are those of the joint's coordinate: of sections or of
    frames. Where prismatic, the way along the axis takes the mass J N² with it; the turning of a is left out.
    """
    for joint in scene.joint:
        if not joint.rotor_inertia:
            continue
        row, N = joint_coordinate(scene, joint), joint.gear_ratio
        if joint.type == "prismatic":
            yield row, joint.rotor_inertia * N**2
        else:
            yield (
                Measure(f'rotor of joint "{joint.name}"', _core.MeasureKind.gear, row.a, row.b, gear_ratios=(N, N - 1)),
                joint.rotor_inertia,
            )


@dataclass(frozen=True)
class Gear:
    """A gear that gives: between its output and the second body of `joint` sit a spring and a damper.

    `motor` is the angle of the output on the first body a, θ_m = (ψ − α_a)/N with the rotor's angle ψ; `coordinate` γ
    of the joint. The moment k (θ_m − γ) + c (θ̇_m − γ̇) drives the second body. `rotor` is a body of inertia J N² whose
    angle is ψ/N, so that its size is that of other angles.
    """

    joint: str
    rotor: str
    ratio: float
    inertia: float  # J, kg·m²
    stiffness: float  # k, N·m/rad
    damping: float  # c, N·m·s/rad
    motor: Measure
    coordinate: Measure


def joint_gears(scene: Scene) -> Iterator[Gear]:
    """The gears that give."""
    for joint in scene.joint:
        if joint.stiffness is not None:
            yield _gear(scene, joint, joint.stiffness)


def _gear(scene: Scene, joint: Joint, stiffness: float) -> Gear:
    row, N, rotor = joint_coordinate(scene, joint), joint.gear_ratio, f"{joint.name}/rotor"
    ratios = (1.0, 1 / N)
    motor = Measure(f'motor of joint "{joint.name}"', _core.MeasureKind.gear, row.a, Marker(rotor), gear_ratios=ratios)
    return Gear(joint.name, rotor, N, joint.rotor_inertia, stiffness, joint.damping, motor, row)


def joint_frictions(scene: Scene) -> Iterator[tuple[Measure, Friction]]:
    """The joint coordinates on which friction acts."""
    for joint in scene.joint:
        if joint.viscous_friction or joint.coulomb_friction:
            friction = Friction(joint.viscous_friction, joint.coulomb_friction, joint.friction_speed)
            yield joint_coordinate(scene, joint), friction
