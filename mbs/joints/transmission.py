"""What sits in a joint as it is built: limits of its motor, friction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array


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
