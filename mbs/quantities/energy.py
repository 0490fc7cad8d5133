"""Energies and momentum of a motion, over the output times (T, …), SI units, global axes: from the core."""

from __future__ import annotations

from ...common.arrays import Array
from ...common.structs import struct
from .motion import RobotMotion


@struct
class Energies:
    """Kinetic, strain and gravitational energy (T,) J, and the power (T,) W that modes, gears, friction dissipate.

    Compliant gears store energy, too, and their motors turn as they have to.
    """

    kinetic: Array
    strain: Array
    gravitational: Array
    dissipated_power: Array


@struct
class Momentum:
    """Linear (T, 3) kg·m/s, and angular about the global origin (T, 3) kg·m²/s."""

    linear: Array
    angular: Array


def totals(motion: RobotMotion) -> tuple[Energies, Momentum]:
    """Of all bodies and rotors."""
    motion = motion.behind_gears
    found = motion.system.core.states_totals(motion.system.scene, motion.q, motion.v)
    return Energies(*found[:, :4].T), Momentum(found[:, 4:7], found[:, 7:])
