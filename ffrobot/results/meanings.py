"""Unit, meaning and columns of every dataset of results and modal body files: THE table.

docs/reference/files.md says more of them; a test compares both with files as they are written.
"""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase
from types import MappingProxyType
from typing import NamedTuple

LABELS: Mapping[str, tuple[str, ...]] = MappingProxyType({
    "axis": ("x", "y", "z"),
    "quaternion": ("w", "x", "y", "z"),
    "stress": ("xx", "yy", "zz", "yz", "xz", "xy"),
    "level": ("position", "velocity", "acceleration"),
})  # fmt: skip
"""Names of columns by what they are of; others are numbered from 1."""


class Meaning(NamedTuple):
    """`unit` (empty: none) and a few words; what `columns` over time are of, {} for the second part of the name."""

    unit: str
    what: str
    columns: str = ""


def _table(text: str) -> Mapping[str, Meaning]:
    """Lines "PATTERN | unit | what | columns"; * stands for a name, ** at the end for all below."""
    rows = (tuple(part.strip() for part in line.split("|")) for line in text.strip().splitlines())
    return MappingProxyType({pattern: Meaning(*about) for pattern, *about in rows})


RESULTS = _table("""
time | s | of outputs
step_ends | s | where steps end, with keep_steps
bodies/*/position | m | of the body's frame | axis
bodies/*/angle | rad | of the body's frame
bodies/*/quaternion | | of the body's frame, w first | quaternion
bodies/*/velocity | m/s | of the body's frame | axis
bodies/*/angular_velocity | rad/s | of the body's frame | axis
bodies/*/modal | m √kg | modal coordinates | mode of {}
bodies/*/modal_velocity | m √kg/s | their rates | mode of {}
bodies/*/modal_transform | | from fewer modes to those of the file
bodies/*/modal_force | N/√kg | what patches would have to supply | mode of {}
points/*/position | m | of the point | axis
points/*/deflection | m | in the body's frame | axis
points/*/quaternion | | of the section, w first | quaternion
points/*/predicted_shift | m | by unmet modal forces | axis
trajectories/*/force | N, N m | on the point, or on the joint | component of {}
trajectories/*/target | m, rad | the path | component of {}
trajectories/*/error | m, rad | how far the point is off the path | component of {}
joints/*/coordinate | rad, m | of the second body on the first | coordinate of {}
joints/*/rate | rad/s, m/s | of the coordinate | coordinate of {}
joints/*/moment | N m, N | of the motor, at the joint | coordinate of {}
joints/*/motor_moment | N m, N | of the motor, before its gear | coordinate of {}
joints/*/motor_coordinate | rad | of the motor, behind its compliant gear | coordinate of {}
joints/*/motor_angle | rad | the same | coordinate of {}
joints/*/motor_rate | rad/s | likewise | coordinate of {}
joints/*/gear_moment | N m | that the gear transmits | coordinate of {}
joints/*/reaction | N | on the second body | axis
joints/*/reaction_moment | N m | on the second body | axis
pzt/*/voltage | V | within the limit | patch of {}
pzt/*/required_voltage | V | without the limit | patch of {}
pzt/*/residual | N/√kg | modal force left unmet, its size
pzt/*/residual_force | N/√kg | modal force left unmet, by mode | mode
pzt/*/edges | m | begin and end of each patch
pzt/*/moment_per_volt | N m/V | of each patch
pzt/*/stiffness_ratio | | of link to patch
pzt/*/authority | | part of the curvature that is left
actuation_points/*/force | N | of each component
actuation_points/*/residual | N/√kg | modal force left unmet, its size
actuation_points/*/residual_force | N/√kg | modal force left unmet, by mode
actuation_points/*/position | m | where a component acts
actuation_points/*/direction | | of a component
patch_structure/** | | without and with the patches' mass and stiffness
feasibility/** | | required against available
stress/*/points/*/stress | Pa | xx, yy, zz, yz, xz, xy | stress
stress/*/points/*/von_mises | Pa | von Mises
stress/*/surface/von_mises_max | Pa | largest on the surface
stress/*/surface/position_of_max | m | where, in the undeformed link | axis
stress/*/layers/** | SI | below patches that stiffen the link
stress/*/modal | m √kg | vibrations with static deflection
stress/*/loads | N, N m, m/s², 1/s² | sizes of the unit loads
energy/kinetic | J | of all bodies
energy/strain | J | of all links
energy/gravitational | J | of all bodies
energy/dissipated_power | W | by damping and friction
momentum/linear | kg m/s | of all bodies | axis
momentum/angular | kg m²/s | of all bodies, about the origin | axis
constraint_violation | | of position, velocity, acceleration; relative | level
resume/** | | what --resume needs
tracking/voltage_price/* | 1/V | by how much less the objective is per volt of limit
tracking/slew_price/* | s/V | by how much less the objective is per unit of limit
tracking/current_price/* | 1/A | by how much less the objective is per unit of limit
tracking/torque_price/* | SI | by how much less the objective is per unit of limit
tracking/bound/voltage | V | that a zero requires at least
tracking/bound/time | s | at which that counts
tracking/bound/zero | 1/s | real and imaginary part
zero_dynamics/time | s | of the zeros
zero_dynamics/zeros | 1/s | along the path, real and imaginary part
joints_locked/frequency | Hz | natural frequencies, joints locked
joints_locked/damping_ratio | | of these vibrations
joints_locked/modes/** | | their mode shapes
joints_locked/compliance/* | m/N, rad/N, 1/(N m) | of the point: motion by forces and moments
joints_compliant/frequency | Hz | natural frequencies, motors locked behind compliant gears
joints_compliant/damping_ratio | | of these vibrations
joints_compliant/modes/** | | their mode shapes
joints_compliant/compliance/* | m/N, rad/N, 1/(N m) | of the point: motion by forces and moments
linear/A | | of x' = A x + B u
linear/B | | of x' = A x + B u
linear/C | | of y = C x + D u
linear/D | | of y = C x + D u
linear/mass | | of the coordinates, δsᵀ M δs
linear/transformation | | ∂q/∂s
linear/frequency | Hz | of the robot, undamped
linear/damping_ratio | | of the robot
linear/pole | 1/s | real and imaginary part
linear/modes/** | | mode shapes of the robot
linear/controllability | | of each mode, 0 to 1
linear/observability | | of each mode, 0 to 1
linear/zeros/* | rad/s | real and imaginary part
placement/** | | patches that were found
robustness/* | m | largest distance of the tip from the computed motion, by cause
tip_error | m | distance from the reference
control/time | s | of samples
control/readings | | of sensors, in their units | readings
control/reference | | what they would read on the reference | reference
control/commands | N m, V | within limits | commands
control/wanted | N m, V | before limits | wanted
""")

