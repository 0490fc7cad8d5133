"""Datasets of results and modal body files with unit, meaning and columns: THE table, by which records are written.

docs/reference/files.md says more of them; a test compares both with files as they are written.
"""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import h5py

LABELS: Mapping[str, tuple[str, ...]] = MappingProxyType({
    "axis": ("x", "y", "z"),
    "quaternion": ("w", "x", "y", "z"),
    "stress": ("xx", "yy", "zz", "yz", "xz", "xy"),
    "level": ("position", "velocity", "acceleration"),
})  # fmt: skip
"""Names of columns by what they are of; others are numbered from 1."""


class Meaning(NamedTuple):
    """`unit` (empty: none) and a few words; what `columns` over time are of, {} for the second part of the name.

    `record`: whose field of that name `write_record` writes; empty where the dataset has a writer of its own.
    """

    unit: str
    what: str
    columns: str = ""
    record: str = ""


def _table(text: str) -> Mapping[str, Meaning]:
    """Lines "PATTERN | unit | what | columns"; * stands for a name, ** at the end for all below, @ for an attribute.

    A line "[RECORD]" names the record of those that follow, up to "[]".
    """
    found, record = {}, ""
    for line in text.strip().splitlines():
        pattern, *about = (part.strip() for part in line.split("|"))
        if about:
            found[pattern] = Meaning(*about)._replace(record=record)
        else:
            record = pattern[1:-1]
    return MappingProxyType(found)


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
[PatchArray]
pzt/*/edges | m | begin and end of each patch
pzt/*/moment_per_volt | N m/V | of each patch
pzt/*/stiffness_ratio | | of link to patch
pzt/*/authority | | part of the curvature that is left
pzt/*/@condition_number | | of modal forces by voltages
[]
actuation_points/*/force | N | of each component
actuation_points/*/residual | N/√kg | modal force left unmet, its size
actuation_points/*/residual_force | N/√kg | modal force left unmet, by mode
actuation_points/*/position | m | where a component acts
actuation_points/*/direction | | of a component
[StructureEffect]
patch_structure/*/mass | kg | without and with patches
patch_structure/*/inertia | kg m² | without and with patches
patch_structure/*/frequency | Hz | without and with patches
[PatchFeasibility]
feasibility/pzt/*/required_moment | N m | by the required voltage
feasibility/pzt/*/available_moment | N m | by the limit
feasibility/pzt/*/saturation_time | s | when the limit is first exceeded
feasibility/pzt/*/slew | V/s | largest of the required voltage
feasibility/pzt/*/slew_limit | V/s | of the amplifier
feasibility/pzt/*/current | A | largest of the required voltage
feasibility/pzt/*/current_limit | A | of the amplifier
feasibility/pzt/*/field | V/m | at the required voltage
feasibility/pzt/*/limited_field | V/m | within the limit
feasibility/pzt/*/strain | | of the outer surface
feasibility/pzt/*/mode_required | N/√kg | modal force
feasibility/pzt/*/mode_available | N/√kg | with every patch at its limit
feasibility/pzt/*/factor | | required over available, by patch
feasibility/pzt/*/mode_factor | | required over available, by mode
[Remedies]
feasibility/pzt/*/remedies/@limit | V | that is sufficient
feasibility/pzt/*/remedies/@layers | | that are sufficient
feasibility/pzt/*/remedies/@thickness | m | of a layer, at the same field
feasibility/pzt/*/remedies/@count | | of patches of the same size
feasibility/pzt/*/remedies/@most_count | | of patches that have room
feasibility/pzt/*/remedies/@most_factor | | that these lack
[MotorFeasibility]
feasibility/joints/*/@moment | N m, N | largest
feasibility/joints/*/@moment_limit | N m, N | of the motor
feasibility/joints/*/@speed | rad/s, m/s | largest
feasibility/joints/*/@speed_limit | rad/s, m/s | of the motor
feasibility/joints/*/@power | W | largest
feasibility/joints/*/@power_limit | W | of the motor
feasibility/joints/*/@saturation_time | s | when a limit is first exceeded
feasibility/joints/*/@rms_moment | N m, N | over the path
feasibility/joints/*/@usual_moment | N m, N | not exceeded for 99 % of the time
feasibility/joints/*/@moment_time | s | of the largest moment
feasibility/joints/*/@share_beyond | | of the time, above a limit
feasibility/joints/*/@load_inertia | kg m², kg | largest of the robot
feasibility/joints/*/@jump | | of the path at a short peak
feasibility/joints/*/@factor | | largest ratio of a peak to its limit
[Unsupplied]
feasibility/unsupplied/@bodies | | whose modal forces nothing supplies
feasibility/unsupplied/@with_patches | | whether any link has patches
feasibility/unsupplied/@point | | that misses most
feasibility/unsupplied/@angles_kept | m | off its path, with computed angles
feasibility/unsupplied/@at_start | m | likewise, at the first output
feasibility/unsupplied/@moments_repeated | m | off its path, under computed moments
feasibility/unsupplied/@growth | 1/s | under these moments
feasibility/unsupplied/@families | | of the modes, by body
feasibility/unsupplied/@deflection | m | by body
feasibility/unsupplied/@rotation | rad | by body
[Settling]
settling/*/@residual | m | peak to peak in the last period
settling/*/@at_path_end | m | from the final position
settling/*/@at_end | m | from the final position
settling/*/@frequency | Hz | lowest of the commanded robot
settling/*/@time_to | s | until the distance stays below the tolerance
settling/*/@tolerance | m | within which the point is settled
settling/*/@path_end | s | when all paths are over
[]
stress/*/points/*/stress | Pa | xx, yy, zz, yz, xz, xy | stress
stress/*/points/*/von_mises | Pa | von Mises
stress/*/surface/von_mises_max | Pa | largest on the surface
stress/*/surface/position_of_max | m | where, in the undeformed link | axis
[SectionLoads]
stress/*/layers/edges | m | begin and end of each patch
stress/*/layers/patch | | number of the patch of each place
stress/*/layers/x | m | places
stress/*/layers/moment | N m | of patches on the section
stress/*/layers/force | N | of patches along the link
stress/*/layers/modal_force | N/√kg | of patches
[]
stress/*/modal | m √kg | vibrations with static deflection
stress/*/loads | N, N m, m/s², 1/s² | sizes of the unit loads
[Energies]
energy/kinetic | J | of all bodies
energy/strain | J | of all links
energy/gravitational | J | of all bodies
energy/dissipated_power | W | by damping and friction
[]
momentum/linear | kg m/s | of all bodies | axis
momentum/angular | kg m²/s | of all bodies, about the origin | axis
constraint_violation | | of position, velocity, acceleration; relative | level
resume/** | | what --resume needs
[TrackedPath]
tracking/@objective | | what was made small
tracking/@least_voltage | V | largest that is needed at least
tracking/@least_voltage_doubt | V | by how much a finer mesh may change it
tracking/@least_share | | of the limits
tracking/@cost | | effort
tracking/@pre_actuation | s | before the path
tracking/@post_actuation | s | after the path
tracking/@unmet | | of the equations, between nodes
tracking/@without_patches | m, rad | off the path by torques alone
tracking/@is_needed | | whether that is more than the tolerance
[]
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
[LinearModel]
linear/A | | of x' = A x + B u
linear/B | | of x' = A x + B u
linear/C | | of y = C x + D u
linear/D | | of y = C x + D u
linear/mass | | of the coordinates, δsᵀ M δs
linear/transformation | | ∂q/∂s
[]
linear/frequency | Hz | of the robot, undamped
linear/damping_ratio | | of the robot
linear/pole | 1/s | real and imaginary part
linear/modes/** | | mode shapes of the robot
linear/controllability | | of each mode, 0 to 1
linear/observability | | of each mode, 0 to 1
linear/zeros/* | rad/s | real and imaginary part
[Evaluation]
placement/*/centers | m | of patches
placement/*/reach | | of modes
placement/*/value | | of the criterion
[Placed]
placement/frequency | Hz | of the modes that count
placement/share | | of their strain energy in the link
placement/largest_voltage | V | of best and even over the path
placement/candidates | m | centers that are allowed
placement/candidate_reach | | of a single patch there
placement/@sets | | of patches that were compared
placement/@method | | of the search
[]
robustness/* | m | largest distance of the tip from the computed motion, by cause
tip_error | m | distance from the reference
[LoopRecord]
control/time | s | of samples
control/readings | | of sensors, in their units | readings
control/reference | | what they would read on the reference | reference
control/commands | N m, V | within limits | commands
control/wanted | N m, V | before limits | wanted
[Metrics]
control/@verdict | | in words
control/@tip_error_rms | m | distance of the tip from its place
control/@tip_error_max | m | distance of the tip from its place
control/@settling_time | s | until the error stays below 5 % of its largest
control/@vibration | m | peak to peak in the last period
control/@residual | m | distance at the end
control/@motor_work | J | of all motors
control/@voltage_effort | V² s | of all patches
control/@peak_moment | N m | of commands
control/@peak_voltage | V | of commands
control/@saturated | | share of samples with a command at its limit
control/@overshoot | m | beyond the last place
control/@lowest_frequency | Hz | by the linear model
control/@vibration_window | s | before the end
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
[MeasuredValues]
modes/measured/frequency | | 1 where measured
modes/measured/damping_ratio | | 1 where measured
modes/measured/computed_frequency | Hz | of the finite element model
[]
invariants/S_bar | √kg | ∫ρΦ dV
invariants/I_bar | m √kg | ∫ρ x_k Φ_l dV
invariants/S_bar_kl | | ∫ρ Φ_kᵀ Φ_l dV
invariants/J_spin | kg m² | ∫ρI_p dx
invariants/h_spin | m √kg | ∫ρI_p φ dx
invariants/S_spin | | ∫ρI_p φᵀφ dx
geometric_stiffness/** | | of a unit load
[Interface]
interfaces/*/position | m | undeformed
interfaces/*/translation | 1/√kg | per unit of each mode
interfaces/*/rotation | rad/(m √kg) | per unit of each mode
[Stations]
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
[PictureMesh]
mesh/points | m | for pictures
mesh/cells | | points of each cell
mesh/edges | | points of edges
mesh/mode_shapes | 1/√kg | per unit of each mode
[StressPoint]
stress/points/*/position | m | undeformed
stress/points/*/stress | Pa/(m √kg) | per unit of each mode
stress/points/*/strain | 1/(m √kg) | per unit of each mode
stress/points/*/static | Pa per unit | of unit loads
[]
stress/surface | Pa/(m √kg) | per unit of each mode
stress/surface_static | Pa per unit | of unit loads
stress/loads | | names of the unit loads
craig_bampton/** | | matrices for other programs
[OutlinedPatches]
surface_patches/edges | m | begin and end of each patch
surface_patches/width | m | along z
surface_patches/top | m² | modal forces per unit of membrane force
surface_patches/bottom | m² | likewise
[]
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


def names_of(record: str) -> tuple[str, ...]:
    """Names in files of what the tables have of a record, by the name of its class; of attributes with @."""
    every = (*RESULTS.items(), *MODAL_BODY.items())
    return tuple(pattern.rpartition("/")[2] for pattern, about in every if about.record == record)


def write_record(group: h5py.Group, record: object) -> None:
    """Write to `group` what the tables have of a record; None and () are nothing."""
    for name in names_of(type(record).__name__):
        value = getattr(record, field := name.removeprefix("@"))
        if value is None or (isinstance(value, tuple) and not value):
            continue
        if name == field:
            group.create_dataset(name, data=value, track_times=False)
        else:
            group.attrs[field] = value
