"""What patches and motors of a robot in space have to do in results files, and whether they can."""

from __future__ import annotations

import h5py
import numpy as np

from ..common.arrays import Array
from ..mbs.analysis.tracking import TrackedPath
from ..mbs.quantities.spatial_motion import SpatialMotion
from ..mbs.scene.space import SPACES
from ..run.spatial_actuation import SpatialActuation
from ..run.spatial_solution import SpatialSolution
from .actuators import write_judgement, write_verdict, write_voltages


def write_actuation(group: h5py.Group, solution: SpatialSolution, actuation: SpatialActuation) -> None:
    """Of an analysis: pzt/, by layout, and feasibility/.

    `pzt/LAYOUT/residual_force` (T, n) is what all patches of the link leave, on the modes of its file.
    """
    layouts, space = {}, SPACES[solution.scene.space]
    for body, of_link in solution.patches.items():
        families = [str(name) for name in solution.links[body].family]
        for name, array in of_link.arrays.items():
            entry = group.create_group(f"pzt/{name}")
            voltages = actuation.voltages[name]
            unmet = actuation.unmet[body]
            if space.is_plane:  # modes of the equations
                unmet = unmet @ solution.bodies[body].spatial.modal_transform
            write_voltages(entry, array, voltages, unmet)
            if not space.is_plane:
                entry["residual_force"].attrs.create("columns", families, dtype=h5py.string_dtype())
            entry.attrs.update({"body": body, "bends": array.layout.acts_in})
            layouts[name] = array.layout
    entry = group.create_group("feasibility")
    write_verdict(entry, actuation.feasibility)
    write_judgement(entry, actuation.feasibility, layouts)
    for joint in solution.scene.motor_joints:
        for k, unit in enumerate(joint.units):
            name = joint.name if len(joint.units) == 1 else f"{joint.name} {k + 1}"
            entry[f"joints/{name}"].attrs["unit"] = "N·m" if unit == "rad" else "N"


def write_tracking(group: h5py.Group, motion: SpatialMotion, found: TrackedPath) -> None:
    """tracking/ of an analysis: what it made small, and work (J) and largest power (W) of motors and of patches."""
    about = group.create_group("tracking").attrs
    for key in ("objective", "least_voltage", "least_share", "cost", "pre_actuation", "post_actuation"):
        about[key] = getattr(found, key)
    for name, power in zip(("motor", "patch"), _powers(motion), strict=True):
        about[f"{name}_work"] = float(np.diff(motion.time) @ (power[1:] + power[:-1]) / 2)
        about[f"{name}_power"] = float(np.abs(power).max(initial=0.0))


def _powers(motion: SpatialMotion) -> tuple[Array, Array]:
    """(T,) W of all motors, and of the modal forces of all patches."""
    forces, motors, patches = motion.motor_forces, np.zeros_like(motion.time), np.zeros_like(motion.time)
    assert forces is not None
    for joint, moments in forces.moments.items():
        of_joint = motion.joint(joint)
        assert of_joint is not None
        motors = motors + (moments * of_joint[1]).sum(axis=1)
    for body, F_p in forces.modal.items():
        if F_p.shape[1]:
            patches = patches + (F_p * motion.body(body).datasets["modal_velocity"]).sum(axis=1)
    return motors, patches
