"""The standard figures of any scene: what is worth seeing of the results that are there."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...results.file import Results
from ...results.joints import joint_coordinates
from .figure_file import Curve, FigureRecord
from .shared import (
    bending_points,
    curves_of,
    file_name,
    joint_figures,
    members,
    moving_configurations,
    placement_figures,
    response_figures,
    tip_error_figures,
    voltage_figures,
)
from .standard_3d import figures_3d

ROUND_OFF = 1e-9  # rad: bodies that turn no further do not turn


def standard_figures(results: Results) -> tuple[FigureRecord, ...]:
    """Configurations, paths, angles, deflections, forces, moments and voltages; analyses are laid over each other."""
    if results.is_spatial:
        return figures_3d(results)
    return tuple(
        [
            *moving_configurations(results),
            *_paths(results),
            *_angles(results),
            *_deflections(results),
            *_trajectory_forces(results),
            *joint_figures(results),
            *_stresses(results),
            *voltage_figures(results),
            *tip_error_figures(results),
            *_linear(results),
        ]
    )


def _paths(results: Results) -> Iterator[FigureRecord]:
    """Where the point of every trajectory should go and where it went: in the plane, or over time for x or y alone."""
    for trajectory in results.scene.get("trajectory", []):
        name, point = trajectory["name"], trajectory.get("point")
        wanted = [f"{a}/trajectories/{name}/target" for a in results.analyses]
        wanted = [target for target in wanted if results.has(target)][:1]
        if point is None or not wanted:
            continue
        reached = [f"{a}/points/{point}/position" for a in results.analyses]
        in_plane = results.data(wanted[0]).shape[1] == 2
        component = "" if in_plane else "[1]" if "y" in trajectory else "[0]"
        curves = [Curve(data=data, label="prescribed path") for data in wanted]
        curves += [Curve(data=data + component, label=data.split("/")[0]) for data in reached]
        yield FigureRecord(
            name=file_name("path", name),
            title=f"path of {point}",
            kind="path" if in_plane else "time",
            curves=tuple(curves),
            y_label="y (m)" if in_plane or component == "[1]" else "x (m)",
        )


def _angles(results: Results) -> Iterator[FigureRecord]:
    for body in members(results, "bodies"):
        datasets = [f"{a}/bodies/{body}/angle" for a in results.analyses if results.has(f"{a}/bodies/{body}/angle")]
        if any(np.ptp(results.data(name)) > ROUND_OFF for name in datasets):
            curves = tuple(Curve(data=name, label=name.split("/")[0]) for name in datasets)
            yield FigureRecord(
                name=file_name("angle", body), title=f"angle of {body}", curves=curves, y_label="angle (rad)"
            )


def _deflections(results: Results) -> Iterator[FigureRecord]:
    for point in bending_points(results):
        datasets = [f"{a}/points/{point}/deflection[1]" for a in results.analyses if results.has(f"{a}/points/{point}")]
        if any(results.data(name).any() for name in datasets):
            curves = tuple(Curve(data=name, label=name.split("/")[0]) for name in datasets)
            title = f"transverse deflection of {point}"
            yield FigureRecord(
                name=file_name("deflection", point), title=title, curves=curves, y_label="deflection (mm)", scale=1e3
            )


def _trajectory_forces(results: Results) -> Iterator[FigureRecord]:
    """What holds points and angles on their paths; along a joint it is what its motor does, which is drawn anyway."""
    for trajectory in results.scene.get("trajectory", []):
        name, joint = trajectory["name"], trajectory.get("joint")
        curves = []
        for analysis in results.analyses:
            group = f"{analysis}/trajectories/{name}"
            if not results.has(f"{group}/force") or (joint and results.has(f"{analysis}/joints/{joint}/moment")):
                continue
            components = [str(each) for each in results.attributes(group)["components"]]
            several = len(components) > 1
            curves += [
                Curve(data=f"{group}/force[{k}]", label=analysis + (f", {component}" if several else ""))
                for k, component in enumerate(components)
            ]
        if curves:
            is_force = "point" in trajectory or _slides(results, str(joint))
            y_label, title = "force (N)" if is_force else "moment (N·m)", f"force along trajectory {name}"
            yield FigureRecord(name=file_name("force", name), title=title, curves=tuple(curves), y_label=y_label)


def _slides(results: Results, joint: str) -> bool:
    return any(coordinate.unit == "m" for coordinate in joint_coordinates(results.scene, joint))


def _stresses(results: Results) -> Iterator[FigureRecord]:
    """Von Mises stress at stress points, and the largest on surfaces."""
    for body in members(results, "stress"):
        places = [(f"points/{point}/von_mises", point) for point in _stress_points(results, body)]
        for dataset, where in (*places, ("surface/von_mises_max", "surface")):
            if curves := curves_of(results, f"stress/{body}/{dataset}"):
                title = f"stress in {body}, {'largest on its surface' if where == 'surface' else where} (von Mises)"
                yield FigureRecord(
                    name=file_name("stress", body, where),
                    title=title,
                    curves=curves,
                    y_label="stress (MPa)",
                    scale=1e-6,
                )


def _stress_points(results: Results, body: str) -> list[str]:
    return list(dict.fromkeys(name for a in results.analyses for name in results.names(f"{a}/stress/{body}/points")))


def _linear(results: Results) -> Iterator[FigureRecord]:
    """Places of patches, mode shapes of the robot, and responses."""
    for analysis in results.analyses:
        yield from placement_figures(results, analysis)
        if not results.has(f"{analysis}/linear"):
            continue
        yield FigureRecord(
            name=file_name("modes", analysis), title=f"modes, {analysis}", kind="modes", analysis=analysis
        )
        yield from response_figures(results, analysis)