MODAL_BODY = _table("""
length | m | from root to tip
mass | kg | of the link
first_moment | kg m | ∫ρx dV
second_moment | kg m² | ∫ρxxᵀ dV
modes/frequency | Hz | under the reference condition
modes/stiffness | 1/s² | diag(ω²)
modes/mass | | the identity
modes/damping_ratio | | of each mode
modes/family | | of each mode
modes/residual | | 1 of attachment modes
modes/measured/frequency | | 1 where measured
modes/measured/damping_ratio | | 1 where measured
modes/measured/computed_frequency | Hz | of the finite element model
invariants/S_bar | √kg | ∫ρΦ dV
invariants/I_bar | m √kg | ∫ρ x_k Φ_l dV
invariants/S_bar_kl | | ∫ρ Φ_kᵀ Φ_l dV
invariants/J_spin | kg m² | ∫ρI_p dx
invariants/h_spin | m √kg | ∫ρI_p φ dx
invariants/S_spin | | ∫ρI_p φᵀφ dx
geometric_stiffness/** | | of a unit load
interfaces/*/position | m | undeformed
interfaces/*/translation | 1/√kg | per unit of each mode
interfaces/*/rotation | rad/(m √kg) | per unit of each mode
stations/position | m | along the axis
stations/translation | 1/√kg | per unit of each mode
stations/rotation | rad/(m √kg) | per unit of each mode
stations/height | m | of the section, along y
stations/element | | stations of each element
stations/outline | m | corners of the section
stations/rigidity | N, N m² | EA and EI of in-plane bending
stations/width | m | of the section, along z
stations/out_of_plane_rigidity | N m² | EI of bending along z
stations/torsional_rigidity | N m² | GJ
stations/middle | m | of height and width, from the axis
mesh/points | m | for pictures
mesh/cells | | points of each cell
mesh/edges | | points of edges
mesh/mode_shapes | 1/√kg | per unit of each mode
stress/points/*/position | m | undeformed
stress/points/*/stress | Pa/(m √kg) | per unit of each mode
stress/points/*/strain | 1/(m √kg) | per unit of each mode
stress/points/*/static | Pa per unit | of unit loads
stress/surface | Pa/(m √kg) | per unit of each mode
stress/surface_static | Pa per unit | of unit loads
stress/loads | | names of the unit loads
craig_bampton/** | | matrices for other programs
surface_patches/** | | outlines and modal forces of patches
remarks | | what the part's file holds and the body does not
""")


def meaning(name: str, table: Mapping[str, Meaning] = RESULTS) -> Meaning | None:
    """Of a dataset by its name below its analysis, or in its file; None of one that is not known."""
    if name in table:
        return table[name]
    return next((found for pattern, found in table.items() if matches(name, pattern)), None)


def matches(name: str, pattern: str) -> bool:
    """Whether a name is one of a pattern; * stands for a part of it, ** at the end for all below."""
    parts, wanted = name.split("/"), pattern.split("/")
    if wanted[-1] == "**":
        parts, wanted = parts[: len(wanted) - 1], wanted[:-1]
    return len(parts) == len(wanted) and all(
        part == of or ("*" in of and fnmatchcase(part, of)) for part, of in zip(parts, wanted, strict=True)
    )
