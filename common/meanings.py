"""Datasets of results and modal body files with unit, meaning and columns: the table, by which records are written.

docs/key_tables.py makes tables of docs/reference/files.md of it; tests compare both with files as they are written.
"""

from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import h5py

LABELS: Mapping[str, tuple[str, ...]] = {
    "axis": ("x", "y", "z"),
    "quaternion": ("w", "x", "y", "z"),
    "stress": ("xx", "yy", "zz", "yz", "xz", "xy"),
    "level": ("position", "velocity", "acceleration"),
}
"""Names of columns by what they are of; others are numbered from 1."""


class Meaning(NamedTuple):
    """Unit (empty: none) and meaning of a stored quantity; `columns`: what its columns are, as in `LABELS`.

    `record`: the class whose field of that name `write_record` writes; empty where other code writes the dataset.
    """

    unit: str
    what: str
    columns: str = ""
    record: str = ""


def _table(text: str) -> Mapping[str, Meaning]:
    """Lines "PATTERN | unit | what | columns"; * stands for a name, ** at the end for all below, @ for an attribute.

    "[RECORD BEGIN]" says what record the lines up to the next have, if any, and how their patterns begin.
    """
    table, record, begin = {}, "", ""
    for line in text.strip().splitlines():
        pattern, *about = (part.strip() for part in line.split("|"))
        if about:
            table[begin + pattern] = Meaning(*about)._replace(record=record)
        else:
            record, _, begin = pattern[1:-1].partition(" ")
    return table


