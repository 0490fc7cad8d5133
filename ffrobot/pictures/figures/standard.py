"""The standard figures of any scene: what is worth seeing of the results that are there."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator

import numpy as np

from ...results.file import Results
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
            *_over_time(results, "trajectories", "force", "force (N), moment (N·m)", "force along trajectory"),
            *_over_time(results, "joints", "moment", "moment (N·m), force (N)", "motor of joint"),
            *_over_time(results, "joints", "reaction", "reaction (N)", "reaction of joint"),
            *_voltages(results),
            *_tip_errors(results),
            *_linear(results),
        ]
    )


def _configurations(results: Results) -> Iterator[FigureRecord]:
    for analysis in results.analyses:
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
                name=file_name("deflection", point), title=title, curves=curves, y_label="deflection (m)"
            )


def _over_time(results: Results, group: str, dataset: str, y_label: str, title: str) -> Iterator[FigureRecord]:
    for member in _members(results, group):
        curves: list[Curve] = []
        for analysis in results.analyses:
            name = f"{analysis}/{group}/{member}/{dataset}"
            if not results.has(name):
                continue
            columns = results.data(name).shape[1]
            curves += [
                Curve(data=f"{name}[{k}]", label=analysis + (f", {'xy'[k]}" if columns == 2 else ""))
                for k in range(columns)
            ]
        if curves:
            name = file_name(dataset, member)
            yield FigureRecord(name=name, title=f"{title} {member}", curves=tuple(curves), y_label=y_label)


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
        yield FigureRecord(name="tip_error", title="tip, distance from its place", curves=curves, y_label="error (m)")


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
    """Names in a group of any analysis, each once."""
    return list(dict.fromkeys(name for a in results.analyses for name in results.names(f"{a}/{group}")))


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
