"""What patches, actuation points and motors have to do in results files, and whether they can."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from ..common.arrays import Array
from ..common.hdf5 import fields_in
from ..common.meanings import write_record
from ..mbs.quantities.motion import body_motion, joint_motion
from ..mbs.quantities.supply import actuator_forces
from ..mbs.run.record import Run
from ..mbs.scene.space import SPACES, Space
from ..run.actuation import Actuation
from ..run.solution import Solution

if TYPE_CHECKING:  # most scenes have none of these
    from ..actuation.control.placement import Placed
    from ..actuation.feasibility import Feasibility, Unsupplied
    from ..actuation.motors import MotorFeasibility
    from ..actuation.patches.patches import PatchArray, Voltages
    from ..actuation.patches.records import PztLayout
    from ..actuation.points import PointForces, PointSet
    from ..mbs.tracking.tracking import TrackedPath


def write_voltages(group: h5py.Group, solution: Solution, actuation: Actuation) -> None:
    """Write pzt/ of an analysis, a group for each layout.

    `pzt/LAYOUT/residual_force` (T, n) is what all patches of the link leave, on the modes of its file.
    """
    space = SPACES[solution.scene.space]
    for body, of_link in solution.patches.items():
        families = [str(name) for name in solution.links[body].family]
        for name, array in of_link.arrays.items():
            entry = group.create_group(f"pzt/{name}")
            voltages = actuation.voltages[name]
            unmet = actuation.unmet[body]
            if space.is_plane:  # modes of the equations
                unmet = unmet @ solution.bodies[body].spatial.modal_transform
            _write_layout(entry, array, voltages, unmet)
            if not space.is_plane:
                entry["residual_force"].attrs.create("columns", families, dtype=h5py.string_dtype())
            entry.attrs.update({"body": body, "bends": array.layout.acts_in})


def write_feasibility(group: h5py.Group, solution: Solution, judged: Feasibility) -> None:
    """Write feasibility/ of an analysis."""
    entry = group.create_group("feasibility")
    layouts = {name: array.layout for of_link in solution.patches.values() for name, array in of_link.arrays.items()}
    entry.attrs["feasible"] = judged.is_feasible
    if judged.unsupplied is not None:
        write_record(entry.create_group("unsupplied"), judged.unsupplied)
    _write_judgement(entry, judged, layouts)
    for joint in solution.scene.motor_joints:
        for k, unit in enumerate(joint.units):
            name = joint.name if len(joint.units) == 1 else f"{joint.name} {k + 1}"
            entry[f"joints/{name}"].attrs["unit"] = "N·m" if unit == "rad" else "N"


def _write_layout(group: h5py.Group, patches: PatchArray, voltages: Voltages, unmet: Array) -> None:
    """Of one layout what has no peaks, and the modal forces `unmet` (T, n) that it leaves."""
    group["residual"] = voltages.residual
    write_record(group, patches)
    group["residual_force"] = unmet
    group.attrs["limit"] = patches.limit if np.unique(patches.limit).size > 1 else patches.limit[0]
    group.attrs["capacitance"] = patches.layout.capacitance()
    if np.any(-patches.amplifiers.range[0] != patches.amplifiers.range[1]):
        group.attrs["range"] = patches.amplifiers.range


def _write_judgement(group: h5py.Group, judged: Feasibility, layouts: Mapping[str, PztLayout]) -> None:
    """What is required of each motor and each of the layouts, against what they can."""
    for joint, motor in judged.motors.items():
        write_record(group.create_group(f"joints/{joint}"), motor)
    for name, patches in judged.patches.items():
        entry, layout = group.create_group(f"pzt/{name}"), layouts[name]
        write_record(entry, patches)
        entry.attrs["depoling_field"] = layout.depoling_field or np.inf
        entry.attrs["strain_limit"] = layout.strain_limit or np.inf
        write_record(entry.create_group("remedies"), patches.remedies)


def read_motors(group: h5py.Group, joints: Sequence[str]) -> dict[str, MotorFeasibility]:
    """Read requirements and limits of motors from feasibility/ of an analysis, in the order of `joints`."""
    from ..actuation.motors import MotorFeasibility

    about = {name: group["joints"][name].attrs for name in joints if f"joints/{name}" in group}
    return {name: MotorFeasibility(**fields_in(of, MotorFeasibility)) for name, of in about.items()}


def read_unsupplied(group: h5py.Group) -> Unsupplied | None:
    """Read the forces that neither motors nor patches supply, from feasibility/; None if there are none."""
    if "unsupplied" not in group:
        return None
    from ..actuation.feasibility import Unsupplied

    attributes = fields_in(group["unsupplied"].attrs, Unsupplied).items()
    about: dict[str, Any] = {key: tuple(value) if np.ndim(value) else value for key, value in attributes}
    return Unsupplied(**about)


def write_point_forces(group: h5py.Group, points: PointSet, forces: PointForces, space: Space) -> None:
    """Write position, direction and residual of the actuation points of a body, in axes of the scene's `space`."""
    group["residual"] = forces.residual
    group["residual_force"] = forces.unmet
    group["position"] = space.along(np.array([point.position for point in points.points]))
    group["direction"] = space.along(points.direction.T)
    of_plane = {"x": "axial", "y": "transverse"} if space.is_plane else {}
    group.attrs["components"] = [of_plane.get(axis, axis) for axis in points.axes]
    group.attrs["rank"] = forces.rank
    group.attrs["condition_number"] = forces.condition_number


def write_placement(group: h5py.Group, _: Run, placed: Placed) -> None:
    """Write placement/ of an analysis: optimum and evenly spaced patches.

    What each reaches, and what one patch would reach anywhere.
    """
    group = group.create_group("placement")
    group.attrs.update({"body": placed.wanted.body, "criterion": placed.wanted.criterion})
    group.attrs["measure"] = placed.wanted.measure
    write_record(group, placed)
    write_record(group.create_group("best"), placed.best)
    write_record(group.create_group("even"), placed.even)


def write_tracking(group: h5py.Group, run: Run, tracked: TrackedPath) -> None:
    """Write tracking/ of an analysis: the errors made small, and the effort for it.

    Work (J) and largest power (W) of motors and of patches, what each zero asks for (V), prices of limits.
    """
    group = group.create_group("tracking")
    about = group.attrs
    write_record(group, tracked)
    for kind, prices in tracked.prices.items():
        for name, values in prices.items():
            if kind in ("voltage", "torque") or values.any():
                group[f"{kind}_price/{name}"] = values
    if (bounds := tracked.bounds) is not None:
        group["bound/voltage"], group["bound/time"] = bounds.voltages, bounds.times
        group["bound/zero"] = np.stack([bounds.zeros.real, bounds.zeros.imag], axis=1)
    for name, power in zip(("motor", "patch"), _powers(run), strict=True):
        about[f"{name}_work"] = float(np.diff(run.time) @ (power[1:] + power[:-1]) / 2)
        about[f"{name}_power"] = float(np.abs(power).max(initial=0.0))


def _powers(run: Run) -> tuple[Array, Array]:
    """(T,) W of all motors, and of the modal forces of all patches."""
    forces, motors, patches = actuator_forces(run), np.zeros_like(run.time), np.zeros_like(run.time)
    assert forces is not None
    for joint, moments in forces.moments.items():
        of_joint = joint_motion(run, joint)
        assert of_joint is not None
        motors = motors + (moments * of_joint[1]).sum(axis=1)
    for body, F_p in forces.modal.items():
        if F_p.shape[1]:
            patches = patches + (F_p * body_motion(run, body).datasets["modal_velocity"]).sum(axis=1)
    return motors, patches
