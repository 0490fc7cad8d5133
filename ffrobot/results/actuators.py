"""What patches, actuation points and motors have to do in results files, and whether they can."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from ..common.hdf5 import fields_in
from ..common.meanings import write_record
from ..mbs.quantities.motion import body_motion, joint_motion
from ..mbs.quantities.supply import actuator_forces
from ..mbs.run.record import Run
from ..mbs.scene.space import Space
from ..run.actuation import Actuation
from ..run.result import Solution

if TYPE_CHECKING:  # most scenes have none of these
    from ..actuation.control.placement import Placed
    from ..actuation.feasibility import Feasibility, Unsupplied
    from ..actuation.motors import MotorFeasibility
    from ..actuation.points import PointForces, PointSet
    from ..mbs.tracking.tracking import TrackedPath


def write_voltages(group: h5py.Group, solution: Solution, actuation: Actuation) -> None:
    """Write pzt/ of an analysis, a group for each layout.

    `pzt/LAYOUT/residual_force` (T, n) is what all patches of the link leave, on the modes of its file.
    """
    for body, of_link in solution.patches.items():
        for name, patches in of_link.arrays.items():
            entry, unmet = group.create_group(f"pzt/{name}"), actuation.unmet[body]
            entry["residual"] = actuation.voltages[name].residual
            write_record(entry, patches)
            if solution.scene.is_planar:  # modes of the equations
                entry["residual_force"] = unmet @ solution.bodies[body].spatial.modal_transform
            else:
                entry["residual_force"], families = unmet, list(map(str, solution.links[body].family))
                entry["residual_force"].attrs.create("columns", families, dtype=h5py.string_dtype())
            entry.attrs["limit"] = patches.limit if np.unique(patches.limit).size > 1 else patches.limit[0]
            entry.attrs["capacitance"] = patches.layout.capacitance()
            if np.any(-patches.amplifiers.range[0] != patches.amplifiers.range[1]):
                entry.attrs["range"] = patches.amplifiers.range
            entry.attrs.update({"body": body, "bends": patches.layout.bends})


def write_feasibility(group: h5py.Group, solution: Solution, judged: Feasibility) -> None:
    """Write feasibility/ of an analysis: what is required of each motor and layout, against what they can."""
    group = group.create_group("feasibility")
    group.attrs["feasible"] = judged.is_feasible
    if judged.unsupplied is not None:
        write_record(group.create_group("unsupplied"), judged.unsupplied)
    for label, motor in judged.motors.items():
        write_record(group.create_group(f"joints/{label}"), motor)
    layouts = {name: array.layout for of_link in solution.patches.values() for name, array in of_link.arrays.items()}
    for name, patches in judged.patches.items():
        entry = group.create_group(f"pzt/{name}")
        write_record(entry, patches)
        entry.attrs["depoling_field"] = layouts[name].depoling_field or np.inf
        entry.attrs["strain_limit"] = layouts[name].strain_limit or np.inf
        write_record(entry.create_group("remedies"), patches.remedies)
    for joint in solution.scene.motor_joints:
        for k, unit in enumerate(joint.units):
            label = joint.name if len(joint.units) == 1 else f"{joint.name} {k + 1}"
            group[f"joints/{label}"].attrs["unit"] = "N·m" if unit == "rad" else "N"


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
    components = [of_plane.get(axis, axis) for axis in points.axes]
    group.attrs.update(components=components, rank=forces.rank, condition_number=forces.condition_number)


def write_placement(group: h5py.Group, _: Run, placed: Placed) -> None:
    """Write placement/ of an analysis: reach of optimum and evenly spaced patches, and of one patch anywhere."""
    group, wanted = group.create_group("placement"), placed.wanted
    group.attrs.update(body=wanted.body, criterion=wanted.criterion, measure=wanted.measure)
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
    forces, motors, patches = actuator_forces(run), np.zeros_like(run.time), np.zeros_like(run.time)
    assert forces is not None
    for joint, moments in forces.moments.items():
        of_joint = joint_motion(run, joint)
        assert of_joint is not None
        motors = motors + (moments * of_joint[1]).sum(axis=1)
    for body, F_p in forces.modal.items():
        patches = patches + (F_p * body_motion(run, body).modal_velocity).sum(axis=1)
    for name, power in (("motor", motors), ("patch", patches)):
        about[f"{name}_work"] = float(np.diff(run.time) @ (power[1:] + power[:-1]) / 2)
        about[f"{name}_power"] = float(np.abs(power).max(initial=0.0))
