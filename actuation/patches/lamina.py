"""One layer of a patch by itself: plain ceramic, free or held across its length, and fibers at an angle."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array


class Lamina(NamedTuple):
    """Stress (σ_x, τ_xs) = C (ε_x, γ_xs) − C Λ V in a layer; x along the link, s across it in the layer."""

    C: Array  # (2, 2) Pa
    per_volt: Array  # (2,) C Λ, Pa/V: the stress that a volt takes off a layer which is held
    energy: float  # (C Λ) Λ, Pa/V²: what a held layer lacks of its permittivity times the field of a volt, squared

    @property
    def shears(self) -> bool:
        """Whether shear loads it, or is loaded by a voltage."""
        return bool(self.C[:, 1].any() or self.per_volt[1])


class Fibres(NamedTuple):
    """A layer of parallel fibers: E_1, E_2, G_12 in Pa, ν_12, d33 along and d31 across in m/V, angle in rad from x.

    `spacing` of the electrodes along the fibers, m: a volt is a field of 1/spacing.
    """

    E_1: float
    E_2: float
    G_12: float
    nu_12: float
    d33: float
    d31: float
    angle: float
    spacing: float


@lru_cache
def plain_lamina(
    modulus: float, d31: float, thickness: float, nu: float | None = None, *, held: bool = False
) -> Lamina:
    """Lamina of a ceramic isotropic in its plane, its electrodes `thickness` (m) apart; γ is computed from the link.

    Its free strain is alike in all directions, too, so that it never shears, at whatever angle it lies. Free across:
    E = 1/s_11 and E d31. With ν = −s_12/s_11 `held` across (σ_s ≠ 0): E/(1 − ν²) and d31/(s_11 + s_12) = E d31/(1 − ν).
    A link that stands still holds it in both directions.
    """
    ratio, stress = nu or 0.0, modulus * d31 / thickness
    across = ratio if held else 0.0
    C, per_volt = np.diag([modulus / (1.0 - across**2), 0.0]), np.array([stress / (1.0 - across), 0.0])
    return _fixed(C, per_volt, stress * d31 / thickness * (1.0 if nu is None else 2.0 / (1.0 - ratio)))


@lru_cache
def fibre_lamina(of: Fibres) -> Lamina:
    """Return the lamina of fibers at an angle: transformed compliances, σ_s = 0 (Jones 1999, 2.6).

        S̄_11 = S_11 c⁴ + (2 S_12 + S_66) s²c² + S_22 s⁴
        S̄_16 = (2 S_11 − 2 S_12 − S_66) s c³ − (2 S_22 − 2 S_12 − S_66) s³c
        S̄_66 = 2 (2 S_11 + 2 S_22 − 4 S_12 − S_66) s²c² + S_66 (s⁴ + c⁴)

    C = [[S̄_11, S̄_16], [S̄_16, S̄_66]]⁻¹; free strains of a unit field ε_x = d33 c² + d31 s², γ_xs = 2 (d33 − d31) s c.
    Uniaxial as the plain one: C_11 is E_1 at no angle.
    """
    c, s = np.cos(of.angle), np.sin(of.angle)
    S_11, S_22, S_12, S_66 = 1 / of.E_1, 1 / of.E_2, -of.nu_12 / of.E_1, 1 / of.G_12
    S_xx = S_11 * c**4 + (2 * S_12 + S_66) * s**2 * c**2 + S_22 * s**4
    S_xs = (2 * S_11 - 2 * S_12 - S_66) * s * c**3 - (2 * S_22 - 2 * S_12 - S_66) * s**3 * c
    S_ss = 2 * (2 * S_11 + 2 * S_22 - 4 * S_12 - S_66) * s**2 * c**2 + S_66 * (s**4 + c**4)
    C = np.linalg.inv(np.array([[S_xx, S_xs], [S_xs, S_ss]]))
    free = np.array([of.d33 * c**2 + of.d31 * s**2, 2 * (of.d33 - of.d31) * s * c]) / of.spacing
    return _fixed(C, C @ free, float(free @ C @ free))


def _fixed(C: Array, per_volt: Array, energy: float) -> Lamina:
    C.setflags(write=False)
    per_volt.setflags(write=False)
    return Lamina(C, per_volt, energy)