RESULTS = _table("""
time | s | of outputs
step_ends | s | where steps end, with keep_steps
[ bodies/*/]
position | m | of the body's frame | axis
angle | rad | of the body's frame
quaternion | | of the body's frame, w first | quaternion
velocity | m/s | of the body's frame | axis
angular_velocity | rad/s | of the body's frame | axis
modal | m √kg | modal coordinates | mode of {}
modal_velocity | m √kg/s | their rates | mode of {}
modal_transform | | from fewer modes to those of the file
modal_force | N/√kg | what patches would have to supply | mode of {}
[ points/*/]
position | m | of the point | axis
deflection | m | in the body's frame | axis
quaternion | | of the section, w first | quaternion
predicted_shift | m | by unmet modal forces | axis
[]
trajectories/*/force | N, N m | on the point, or on the joint | component of {}
trajectories/*/target | m, rad | the path | component of {}
trajectories/*/error | m, rad | how far the point is off the path | component of {}
[ joints/*/]
coordinate | rad, m | of the second body on the first | coordinate of {}
rate | rad/s, m/s | of the coordinate | coordinate of {}
moment | N m, N | of the motor, at the joint | coordinate of {}
motor_moment | N m, N | of the motor, before its gear | coordinate of {}
motor_coordinate | rad | of the motor, behind its compliant gear | coordinate of {}
motor_angle | rad | the same | coordinate of {}
motor_rate | rad/s | likewise | coordinate of {}
gear_moment | N m | that the gear transmits | coordinate of {}
reaction | N | on the second body | axis
reaction_moment | N m | on the second body | axis
[ pzt/*/]
voltage | V | within the limit | patch of {}
required_voltage | V | without the limit | patch of {}
residual | N/√kg | modal force left unmet, its size
residual_force | N/√kg | modal force left unmet, by mode | mode
[PatchArray pzt/*/]
edges | m | begin and end of each patch
moment_per_volt | N m/V | of each patch
stiffness_ratio | | of link to patch
authority | | part of the curvature that is left
@condition_number | | of modal forces by voltages
[ actuation_points/*/]
force | N | of each component
residual | N/√kg | modal force left unmet, its size
residual_force | N/√kg | modal force left unmet, by mode
position | m | where a component acts
direction | | of a component
[StructureEffect patch_structure/*/]
mass | kg | without and with patches
inertia | kg m² | without and with patches
frequency | Hz | without and with patches
[PatchFeasibility feasibility/pzt/*/]
required_moment | N m | by the required voltage
available_moment | N m | by the limit
saturation_time | s | when the limit is first exceeded
slew | V/s | largest of the required voltage
slew_limit | V/s | of the amplifier
current | A | largest of the required voltage
current_limit | A | of the amplifier
field | V/m | at the required voltage
limited_field | V/m | within the limit
strain | | of the outer surface
mode_required | N/√kg | modal force
mode_available | N/√kg | with every patch at its limit
factor | | required over available, by patch
mode_factor | | required over available, by mode
[Remedies feasibility/pzt/*/remedies/@]
limit | V | that is sufficient
layers | | that are sufficient; 0 if they stiffen the link
thickness | m | of a layer, at the same field
count | | of patches of the same size
most_count | | of patches that have room
most_factor | | that these lack
[MotorFeasibility feasibility/joints/*/@]
moment | N m, N | largest
moment_limit | N m, N | of the motor
speed | rad/s, m/s | largest
speed_limit | rad/s, m/s | of the motor
power | W | largest
power_limit | W | of the motor
saturation_time | s | when a limit is first exceeded
rms_moment | N m, N | over the path
usual_moment | N m, N | not exceeded for 99 % of the time
moment_time | s | of the largest torque
share_beyond | | of the time, above a limit
load_inertia | kg m², kg | largest of the robot
jump | | of the path at a short peak
static_moment | N m, N | largest at rest along the path, where the limit is exceeded
factor | | largest ratio of a peak to its limit
[Unsupplied feasibility/unsupplied/@]
bodies | | whose modal forces nothing supplies
with_patches | | whether any link has patches
point | | that misses most
angles_kept | m | off its path, with computed angles
at_start | m | likewise, at the first output
moments_repeated | m | off its path, under computed moments
growth | 1/s | under these moments
families | | of the modes, by body
deflection | m | by body
rotation | rad | by body
[Settling settling/*/@]
residual | m | peak to peak in the last period
at_path_end | m | from the final position
at_end | m | from the final position
frequency | Hz | lowest of the commanded robot
time_to | s | until the distance stays below the tolerance
tolerance | m | within which the point is settled
path_end | s | when all paths are over
[ stress/*/]
points/*/stress | Pa | xx, yy, zz, yz, xz, xy | stress
points/*/von_mises | Pa | von Mises
surface/von_mises_max | Pa | largest on the surface
surface/position_of_max | m | where, in the undeformed link | axis
[SectionLoads stress/*/layers/]
edges | m | begin and end of each patch
patch | | number of the patch of each place
x | m | places
moment | N m | of patches on the section
force | N | of patches along the link
modal_force | N/√kg | of patches
[]
stress/*/modal | m √kg | vibrations with static deflection
stress/*/loads | N, N m, m/s², 1/s² | sizes of the unit loads
[Energies energy/]
kinetic | J | of all bodies
strain | J | of all links
gravitational | J | of all bodies
dissipated_power | W | by damping and friction
[]
momentum/linear | kg m/s | of all bodies | axis
momentum/angular | kg m²/s | of all bodies, about the origin | axis
constraint_violation | | of position, velocity, acceleration; relative | level
resume/** | | what --resume needs
[TrackedPath tracking/@]
objective | | what was made small
least_voltage | V | largest that is needed at least
least_voltage_doubt | V | by how much a finer mesh may change it
least_share | | of the limits
cost | | effort
pre_actuation | s | before the path
post_actuation | s | after the path
unmet | | of the equations, between nodes
without_patches | m, rad | off the path by torques alone
is_needed | | whether that is more than the tolerance
path_tolerance | m | by which coordinates of points may be off the path
tolerance_price | V/m | by how much less the least voltage is per path_tolerance
[ tracking/]
voltage_price/* | 1/V | by how much less the objective is per volt of limit
slew_price/* | s/V | by how much less the objective is per unit of limit
current_price/* | 1/A | by how much less the objective is per unit of limit
torque_price/* | SI | by how much less the objective is per unit of limit
bound/voltage | V | that a zero requires at least
bound/time | s | at which that counts
bound/zero | 1/s | real and imaginary part
[]
zero_dynamics/time | s | of the zeros
zero_dynamics/zeros | 1/s | along the path, real and imaginary part
[ joints_*/]
frequency | Hz | natural frequencies, joints locked, or motors behind compliant gears
damping_ratio | | of these vibrations
modes/** | | their mode shapes
compliance/* | m/N, rad/N, 1/(N m) | of the point: motion by forces and moments
[LinearModel linear/]
A | | of x' = A x + B u
B | | of x' = A x + B u
C | | of y = C x + D u
D | | of y = C x + D u
mass | | of the coordinates, δsᵀ M δs
transformation | | ∂q/∂s
[ linear/]
frequency | Hz | of the robot, undamped
damping_ratio | | of the robot
pole | 1/s | real and imaginary part
modes/** | | mode shapes of the robot
controllability | | of each mode, 0 to 1
observability | | of each mode, 0 to 1
zeros/* | rad/s | real and imaginary part
[Evaluation placement/*/]
centers | m | of patches
reach | | of modes
value | | of the criterion
[Placed placement/]
frequency | Hz | of the modes that count
share | | of their strain energy in the link
largest_voltage | V | of best and even over the path
candidates | m | centers that are allowed
candidate_reach | | of a single patch there
@sets | | of patches that were compared
@method | | of the search
[]
robustness/* | m | largest distance of the tip from the computed motion, by cause
tip_error | m | distance from the reference
[LoopRecord control/]
time | s | of samples
readings | | of sensors, in their units | readings
reference | | what they would read on the reference | reference
commands | N m, N, V | within limits | commands
wanted | N m, N, V | before limits | wanted
[Metrics control/@]
verdict | | in words
tip_error_rms | m | distance of the tip from its place
tip_error_max | m | distance of the tip from its place
settling_time | s | until the error stays below 5 % of its largest
vibration | m | peak to peak in the last period
residual | m | distance at the end
motor_work | J | of all motors
voltage_effort | V² s | of all patches
peak_moment | N m, N | of commands
peak_voltage | V | of commands
saturated | | share of samples with a command at its limit
overshoot | m | beyond the last place
lowest_frequency | Hz | by the linear model
vibration_window | s | before the end
[]
control/pole | | of the sampled linear loop, real and imaginary part
control/controller/time | s | of the matrices
control/controller/* | | of ξ(k+1) = A ξ + B y, u = C ξ + D y, off the reference
control/estimate/points/*/position | m | of the tip, estimated | axis
control/estimate/points/*/error | m | distance of the estimated tip from the tip
control/estimate/points/*/sigma | m | standard deviation of the estimated tip | axis
control/estimate/pole | | of the estimate's error, real and imaginary part
control/estimate/** | | what the observer estimates
""")

