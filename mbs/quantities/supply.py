"""What drives a run: forces along paths, moments of motors, also behind compliant gears; energies and momentum.

All arrays are over the output times (T, …), SI units.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...common.arrays import Array
from ...common.structs import kept, struct
from ..model.divided_link import spread_of
from ..model.gears import compliance, with_compliance
from ..model.system import MotorForces
from ..posture.posture import mobility
from ..run.gears import Supplied, supplied_through_gears, with_motors
from ..run.record import GearMotion, Run
from ..scene.trajectories import Trajectory
from .motion import system_of


def path_force(run: Run, trajectory: str) -> Array:
    """Return −λ (T, m) of a path's m equations: forces on its point, N, then moments, N·m, global axes."""
    chosen = [k for k, row in enumerate(run.model.rows) if row.is_trajectory and row.owner == trajectory]
    return -run.multipliers[:, chosen]


def followed_trajectories(run: Run) -> list[Trajectory]:
    """The trajectories that the run follows: all of the scene, or none."""
    holding = {row.owner for row in run.model.rows if row.is_trajectory}
    return [trajectory for trajectory in run.model.scene.trajectory if trajectory.name in holding]


@kept
def actuator_forces(run: Run) -> MotorForces | None:
    """Required forces of motors, through compliant gears, and on modes.

    None if nothing is prescribed, or in the plane if motors are not as many as degrees of freedom.
    """
    supplied = _supplied(run)
    if supplied is None:
        return None
    modal = dict(supplied.forces.modal)
    for name, link in run.links.items():
        spread = spread_of(link.modal, list(zip(link.starts, link.pieces, strict=True)))
        modal[name] = np.hstack([modal.pop(piece) for piece in link.names]) @ spread
    return replace(supplied.forces, modal=modal)


def motor_moments(run: Run) -> Mapping[str, Array]:
    """Motor torques (T, k) by joint, N·m or N, acting or required for what is prescribed."""
    forces = actuator_forces(run)
    return run.commanded if forces is None else forces.moments


@kept
def _supplied(run: Run) -> Supplied | None:
    if not run.is_prescribed or (run.space.is_plane and not motors_fit(run)):
        return None
    return supplied_through_gears(run)


@kept
def motors_fit(run: Run) -> bool:
    """Whether there are as many motors as the mechanism has degrees of freedom with rigid links."""
    return len(run.time) > 0 and len(run.model.motor_columns) == mobility(run.model, run.q[0]).freedom


def gear_motions(run: Run) -> Mapping[str, GearMotion]:
    """Motion of compliant gears by joint, of inverse analyses and equilibria."""
    are_rigid = all(compliance(node) is None for node in run.model.tree.nodes)
    supplied = None if are_rigid else _supplied(run)
    return {} if supplied is None else supplied.gears


@kept
def behind_gears(run: Run) -> Run:
    """The run with compliant gears in its tree, motors turned by their twists; itself if it has them."""
    gears = gear_motions(run)
    if not gears:
        return run
    model = with_compliance(run.model)
    q, v, a = with_motors(model, run, gears)
    return replace(run, model=model, q=q, v=v, a=a)


def motor_motion(run: Run, joint: str) -> tuple[Array, Array, Array] | None:
    """Angle (T,), rad, and rate (T,), rad/s, of the motor at a compliant gear's output, and the gear's torque.

    The torque (T,), N·m, acts on the second side of the joint. None for joints without such a gear.
    """
    if (known := gear_motions(run).get(joint)) is not None:
        return known.angle, known.rate, known.gear_moment
    for gear in run.model.tree.gears:
        if gear.joint.joint.name == joint:
            way, rate = gear.twist(run.q, run.v)
            torque = gear.spring.moment(way) + gear.damping * rate
            return run.q[:, gear.motor.q.start], run.v[:, gear.motor.v.start], torque
    return None


@struct
class Energies:
    """Kinetic, strain and gravitational energy (T,) J, and the power (T,) W that modes, gears, friction dissipate.

    Strain energy is that of links and compliant gears.
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


def totals(run: Run) -> tuple[Energies, Momentum]:
    """Energies and momentum of all bodies and rotors."""
    run = behind_gears(run)
    system = system_of(run)
    sums = system.core.states_totals(system.scene, run.q, run.v)
    return Energies(*sums[:, :4].T), Momentum(sums[:, 4:7], sums[:, 7:])
