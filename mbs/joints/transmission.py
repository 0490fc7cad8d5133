"""What sits in a joint as it is built: motor, rotor behind a gear, friction, elastic gear."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from .measure import Measure


@dataclass(frozen=True)
class MotorLimits:
    """Largest moment (N·m), speed (rad/s) and power (W) at the joint, infinite without a limit; N, m/s of a force."""

    moment: float = np.inf
    speed: float = np.inf
    power: float = np.inf


@dataclass(frozen=True)
class Friction:
    """−(c γ̇ + τ_c tanh(γ̇/γ̇_s)) on the coordinate γ of a joint: `viscous` c (N·m·s), `coulomb` τ_c (N·m), γ̇_s."""

    viscous: float
    coulomb: float
    speed: float

    def resistance(self, rate: Array) -> Array:
        """C γ̇ + τ_c tanh(γ̇/γ̇_s) at rates γ̇ of any shape."""
        found: Array = self.viscous * rate + self.coulomb * np.tanh(rate / self.speed)
        return found

    def slope(self, rate: Array) -> Array:
        """Its derivative by γ̇: c + τ_c/γ̇_s / cosh²(γ̇/γ̇_s)."""
        found: Array = self.viscous + self.coulomb / self.speed * (1.0 - np.tanh(rate / self.speed) ** 2)
        return found


class Rotor(NamedTuple):
    """The `measure` whose rate u is that of a rotor, and the `inertia` J (kg·m²; kg) of its kinetic energy ½ J u²."""

    measure: Measure
    inertia: float


@dataclass(frozen=True)
class ElasticGear:
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
