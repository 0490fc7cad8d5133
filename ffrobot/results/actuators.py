"""What patches, actuation points and motors have to do in results files, and whether they can."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any

import h5py
import numpy as np

from ..actuation.control.placing import Placed
from ..actuation.feasibility import Feasibility
from ..actuation.motors import MotorFeasibility
from ..actuation.patches.patches import PatchArray
from ..actuation.patches.records import PatchKeys
from ..actuation.patches.structure import StructureEffect
from ..actuation.patches.voltages import Voltages
from ..actuation.points import PointForces, PointSet
from ..actuation.spatial_points import SpatialPointSet
from ..actuation.unsupplied import Unsupplied
from ..common.arrays import Array
from ..mbs.scene.space import Space


def write_structure(group: h5py.Group, effects: Mapping[str, StructureEffect]) -> None:
    """Of an analysis: patch_structure/, by body."""
    for body, effect in effects.items():
        for key, pair in vars(effect).items():
            group[f"patch_structure/{body}/{key}"] = pair


def write_voltages(group: h5py.Group, patches: PatchArray, voltages: Voltages, unmet: Array) -> None:
    """Of one layout, and the modal forces `unmet` (T, n) that it leaves."""
    group["voltage"] = voltages.within_limit
    group["required_voltage"] = voltages.required
    group["residual"] = voltages.residual
    group["edges"] = patches.edges
    group["moment_per_volt"] = patches.moment_per_volt
    group["stiffness_ratio"] = patches.stiffness_ratio
    group["authority"] = patches.authority
    group.attrs["condition_number"] = patches.condition_number
    group["residual_force"] = unmet
    group.attrs["limit"] = patches.limit if np.unique(patches.limit).size > 1 else patches.limit[0]


def write_verdict(group: h5py.Group, judged: Feasibility) -> None:
    """Whether it can be done, and what nothing supplies."""
    group.attrs["feasible"] = judged.is_feasible
    if judged.unsupplied is not None:
        about = {key: value for key, value in vars(judged.unsupplied).items() if value != () and value != ""}
        group.create_group("unsupplied").attrs.update(about)


def write_judgement(group: h5py.Group, judged: Feasibility, layouts: Mapping[str, PatchKeys]) -> None:
    """What is required of each motor and each of the layouts, against what they can."""
    for joint, motor in judged.motors.items():
        group.create_group(f"joints/{joint}").attrs.update(vars(motor) | {"factor": motor.factor})
    for name, patches in judged.patches.items():
        entry, layout = group.create_group(f"pzt/{name}"), layouts[name]
        arrays = {key: value for key, value in vars(patches).items() if isinstance(value, np.ndarray)}
        for key, values in (arrays | {"factor": patches.factor, "mode_factor": patches.mode_factor}).items():
            entry[key] = values
        entry.attrs["depoling_field"] = layout.depoling_field or np.inf
        entry.attrs["strain_limit"] = layout.strain_limit or np.inf
        entry.create_group("remedies").attrs.update(vars(patches.remedies))


def read_motors(group: h5py.Group, joints: Sequence[str]) -> dict[str, MotorFeasibility]:
    """Of the feasibility of an analysis: what every motor has to do, in the order of `joints`."""
    entries = group.get("joints", {})
    return {
        name: MotorFeasibility(
            **{
                key.name: entries[name].attrs[key.name]
                for key in fields(MotorFeasibility)
                if key.default is MISSING or key.name in entries[name].attrs
            }
        )
        for name in joints
        if name in entries
    }


def read_unsupplied(group: h5py.Group) -> Unsupplied | None:
    """Of the feasibility of an analysis: what nothing supplies; None where there is nothing of the kind."""
    if "unsupplied" not in group:
        return None
    attributes = group["unsupplied"].attrs.items()
    about: dict[str, Any] = {key: tuple(value) if np.ndim(value) else value for key, value in attributes}
    return Unsupplied(**about)


def write_point_forces(
    group: h5py.Group, points: PointSet | SpatialPointSet, forces: PointForces, space: Space | None = None
) -> None:
    """Of the actuation points of one body; of 3D sets what the `space` of the scene has."""
    group["force"] = forces.force
    group["residual"] = forces.residual
    group["residual_force"] = forces.unmet
    position, direction = np.array([point.position for point in points.points]), points.direction.T
    group["position"] = position if space is None else space.along(position)
    group["direction"] = direction if space is None else space.along(direction)
    of_plane = {"x": "axial", "y": "transverse"} if space is not None and space.is_plane else {}
    group.attrs["components"] = [of_plane.get(axis, axis) for axis in points.axes]
    group.attrs["rank"] = forces.rank
    group.attrs["condition_number"] = forces.condition_number


def write_placement(group: h5py.Group, placed: Placed) -> None:
    """Of an analysis: placement/, with the patches found and those spread evenly.

    What each reaches, and what one patch would reach anywhere.
    """
    group = group.create_group("placement")
    group.attrs.update({"body": placed.wanted.body, "criterion": placed.wanted.criterion})
    group.attrs.update({"measure": placed.wanted.measure, "sets": placed.sets, "method": placed.method})
    for key, found in (("best", placed.best), ("even", placed.even)):
        for name, values in vars(found).items():
            group[f"{key}/{name}"] = values
    for key in ("frequency", "share", "largest_voltage", "candidates", "candidate_reach"):
        group[key] = getattr(placed, key)
