"""The standard figures of any scene: what is worth seeing of the results that are there."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ...results.file import Results
from ...results.joints import Coordinate, joint_coordinates
from .figure_file import Curve, FigureRecord
from .shared import bending_points, both_ways, curves_of, file_name, members

SNAPSHOTS = 5
ROUND_OFF = 1e-9  # rad: bodies that turn no further do not turn
SEEN = 1e-3  # of the largest component of a deflection: smaller ones are the line at zero
AXES = "xyz"
ABOUT = {"mx": "about x", "my": "about y", "mz": "about z"}
ENERGIES = ("kinetic", "strain", "gravitational")


def standard_figures(results: Results) -> tuple[FigureRecord, ...]:
    """Robot, paths, angles, deflections, modes, forces, torques, stresses, energies, voltages, linear models.

    Analyses are laid over each other.
    """
    return tuple(record for figures in FIGURES for record in figures(results))


def _configurations(results: Results) -> Iterator[FigureRecord]:
    """Of the first analysis that goes through time, else the first: in others the robot is hardly elsewhere."""
    moving = [analysis for analysis in results.analyses if len(results.time(analysis)) > 1]
    for analysis in [*moving, *results.analyses][:1]:
        times = results.time(analysis)
        snapshots = np.linspace(times[0], times[-1], SNAPSHOTS if len(times) > 1 else 1)
        yield FigureRecord(
            name=file_name("configurations", analysis),
            title=f"robot postures, {analysis}",
            kind="configurations",
            analysis=analysis,
            times=tuple(float(t) for t in snapshots),
        )


def _paths(results: Results) -> Iterator[FigureRecord]:
    """Where the point of every trajectory should go and where it went: in the plane, else by component over time."""
    for trajectory in results.scene.get("trajectory", []):
        name, point = trajectory["name"], trajectory.get("point")
        groups = (f"{analysis}/trajectories/{name}" for analysis in results.analyses if point is not None)
        group = next((group for group in groups if results.has(f"{group}/target")), None)
        axes = [] if group is None else [one for one in _components(results, group) if one in AXES]
        if not axes:
            continue
        reached = [(analysis, f"{analysis}/points/{point}/position") for analysis in results.analyses]
        if whole := results.space.is_plane and len(axes) == 2:
            curves = [Curve(data=f"{group}/target", label="prescribed path")]
            curves += [Curve(data=data, label=analysis) for analysis, data in reached]
        else:
            curves = [Curve(data=f"{group}/target[{k}]", label=f"prescribed, {c}") for k, c in enumerate(axes)]
            curves += [
                Curve(data=f"{data}[{AXES.index(c)}]", label=f"{analysis}, {c}")
                for analysis, data in reached
                for c in axes
            ]
        yield FigureRecord(
            name=file_name("path", name),
            title=f"path of {point}",
            kind="path" if whole else "time",
            curves=tuple(curves),
            y_label="y (m)" if whole else "position (m)",
        )


def _tip_errors(results: Results) -> Iterator[FigureRecord]:
    """Of all closed loops in one figure."""
    if curves := curves_of(results, "tip_error"):
        yield FigureRecord(name="tip_error", title="tip position error", curves=curves, y_label="error (mm)", scale=1e3)


def _angles(results: Results) -> Iterator[FigureRecord]:
    for body in members(results, "bodies"):
        curves = curves_of(results, f"bodies/{body}/angle")
        if any(np.ptp(results.data(curve.data)) > ROUND_OFF for curve in curves):
            title = f"angle of {body}"
            yield FigureRecord(name=file_name("angle", body), title=title, curves=curves, y_label="angle (rad)")


def _deflections(results: Results) -> Iterator[FigureRecord]:
    """By axes of the body; components that are zero but for round-off are left out."""
    for point in bending_points(results):
        found = curves_of(results, f"points/{point}/deflection")
        largest = np.max([np.abs(results[curve.data]).max(axis=0) for curve in found], axis=0)
        shown = [k for k in range(len(largest)) if largest[k] > SEEN * largest.max()]
        curves = tuple(
            Curve(data=f"{curve.data}[{k}]", label=f"{curve.label}, {AXES[k]}") for curve in found for k in shown
        )
        yield FigureRecord(
            name=file_name("deflection", point),
            title=f"deflection of {point}, axes of the body",
            curves=curves,
            y_label="deflection (mm)",
            scale=1e3,
        )


def _modes(results: Results) -> Iterator[FigureRecord]:
    """Modal coordinates, and the modal forces that patches would have to supply."""
    for analysis in results.analyses:
        for body in results.names(f"{analysis}/bodies"):
            for dataset, title, y_label in (
                ("modal", "modal coordinates", "modal coordinate (m·√kg)"),
                ("modal_force", "required modal forces", "modal force (N/√kg)"),
            ):
                data = f"{analysis}/bodies/{body}/{dataset}"
                if results.has(data) and results.data(data).any():
                    yield FigureRecord(
                        name=file_name(dataset, analysis, body),
                        title=f"{title} of {body}, {analysis}",
                        curves=(Curve(data=data, label="mode"),),
                        y_label=y_label,
                    )


def _trajectory_forces(results: Results) -> Iterator[FigureRecord]:
    """What keeps points and angles on their paths; along a joint it is what its motor does, which is drawn anyway."""
    for trajectory in results.scene.get("trajectory", []):
        name, joint = trajectory["name"], trajectory.get("joint")
        forces: list[Curve] = []
        moments: list[Curve] = []
        for analysis in results.analyses:
            group = f"{analysis}/trajectories/{name}"
            if not results.has(f"{group}/force") or (joint and results.has(f"{analysis}/joints/{joint}/moment")):
                continue
            components = _components(results, group)
            for k, component in enumerate(components):
                several = f", {ABOUT.get(component, component)}" if len(components) > 1 else ""
                is_force = component in AXES if "point" in trajectory else _slides(results, str(joint))
                (forces if is_force else moments).append(Curve(data=f"{group}/force[{k}]", label=analysis + several))
        for kind, what, unit, curves in (
            ("force", "force", "N", forces),
            ("path_moment" if "point" in trajectory else "force", "torque", "N·m", moments),
        ):
            if curves:
                title, y_label = f"{what} along trajectory {name}", f"{what} ({unit})"
                yield FigureRecord(name=file_name(kind, name), title=title, curves=tuple(curves), y_label=y_label)


def _components(results: Results, group: str) -> list[str]:
    """Of a trajectory: what its forces act along or about."""
    return [str(each) for each in results.attributes(group)["components"]]


def _slides(results: Results, joint: str) -> bool:
    return any(coordinate.unit == "m" for coordinate in joint_coordinates(results.scene, joint))


def _joints(results: Results) -> Iterator[FigureRecord]:
    """Coordinates, torques, torques over speed, and size of the reaction, of every joint."""
    for joint in members(results, "joints"):
        for coordinate in joint_coordinates(results.scene, joint):
            yield from _coordinate(results, joint, coordinate)
        if curves := curves_of(results, f"joints/{joint}/reaction", magnitude=True):
            title = f"magnitude of the reaction, joint {joint}"
            yield FigureRecord(name=file_name("reaction", joint), title=title, curves=curves, y_label="reaction (N)")


def _coordinate(results: Results, joint: str, coordinate: Coordinate) -> Iterator[FigureRecord]:
    """Of one coordinate of a joint: itself, its motor's torque or force, and that over its speed."""
    label, column, unit = joint + coordinate.label, coordinate.column, coordinate.unit
    moved = curves_of(results, f"joints/{joint}/coordinate", column)
    if any(np.ptp(results.data(curve.data)) for curve in moved):
        title, y_label = f"joint {label}", f"{'angle' if unit == 'rad' else 'displacement'} ({unit})"
        yield FigureRecord(name=file_name("coordinate", label), title=title, curves=moved, y_label=y_label)
    if driven := curves_of(results, f"joints/{joint}/moment", column):
        force = f"{'torque' if unit == 'rad' else 'force'} ({coordinate.force_unit})"
        limit = coordinate.limits.moment
        title, lines = f"motor of joint {label}", both_ways(limit) if np.isfinite(limit) else ()
        yield FigureRecord(name=file_name("moment", label), title=title, curves=driven, y_label=force, limits=lines)
        yield from _torque_speed(results, joint, coordinate, force)