MODAL_BODY = _table("""
length | m | from root to tip
mass | kg | of the link
first_moment | kg m | ∫ρx dV
second_moment | kg m² | ∫ρxxᵀ dV
[ modes/]
frequency | Hz | under the reference condition
stiffness | 1/s² | diag(ω²)
mass | | the identity
damping_ratio | | of each mode
family | | of each mode
residual | | 1 of attachment modes
[MeasuredValues modes/measured/]
frequency | | 1 where measured
damping_ratio | | 1 where measured
computed_frequency | Hz | of the finite element model
[ invariants/]
S_bar | √kg | ∫ρΦ dV
I_bar | m √kg | ∫ρ x_k Φ_l dV
S_bar_kl | | ∫ρ Φ_kᵀ Φ_l dV
J_spin | kg m² | ∫ρI_p dx
h_spin | m √kg | ∫ρI_p φ dx
S_spin | | ∫ρI_p φᵀφ dx
[]
geometric_stiffness/** | | of a unit load
[Interface interfaces/*/]
position | m | undeformed
translation | 1/√kg | per unit of each mode
rotation | rad/(m √kg) | per unit of each mode
[Stations stations/]
position | m | along the axis
translation | 1/√kg | per unit of each mode
rotation | rad/(m √kg) | per unit of each mode
height | m | of the section, along y
element | | stations of each element
outline | m | corners of the section
rigidity | N, N m² | EA and EI of in-plane bending
width | m | of the section, along z
out_of_plane_rigidity | N m² | EI of bending along z
torsional_rigidity | N m² | GJ
middle | m | of height and width, from the axis
[PictureMesh mesh/]
points | m | for pictures
cells | | points of each cell
edges | | points of edges
mode_shapes | 1/√kg | per unit of each mode
[StressPoint stress/points/*/]
position | m | undeformed
stress | Pa/(m √kg) | per unit of each mode
strain | 1/(m √kg) | per unit of each mode
static | Pa per unit | of unit loads
[]
stress/surface | Pa/(m √kg) | per unit of each mode
stress/surface_static | Pa per unit | of unit loads
stress/loads | | names of the unit loads
craig_bampton/** | | matrices for other programs
[OutlinedPatches surface_patches/]
edges | m | begin and end of each patch
width | m | along z
top | m² | modal forces per unit of membrane force
bottom | m² | likewise
top_across | m² | of the strain across
bottom_across | m² | likewise
[]
remarks | | what the part's file holds and the body does not
""")


def meaning(name: str, table: Mapping[str, Meaning] = RESULTS) -> Meaning | None:
    """Unit and meaning of a dataset by its name below its analysis, or in its file; None if unknown."""
    if name in table:
        return table[name]
    return next((one for pattern, one in table.items() if matches(name, pattern)), None)


def matches(name: str, pattern: str) -> bool:
    """Whether a name fits a pattern: * for one part of it, ** at the end for everything below."""
    parts, wanted = name.split("/"), pattern.split("/")
    if wanted[-1] == "**":
        parts, wanted = parts[: len(wanted) - 1], wanted[:-1]
    return len(parts) == len(wanted) and all(
        part == of or ("*" in of and fnmatchcase(part, of)) for part, of in zip(parts, wanted, strict=True)
    )


def names_of(record: str) -> tuple[str, ...]:
    """Names in HDF5 files of the fields of a record, given by its class's name; those of attributes begin with @."""
    every = (*RESULTS.items(), *MODAL_BODY.items())
    return tuple(pattern.rpartition("/")[2] for pattern, about in every if about.record == record)


def write_record(group: "h5py.Group", record: object) -> None:
    """Write to `group` the fields of `record` that this module's tables list; None and () are skipped."""
    for name in names_of(type(record).__name__):
        value = getattr(record, field := name.removeprefix("@"))
        if value is None or (isinstance(value, tuple) and not value):
            continue
        if name == field:
            group.create_dataset(name, data=value, track_times=False)
        else:
            group.attrs[field] = value
