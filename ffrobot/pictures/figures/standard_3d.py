"""The standard figures of scenes in space: those of the plane, by components, and modal coordinates and energies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...results.file import Results
from .figure_file import Curve, FigureRecord
from .shared import (
    bending_points,
    energy_figures,
    file_name,
    joint_figures,
    moving_configurations,
    placement_figures,
    response_figures,
    tip_error_figures,
    voltage_figures,
)

AXES = "xyz"
SEEN = 1e-3  # of the largest component of a deflection: smaller ones are the line at zero
FORCES, MOMENTS = ("x", "y", "z"), ("about x", "about y", "about z")


def figures_3d(results: Results) -> tuple[FigureRecord, ...]:
    """Configurations, paths, deflections, modes, forces, moments and energies; analyses are laid over each other."""
    return tuple(
        [
            *moving_configurations(results),
            *_paths(results),
            *tip_error_figures(results),
            *_deflections(results),
            *_modes(results),
            *_trajectory_forces(results),
            *joint_figures(results),
            *energy_figures(results),
            *voltage_figures(results),
            *_responses(results),
        ]
    )


def _responses(results: Results) -> Iterator[FigureRecord]:
    for analysis in results.analyses:
        yield from placement_figures(results, analysis)
        if results.has(f"{analysis}/linear"):
            yield from response_figures(results, analysis)


def _paths(results: Results) -> Iterator[FigureRecord]:
    """Where the point of every trajectory should go and where it went, component by component over time."""
    for trajectory in results.scene.get("trajectory", []):
        name, point = trajectory["name"], trajectory.get("point")
        groups = (f"{a}/trajectories/{name}" for a in results.analyses if point is not None)
        group = next((group for group in groups if results.has(f"{group}/target")), None)
        if group is None:
            continue
        components = _components(results, group)
        curves = [Curve(data=f"{group}/target[{k}]", label=f"prescribed path, {c}") for k, c in enumerate(components)]
        for analysis in results.analyses:
            curves += _by_axis(f"{analysis}/points/{point}/position", analysis, [AXES.index(c) for c in components])
        if components:
            title = f"path of {point}"
            yield FigureRecord(name=file_name("path", name), title=title, curves=tuple(curves), y_label="position (m)")


def _deflections(results: Results) -> Iterator[FigureRecord]:
    """By axes of the body; components that cannot be told from zero are left out."""
    for point in bending_points(results):
        datasets = [f"{a}/points/{point}/deflection" for a in results.analyses if results.has(f"{a}/points/{point}")]
        largest = np.max([np.abs(results[name]).max(axis=0) for name in datasets], axis=0)
        shown = [k for k in range(3) if largest[k] > SEEN * largest.max()]
        curves = [curve for name in datasets for curve in _by_axis(name, name.split("/")[0], shown)]
        if curves:
            yield FigureRecord(
                name=file_name("deflection", point),
                title=f"deflection of {point}, axes of the body",
                curves=tuple(curves),
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
    """What holds points on their paths: forces on the point by x, y, z, and moments on its section."""
    for trajectory in results.scene.get("trajectory", []):
        name = trajectory["name"]
        forces: list[Curve] = []
        moments: list[Curve] = []
        for analysis in results.analyses if "point" in trajectory else ():
            group = f"{analysis}/trajectories/{name}"
            if not results.has(f"{group}/force"):
                continue
            components, rows = _components(results, group), results.data(f"{group}/force").shape[1]
            turning = rows - len(components)
            labels = MOMENTS if turning == 3 else [f"orientation component {k + 1}" for k in range(turning)]
            for k, label in enumerate([*components, *labels]):
                curve = Curve(data=f"{group}/force[{k}]", label=f"{analysis}, {label}")
                (forces if k < len(components) else moments).append(curve)
        for kind, unit, curves in (("force", "N", forces), ("path_moment", "N·m", moments)):
            if curves:
                what = kind.removeprefix("path_")
                title, y_label = f"{what} along trajectory {name}", f"{what} ({unit})"
                yield FigureRecord(name=file_name(kind, name), title=title, curves=tuple(curves), y_label=y_label)


def _components(results: Results, group: str) -> list[str]:
    """Of x, y, z, those that a trajectory of a point specifies."""
    return [str(each) for each in results.attributes(group)["components"] if str(each) in FORCES]


def _by_axis(dataset: str, label: str, axes: Sequence[int]) -> list[Curve]:
    return [Curve(data=f"{dataset}[{k}]", label=f"{label}, {AXES[k]}") for k in axes]