def _torque_speed(results: Results, joint: str, coordinate: Coordinate, y_label: str) -> Iterator[FigureRecord]:
    curves, label = [], joint + coordinate.label
    for analysis in results.analyses:
        moment, rate, of_motor = (f"{analysis}/joints/{joint}/{key}" for key in ("moment", "rate", "motor_rate"))
        rate = of_motor if results.has(of_motor) else rate  # behind a compliant gear
        if results.has(moment) and results.has(rate) and len(results.time(analysis)) > 1:
            curves.append(Curve(data=moment + coordinate.column, x=rate + coordinate.column, label=analysis))
    if curves:
        yield FigureRecord(
            name=file_name("torque_speed", label),
            title=f"torque–speed curve, joint {label}",
            kind="torque-speed",
            joint=joint,
            curves=tuple(curves),
            x_label=f"speed ({coordinate.unit}/s)",
            y_label=y_label,
        )


def _stresses(results: Results) -> Iterator[FigureRecord]:
    """Von Mises stress at stress points, and the largest on surfaces."""
    for body in members(results, "stress"):
        found = (point for a in results.analyses for point in results.names(f"{a}/stress/{body}/points"))
        places = [(f"points/{point}/von_mises", point) for point in dict.fromkeys(found)]
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


def _energies(results: Results) -> Iterator[FigureRecord]:
    """Energies of every analysis."""
    for analysis in results.analyses:
        names = ((kind, f"{analysis}/energy/{kind}") for kind in ENERGIES)
        if curves := tuple(Curve(data=data, label=kind) for kind, data in names if results.has(data)):
            name = file_name("energy", analysis)
            yield FigureRecord(name=name, title=f"energies, {analysis}", curves=curves, y_label="energy (J)")


