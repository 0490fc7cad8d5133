"""The standard figures of any scene: what is worth seeing of the results that are there."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator

import numpy as np

from ...results.file import Results
from ..torque_speed import coordinate_unit, force_unit, motor_limits
from .figure_file import Curve, FigureRecord

SNAPSHOTS = 5


def standard_figures(results: Results) -> tuple[FigureRecord, ...]:
    """Configurations, paths, angles, deflections, forces, moments and voltages; analyses are laid over each other."""
    return tuple(
        [
            *_configurations(results),
            *_paths(results),
            *_angles(results),
            *_deflections(results),
            *_trajectory_forces(results),
            *_joints(results),
            *_stresses(results),
            *_voltages(results),
            *_tip_errors(results),
            *_linear(results),
        ]
    )


def _configurations(results: Results) -> Iterator[FigureRecord]:
    """Of the first analysis that goes through time, else the first: in others the robot is hardly elsewhere."""
    moving = [analysis for analysis in results.analyses if len(results.time(analysis)) > 1]
    for analysis in [*moving, *results.analyses][:1]:
        times = results.time(f"{analysis}/time")
        snapshots = np.linspace(times[0], times[-1], SNAPSHOTS if len(times) > 1 else 1)
        yield FigureRecord(
            name=file_name("configurations", analysis),
            title=f"configurations, {analysis}",
            kind="configurations",
            analysis=analysis,
            times=tuple(float(t) for t in snapshots),
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
        curves = [Curve(data=data, label="specified") for data in wanted]
        curves += [Curve(data=data + component, label=data.split("/")[0]) for data in reached]
        yield FigureRecord(
            name=file_name("path", name),
            title=f"path of {point}",
            kind="path" if in_plane else "time",
            curves=tuple(curves),
            y_label="y (m)" if in_plane or component == "[1]" else "x (m)",
        )


def _angles(results: Results) -> Iterator[FigureRecord]:
    for body in _members(results, "bodies"):
        datasets = [f"{a}/bodies/{body}/angle" for a in results.analyses if results.has(f"{a}/bodies/{body}/angle")]
        if any(np.ptp(results.data(name)) for name in datasets):
            curves = tuple(Curve(data=name, label=name.split("/")[0]) for name in datasets)
            yield FigureRecord(
                name=file_name("angle", body), title=f"angle of {body}", curves=curves, y_label="angle (rad)"
            )


def _deflections(results: Results) -> Iterator[FigureRecord]:
    for point in _members(results, "points"):
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
            is_force = "point" in trajectory or (joint is not None and force_unit(results, joint) == "N")
            y_label, title = "force (N)" if is_force else "moment (N·m)", f"force along trajectory {name}"
            yield FigureRecord(name=file_name("force", name), title=title, curves=tuple(curves), y_label=y_label)


def _joints(results: Results) -> Iterator[FigureRecord]:
    """Coordinate, moment, moment over speed, and size of the reaction, of every joint."""
    for joint in _members(results, "joints"):
        unit, coordinate = force_unit(results, joint), coordinate_unit(results, joint)
        force = "moment" if unit == "N·m" else "force"
        moved = _curves(results, f"joints/{joint}/coordinate")
        if any(np.ptp(results.data(curve.data)) for curve in moved):
            title, y_label = f"joint {joint}", f"{'angle' if coordinate == 'rad' else 'way'} ({coordinate})"
            yield FigureRecord(name=file_name("coordinate", joint), title=title, curves=moved, y_label=y_label)
        if driven := _curves(results, f"joints/{joint}/moment"):
            limit = motor_limits(results, joint).moment
            title, lines = f"motor of joint {joint}", _both_ways(limit) if np.isfinite(limit) else ()
            yield FigureRecord(
                name=file_name("moment", joint), title=title, curves=driven, y_label=f"{force} ({unit})", limits=lines
            )
            yield from _torque_speed(results, joint, f"{force} ({unit})", f"speed ({coordinate}/s)")
        if held := _curves(results, f"joints/{joint}/reaction", magnitude=True):
            title = f"size of the reaction of joint {joint}"
            yield FigureRecord(name=file_name("reaction", joint), title=title, curves=held, y_label="reaction (N)")


def _torque_speed(results: Results, joint: str, y_label: str, x_label: str) -> Iterator[FigureRecord]:
    curves = []
    for analysis in results.analyses:
        moment, rate = (f"{analysis}/joints/{joint}/{dataset}" for dataset in ("moment", "rate"))
        if results.has(moment) and results.has(rate) and len(results.time(analysis)) > 1:
            curves.append(Curve(data=moment, x=rate, label=analysis))
    if curves:
        yield FigureRecord(
            name=file_name("torque_speed", joint),
            title=f"motor of joint {joint} over its speed",
            kind="torque-speed",
            joint=joint,
            curves=tuple(curves),
            x_label=x_label,
            y_label=y_label,
        )


def _curves(results: Results, dataset: str, *, magnitude: bool = False) -> tuple[Curve, ...]:
    """That dataset of every analysis that has it."""
    names = ((analysis, f"{analysis}/{dataset}") for analysis in results.analyses)
    return tuple(Curve(data=name, label=a, magnitude=magnitude) for a, name in names if results.has(name))


def _stresses(results: Results) -> Iterator[FigureRecord]:
    """Von Mises stress at stress points, and the largest on surfaces."""
    for body in _members(results, "stress"):
        places = [(f"points/{point}/von_mises", point) for point in _stress_points(results, body)]
        for dataset, where in (*places, ("surface/von_mises_max", "surface")):
            if curves := _curves(results, f"stress/{body}/{dataset}"):
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


def _voltages(results: Results) -> Iterator[FigureRecord]:
    limits = {layout["body"]: layout.get("limit") for layout in results.scene.get("pzt", [])}
    for analysis in results.analyses:
        for body in results.names(f"{analysis}/pzt"):
            limit = limits.get(body)
            for dataset, title in (("required_voltage", "voltages required"), ("voltage", "voltages within the limit")):
                yield FigureRecord(
                    name=file_name(dataset, analysis, body),
                    title=f"{title}, patches of {body}, {analysis}",
                    curves=(Curve(data=f"{analysis}/pzt/{body}/{dataset}", label="patch"),),
                    y_label="voltage (V)",
                    limits=() if limit is None else _both_ways(limit),
                )


def _tip_errors(results: Results) -> Iterator[FigureRecord]:
    """Of all closed loops in one figure."""
    curves = tuple(Curve(data=f"{a}/tip_error", label=a) for a in results.analyses if results.has(f"{a}/tip_error"))
    if curves:
        yield FigureRecord(
            name="tip_error", title="tip, distance from its place", curves=curves, y_label="error (mm)", scale=1e3
        )


def _linear(results: Results) -> Iterator[FigureRecord]:
    """Mode shapes of the robot, and the responses of points and joints to each motor and each body's first patch."""
    for analysis in results.analyses:
        if results.has(f"{analysis}/placement"):
            name, title = file_name("placement", analysis), f"patches, {analysis}"
            yield FigureRecord(name=name, title=title, kind="placement", analysis=analysis)
        if not results.has(f"{analysis}/linear"):
            continue
        attributes = results.attributes(f"{analysis}/linear")
        inputs, outputs = ([str(name) for name in attributes[key]] for key in ("input_names", "output_names"))
        yield FigureRecord(
            name=file_name("modes", analysis), title=f"modes, {analysis}", kind="modes", analysis=analysis
        )
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


def _members(results: Results, group: str) -> list[str]:
    """Names in a group of any analysis, each once, in the order of the scene."""
    order = [keys["name"] for table in ("body", "joint") for keys in results.scene.get(table, [])]
    names = dict.fromkeys(name for a in results.analyses for name in results.names(f"{a}/{group}"))
    return sorted(names, key=lambda name: order.index(name) if name in order else len(order))


def _both_ways(limit: float | list[float]) -> tuple[float, ...]:
    """The limits of patches, one for all or one each, in both directions, each once."""
    return tuple(sorted({sign * float(one) for one in np.atleast_1d(limit) for sign in (-1.0, 1.0)}))


def file_name(*parts: str) -> str:
    """A file name: everything but letters, digits, `.` and `-` becomes `_`.

    Letters other than a to z and signs take a few digits of their own besides: names of other scripts stay apart.
    """
    joined = "_".join(parts)
    plain = "".join(c if c.isascii() and (c.isalnum() or c in ".-") else "_" for c in joined)
    lost = any(c != p and c not in " /_" for c, p in zip(joined, plain, strict=True))
    return f"{plain}-{hashlib.sha256(joined.encode()).hexdigest()[:6]}" if lost else plain
