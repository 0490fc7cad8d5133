"""Forces in the joints of a tree, by the core's Newton–Euler algorithm, and its energies and momentum. Global axes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ..model.known_motion import MotionForces, multiplier_forces
from ..model.tree import Node
from ..model.wrench import Wrench, without_work
from .motion import RobotMotion


def reactions(motion: RobotMotion) -> Mapping[str, Wrench]:
    """By joint: force on its second side, and moment about where that side is, N and N·m.

    A joint of the tree carries what its body and its outboard subtree need, less what else acts there and what acts
    along its coordinates: motors, friction, loads, rotors. One that closes a loop has its multipliers.
    """
    return _carried(motion, motion.behind_gears.forces)


def reactions_of_loops(motion: RobotMotion, forces: Array) -> Mapping[str, Wrench]:
    """What forces (T, rows that close loops) along these rows are in `reactions`."""
    multipliers = np.zeros_like(motion.multipliers)
    multipliers[:, motion.model.loop_rows] = -forces
    return _carried(motion, multiplier_forces(motion.system, motion.q, motion.time, multipliers))


def _carried(motion: RobotMotion, forces: MotionForces) -> dict[str, Wrench]:
    """By joint what it carries but does no work along it."""
    found, model = dict[str, Wrench](), motion.model
    for number, row in enumerate(model.rows):
        if not row.is_trajectory and row.coordinate < 0:  # else it turns a rotor, along the joint
            on_b = forces.of_row(number)[1]
            found[row.owner] = found[row.owner].plus(on_b) if row.owner in found else on_b
    loops = {joint.name for joint in model.tree.loops}
    for number, node in enumerate(model.tree.nodes):
        if node.joint.name not in loops:
            carried = without_work(model.tree, node, forces.of_joint(number), motion.q, motion.frames)
            found[node.joint.name] = _on_second(motion, node, carried)
    return found


def _on_second(motion: RobotMotion, node: Node, on_outer: Wrench) -> Wrench:
    """Of what acts on the outer side of the joint that carries a body: the same, or what answers it, on the second."""
    if not node.backwards:
        return on_outer
    outer, inner = (motion.model.tree.pose(section, motion.q, motion.frames).r for section in (node.outer, node.inner))
    return Wrench(-on_outer.force, -on_outer.moment).seen_from(outer - inner)


@dataclass(frozen=True)
class Energies:
    """Kinetic, strain and gravitational energy (T,) J, and the power (T,) W that modes, gears, friction dissipate.

    Compliant gears store energy, too, and their motors turn as they have to.
    """

    kinetic: Array
    strain: Array
    gravitational: Array
    dissipated_power: Array


@dataclass(frozen=True)
class Momentum:
    """Linear (T, 3) kg·m/s, and angular about the global origin (T, 3) kg·m²/s."""

    linear: Array
    angular: Array


def totals(motion: RobotMotion) -> tuple[Energies, Momentum]:
    """Of all bodies and rotors."""
    motion = motion.behind_gears
    found = motion.system.core.states_totals(motion.system.scene, motion.q, motion.v)
    return Energies(*found[:, :4].T), Momentum(found[:, 4:7], found[:, 7:])