def _voltages(results: Results) -> Iterator[FigureRecord]:
    """Voltages of all patches of a layout, required and within their limit; its name is the body's if it has none."""
    limits = {layout.get("name", layout["body"]): layout.get("limit") for layout in results.scene.get("pzt", [])}
    for analysis in results.analyses:
        for body in results.names(f"{analysis}/pzt"):
            limit = limits.get(body)
            for dataset, title in (("required_voltage", "required voltages"), ("voltage", "voltages within the limit")):
                yield FigureRecord(
                    name=file_name(dataset, analysis, body),
                    title=f"{title}, patches of {body}, {analysis}",
                    curves=(Curve(data=f"{analysis}/pzt/{body}/{dataset}", label="patch"),),
                    y_label="voltage (V)",
                    limits=() if limit is None else both_ways(limit),
                )


def _linear(results: Results) -> Iterator[FigureRecord]:
    """Places of patches; of linear models the mode shapes of the robot, and responses."""
    for analysis in results.analyses:
        if results.has(f"{analysis}/placement"):
            name, title = file_name("placement", analysis), f"patches, {analysis}"
            yield FigureRecord(name=name, title=title, kind="placement", analysis=analysis)
        if results.has(f"{analysis}/linear"):
            name, title = file_name("modes", analysis), f"modes, {analysis}"
            yield FigureRecord(name=name, title=title, kind="modes", analysis=analysis)
            yield from _responses(results, analysis)


def _responses(results: Results, analysis: str) -> Iterator[FigureRecord]:
    """How points and joints respond to each motor and to the first patch of each layout."""
    attributes = results.attributes(f"{analysis}/linear")
    inputs, outputs = ([str(name) for name in attributes[key]] for key in ("input_names", "output_names"))
    for source in inputs:
        is_first = source.startswith("joint/") or (source.startswith("pzt/") and source.endswith("/1"))
        seen = [name for name in outputs if name.startswith("point/") or name == source]
        if is_first and seen:
            yield FigureRecord(
                name=file_name("bode", analysis, source.replace("/", "_")),
                title=f"response to {source}, {analysis}",
                kind="bode",
                analysis=analysis,
                transfers=tuple((source, name) for name in seen),
                y_label="magnitude (m, rad per N·m, V)",
            )


FIGURES: tuple[Callable[[Results], Iterator[FigureRecord]], ...] = (
    _configurations, _paths, _tip_errors, _angles, _deflections, _modes, _trajectory_forces, _joints, _stresses,
    _energies, _voltages, _linear,
)  # fmt: skip
"""In this order."""
