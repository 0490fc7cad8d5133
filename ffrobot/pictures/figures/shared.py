"""Figures that scenes in the plane and in space share, and what the standard figures are made of."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator

import numpy as np

from ...results.file import Results
from ...results.joints import Coordinate, joint_coordinates
from .figure_file import Curve, FigureRecord

SNAPSHOTS = 5
NO_DEFLECTION = 1e-6  # of the largest: points that the reference condition holds are there but for rounding
ENERGIES = ("kinetic", "strain", "gravitational")


def moving_configurations(results: Results) -> Iterator[FigureRecord]:
    """Of the first analysis that goes through time, else the first: in others the robot is hardly elsewhere."""
    moving = [analysis for analysis in results.analyses if len(results.time(analysis)) > 1]
    for analysis in [*moving, *results.analyses][:1]:
        times = results.time(f"{analysis}/time")
        snapshots = np.linspace(times[0], times[-1], SNAPSHOTS if len(times) > 1 else 1)
        yield FigureRecord(
            name=file_name("configurations", analysis),
            title=f"robot postures, {analysis}",
            kind="configurations",
            analysis=analysis,
            times=tuple(float(t) for t in snapshots),
        )


def tip_error_figures(results: Results) -> Iterator[FigureRecord]:
    """Of all closed loops in one figure."""
    curves = tuple(Curve(data=f"{a}/tip_error", label=a) for a in results.analyses if results.has(f"{a}/tip_error"))
    if curves:
        yield FigureRecord(name="tip_error", title="tip position error", curves=curves, y_label="error (mm)", scale=1e3)


def placement_figures(results: Results, analysis: str) -> Iterator[FigureRecord]:
    """Where the patches are that an analysis found, if it sought any."""
    if results.has(f"{analysis}/placement"):
        name, title = file_name("placement", analysis), f"patches, {analysis}"
        yield FigureRecord(name=name, title=title, kind="placement", analysis=analysis)


def joint_figures(results: Results) -> Iterator[FigureRecord]:
    """Coordinates, moments, moments over speed, and size of the reaction, of every joint."""
    for joint in members(results, "joints"):
        for coordinate in joint_coordinates(results.scene, joint):
            yield from _coordinate_figures(results, joint, coordinate)
        if held := curves_of(results, f"joints/{joint}/reaction", magnitude=True):
            title = f"magnitude of the reaction, joint {joint}"
            yield FigureRecord(name=file_name("reaction", joint), title=title, curves=held, y_label="reaction (N)")


def _coordinate_figures(results: Results, joint: str, coordinate: Coordinate) -> Iterator[FigureRecord]:
    """Of one coordinate of a joint: itself, what its motor gives, and that over its speed."""
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
        rate = of_motor if results.has(of_motor) else rate  # behind a gear that gives
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


def energy_figures(results: Results) -> Iterator[FigureRecord]:
    """Energies of every analysis."""
    for analysis in results.analyses:
        curves = tuple(
            Curve(data=f"{analysis}/energy/{kind}", label=kind)
            for kind in ENERGIES
            if results.has(f"{analysis}/energy/{kind}")
        )
        if curves:
            name = file_name("energy", analysis)
            yield FigureRecord(name=name, title=f"energies, {analysis}", curves=curves, y_label="energy (J)")


def curves_of(results: Results, dataset: str, column: str = "", *, magnitude: bool = False) -> tuple[Curve, ...]:
    """That dataset, or a column of it, of every analysis that has it."""
    names = ((analysis, f"{analysis}/{dataset}") for analysis in results.analyses)
    return tuple(Curve(data=name + column, label=a, magnitude=magnitude) for a, name in names if results.has(name))


def voltage_figures(results: Results) -> Iterator[FigureRecord]:
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


def members(results: Results, group: str) -> list[str]:
    """Names in a group of any analysis, each once, in the order of the scene."""
    order = [keys["name"] for table in ("body", "joint") for keys in results.scene.get(table, [])]
    names = dict.fromkeys(name for a in results.analyses for name in results.names(f"{a}/{group}"))
    return sorted(names, key=lambda name: order.index(name) if name in order else len(order))


def bending_points(results: Results, analysis: str | None = None) -> list[str]:
    """Points whose deflection can be told from zero beside that of the others, in one analysis or in any."""
    largest: dict[str, float] = {}
    for each in results.analyses if analysis is None else [analysis]:
        for point in results.names(f"{each}/points"):
            deflection = np.linalg.norm(results[f"{each}/points/{point}/deflection"], axis=1)
            largest[point] = max(largest.get(point, 0.0), float(deflection.max(initial=0.0)))
    visible = NO_DEFLECTION * max(largest.values(), default=0.0)
    return [point for point, value in largest.items() if value > visible]


def both_ways(limit: float | list[float]) -> tuple[float, ...]:
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


def response_figures(results: Results, analysis: str) -> Iterator[FigureRecord]:
    """Of a linear analysis: how points and joints respond to each motor and to the first patch of each layout."""
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
