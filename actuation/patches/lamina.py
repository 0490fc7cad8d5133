"""A thin layer under plane stress whose edges along the link carry nothing: what its strains and a volt do to it."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array


class Lamina(NamedTuple):
    """Stress (σ_x, τ_xs) = C (ε_x, γ_xs) − C Λ V in a layer; x along the link, s across it in the layer.

    Attributes:
        C: (2, 2) Pa.
        per_volt: (2,) C Λ, Pa/V: the stress that a volt takes off a layer which is held.
    """

    C: Array
    per_volt: Array


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
def plain_lamina(modulus: float, d31: float, thickness: float) -> Lamina:
    """A ceramic alike in all directions of its plane, between electrodes `thickness` (m) apart: γ is left to the link.

    Its free strain is alike in all directions, too, so that it never shears, at whatever angle it lies.
    """
    return _fixed(np.diag([modulus, 0.0]), np.array([modulus * d31 / thickness, 0.0]))


@lru_cache
def fibre_lamina(of: Fibres) -> Lamina:
    """Of fibres at an angle: transformed compliances with σ_s = 0 (Jones, Mechanics of Composite Materials, 1999, 2.6).

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
    return _fixed(C, C @ free)


def _fixed(C: Array, per_volt: Array) -> Lamina:
    C.setflags(write=False)
    per_volt.setflags(write=False)
    return Lamina(C, per_volt)
