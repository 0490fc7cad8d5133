"""Compliant gears: where a motor has to be, and what it must do, for a motion found with rigid ones.

Inverse analyses and equilibria take gears for rigid: their motion is that of the links, and their rotors turn with
them. With the rigid rotor's angle ψ = N γ + α_a a gear transmits τ_s = τ − J N ψ̈ (Spong 1987). The twist
δ = θ_m − γ follows from k(δ) + c δ̇ = τ_s as a quintic spline through the outputs, and the motor's torque is
τ_s + J N (ψ̈ + N δ̈).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ..joints.twist_spring import TwistSpring
from .outcome import GearMotion

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

DEGREE = 5
UNRESOLVED = 0.001  # of a motor's largest moment: what every second output may change of it
MOST_STEPS = 50
SLOWEST = 1e4  # s, of a gear to give way, per second of the analysis: beyond, splines do not find its twist


class GearSpring(NamedTuple):
    """k(δ) (N·m), c (N·m·s/rad), and J N² (kg·m²) of the rotor in front of it; `where` messages say it is."""

    spring: TwistSpring
    damping: float
    inertia: float
    where: str


def gear_motion(
    spring: GearSpring, time: Array, tau: Array, rotor: Array, gamma: Array, curve: BSpline | None = None
) -> GearMotion:
    """Of a gear whose motor supplies `tau` (T,) where it is rigid, `rotor` (T,) of which its rotor takes, J N ψ̈.

    `gamma` (T, 3): the joint's coordinate, its rate and acceleration. `curve`: δ(t) where it is known.
    Raises `InputError` where damping holds it so long that its moments say nothing of its twist.
    """
    lasts, longest = spring.damping / min(spring.spring.slopes), SLOWEST * (time[-1] - time[0])
    if len(time) > 1 and lasts > longest:
        raise InputError(
            f"{spring.where}: damping: expected a compliant gear that relaxes within {longest:.3g} s (damping /"
            f" stiffness, {SLOWEST:g} times the analysis), found {lasts:.3g} s; without stiffness it does not deform at"
            " all"
        )
    transmitted, unresolved = tau - rotor, 0.0
    is_known = curve is not None
    curve = curve if is_known or len(time) <= DEGREE else _twist(spring, time, transmitted)
    twist = _read(curve, time) if curve else np.pad(spring.spring.twist(transmitted)[:, None], ((0, 0), (0, 2)))
    moment = tau + spring.inertia * twist[:, 2]
    largest = float(np.abs(moment).max())
    if not is_known and len(time) > 2 * DEGREE + 1 and largest:
        coarse = tau[::2] + spring.inertia * _read(_twist(spring, time[::2], transmitted[::2]), time[::2])[:, 2]
        unresolved = float(np.abs(coarse - moment[::2]).max()) / largest
    angle, rate, acceleration = (gamma + twist).T
    return GearMotion(transmitted, angle, rate, acceleration, moment, unresolved, twist, curve)


def _read(curve: BSpline, time: Array) -> Array:
    """Value, rate and acceleration (T, 3)."""
    return np.column_stack([curve(time), curve.derivative(1)(time), curve.derivative(2)(time)])


def _twist(gear: GearSpring, time: Array, moment: Array) -> BSpline:
    """δ(t) with k(δ) + c δ̇ = `moment` at all outputs: a quintic spline without knots next to the ends.

    By Newton, which ends where no output changes its part of the spring.
    """
    from scipy.interpolate import BSpline, make_interp_spline
    from scipy.sparse import diags
    from scipy.sparse.linalg import spsolve

    knots, n = make_interp_spline(time, moment, k=DEGREE).t, len(time)
    values = BSpline.design_matrix(time, knots, DEGREE)
    widths = DEGREE / (knots[DEGREE + 1 : DEGREE + n] - knots[1:n])
    differences = diags([-widths, widths], [0, 1], shape=(n - 1, n))
    rates = BSpline.design_matrix(time, knots[1:-1], DEGREE - 1) @ differences
    twist = gear.spring.twist(moment)
    for _ in range(MOST_STEPS):
        slope = gear.spring.slope(twist)
        left = (diags(slope) @ values + gear.damping * rates).tocsc()
        found = spsolve(left, moment - gear.spring.moment(twist) + slope * twist)
        twist = values @ found
        if np.array_equal(gear.spring.slope(twist), slope):
            break
    return BSpline(knots, found, DEGREE)


def unresolved_gears(gears: Mapping[str, GearMotion]) -> Iterator[str]:
    """What to tell of motors whose moments the outputs do not resolve."""
    for joint, motion in gears.items():
        if motion.unresolved > UNRESOLVED:
            yield (
                f'joint "{joint}": outputs are too far apart for its motor behind a compliant gear: with every second'
                f" one its torque changes by {100 * motion.unresolved:.2g} %; smooth the path or refine output_step"
            )
