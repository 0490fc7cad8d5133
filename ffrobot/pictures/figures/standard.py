"""The standard figures of any scene, as far as its results have the data."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain, islice
from typing import Any

import numpy as np

from ...results.file import Results
from ...results.joints import Coordinate, joint_coordinates, labelled_coordinates
from .shared import Curve, FigureRecord, bending_points, both_ways, curves_of, file_name, members

ROUND_OFF = 1e-9  # rad: bodies that turn no further do not turn; of the largest modal coordinates and forces
SEEN = 5e-3  # of the largest: smaller components of deflections, differences of voltages, are invisible
TOGETHER = 2  # runs of which a figure has all components
AXES = "xyz"
ABOUT = {"mx": "about x", "my": "about y", "mz": "about z"}


def main_figures(results: Results) -> tuple[FigureRecord, ...]:
    """Return figures of robot, paths, motors, largest deflections, stresses, voltages, modes, first response."""
    return _drawn(results, MAIN)


def standard_figures(results: Results, runs: int | None = None) -> tuple[FigureRecord, ...]:
    """Return the main figures, then angles, modes, forces, reactions, energies, other points and responses.

    `runs`: number of analyses that are drawn together, if of several files.
    """
    main = _drawn(results, MAIN, runs)
    return main + tuple(record for record in _drawn(results, OTHERS, runs) if record not in main)


def _drawn(results: Results, of: "Figures", runs: int | None = None) -> tuple[FigureRecord, ...]:
    """The figures of `of`, without histories of a single instant: static analyses have numbers, no curves."""
    drawn: list[FigureRecord] = []
    for record in chain.from_iterable(figures(results) for figures in of):
        curves = tuple(curve for curve in record.curves if len(results.time(curve.data)) > 1)
        if curves or not record.curves:
            drawn += _apart(record.model_copy(update={"curves": curves}), runs)
    return tuple(drawn)


def _apart(record: FigureRecord, runs: int | None) -> list[FigureRecord]:
    """A figure for each component, the end of the labels of its curves, where many runs have several."""
    parts: dict[str, list[Curve]] = {}
    for curve in record.curves:
        run, comma, axis = curve.label.rpartition(", ")
        if comma and curve.data.endswith("]"):  # of a column, whose axis the label has; names may have commas, too
            parts.setdefault(axis, []).append(curve.model_copy(update={"label": run}))
        else:
            parts.setdefault("", []).append(curve)
    if len(parts) < 2 or (runs or max(map(len, parts.values()))) <= TOGETHER:
        return [record]
    apart = []
    for axis, curves in parts.items():
        name, title = file_name(record.name, axis), f"{record.title}, {axis}"
        apart.append(record.model_copy(update={"name": name, "title": title, "curves": tuple(curves)}))
    return apart


def _histories(
    name: Sequence[str], title: str, curves: Iterable[Curve], y_label: str, **more: Any
) -> Iterator[FigureRecord]:
    if drawn := tuple(curves):
        yield FigureRecord(name=file_name(*name), title=title, curves=drawn, y_label=y_label, **more)


def _of_analysis(kind: str, title: str, analysis: str, *names: str, **more: Any) -> FigureRecord:
    more |= {"kind": kind, "name": file_name(kind, analysis, *names)}
    return FigureRecord(title=f"{title}, {analysis}", analysis=analysis, **more)


def _configurations(results: Results) -> Iterator[FigureRecord]:
    """Configurations in the first analysis over time, else in the first: others hardly differ."""
    moving = [analysis for analysis in results.analyses if len(results.time(analysis)) > 1]
    for analysis in [*moving, *results.analyses][:1]:
        outputs = results.time(analysis)
        snapshots = np.linspace(outputs[0], outputs[-1], 5 if len(outputs) > 1 else 1)
        yield _of_analysis("configurations", "robot postures", analysis, times=tuple(map(float, snapshots)))


def _paths(results: Results) -> Iterator[FigureRecord]:
    """Prescribed and actual paths of points: in the plane, else by component over time."""
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
        kind, y_label = ("path", "y (m)") if whole else ("time", "position (m)")
        yield from _histories(("path", name), f"path of {point}", curves, y_label, kind=kind)


def _tip_errors(results: Results) -> Iterator[FigureRecord]:
    curves = curves_of(results, "tip_error")
    yield from _histories(("tip_error",), "tip position error", curves, "error (mm)", scale=1e3)


def _path_errors(results: Results) -> Iterator[FigureRecord]:
    """Of paths that points may leave by a tolerance."""
    for analysis in results.analyses:
        part = f"{analysis}/tracking"
        limit = results.attributes(part).get("path_tolerance", 0.0) if results.has(part) else 0.0
        for name in results.names(f"{analysis}/trajectories") if limit else ():
            group = f"{analysis}/trajectories/{name}"
            components = enumerate(_components(results, group))
            curves = [Curve(data=f"{group}/error[{k}]", label=c) for k, c in components if c in AXES]
            title, limits = f"path error of {name}, {analysis}", both_ways(1e3 * limit)
            yield from _histories(("path_error", analysis, name), title, curves, "error (mm)", scale=1e3, limits=limits)


def _angles(results: Results) -> Iterator[FigureRecord]:
    for body in members(results, "bodies"):
        curves = curves_of(results, f"bodies/{body}/angle")
        if any(np.ptp(results.data(curve.data)) > ROUND_OFF for curve in curves):
            yield from _histories(("angle", body), f"angle of {body}", curves, "angle (rad)")


def _largest_deflections(results: Results) -> Iterator[FigureRecord]:
    """Of the point of each body that deflects most in any analysis."""
    largest: dict[str, tuple[float, str]] = {}
    for point in bending_points(results):
        size = max(np.abs(results[curve.data]).max() for curve in curves_of(results, f"points/{point}/deflection"))
        body = point.split(".")[0]
        largest[body] = max(largest.get(body, (0.0, "")), (float(size), point))
    return _deflections(results, [point for _, point in largest.values()])


def _deflections(results: Results, points: Iterable[str] | None = None) -> Iterator[FigureRecord]:
    """By axes of the body; components that are zero but for round-off are left out."""
    for point in bending_points(results) if points is None else points:
        whole = curves_of(results, f"points/{point}/deflection")
        largest = np.max([np.abs(results[curve.data]).max(axis=0) for curve in whole], axis=0)
        shown = [k for k in range(len(largest)) if largest[k] > SEEN * largest.max()]
        curves = (Curve(data=f"{c.data}[{k}]", label=f"{c.label}, {AXES[k]}") for c in whole for k in shown)
        # A single curve has no legend that names its axis.
        where = f" along {AXES[shown[0]]} of the body" if len(shown) == 1 else ", axes of the body"
        title = f"deflection of {point}{where}"
        yield from _histories(("deflection", point), title, curves, "deflection (mm)", scale=1e3)


def _modes(results: Results) -> Iterator[FigureRecord]:
    """Modal coordinates, and the modal forces that patches would have to supply; where motors suffice, none."""
    quantities = (
        ("modal", "modal coordinates", "modal coordinate (m·√kg)"),
        ("modal_force", "required modal forces", "modal force (N/√kg)"),
    )
    for analysis in results.analyses:
        of_motors = results.attributes(analysis)["kind"] == "motors-only"  # forces are round-off
        for body in results.names(f"{analysis}/bodies"):
            for dataset, title, y_label in quantities[:1] if of_motors else quantities:
                data = f"{analysis}/bodies/{body}/{dataset}"
                curves = curves_of(results, f"bodies/{body}/{dataset}")
                sizes = {each.data: np.abs(results.data(each.data)).max(initial=0.0) for each in curves}
                if sizes.get(data, 0.0) > ROUND_OFF * max(sizes.values(), default=0.0):
                    curve, of = Curve(data=data, label="mode"), f"{title} of {body}, {analysis}"
                    yield from _histories((dataset, analysis, body), of, [curve], y_label)


def _trajectory_forces(results: Results) -> Iterator[FigureRecord]:
    """Forces that keep points and angles on their paths, except those along joints: torques of their motors."""
    for trajectory in results.scene.get("trajectory", []):
        name, joint = trajectory["name"], trajectory.get("joint")
        slides = any(coordinate.unit == "m" for coordinate in joint_coordinates(results.scene, str(joint)))
        forces: list[Curve] = []
        moments: list[Curve] = []
        for analysis in results.analyses:
            group = f"{analysis}/trajectories/{name}"
            if not results.has(f"{group}/force") or (joint and results.has(f"{analysis}/joints/{joint}/moment")):
                continue
            components = _components(results, group)
            for k, component in enumerate(components):
                axis = f", {ABOUT.get(component, component)}" if len(components) > 1 else ""
                is_force = component in AXES if "point" in trajectory else slides
                (forces if is_force else moments).append(Curve(data=f"{group}/force[{k}]", label=analysis + axis))
        for kind, what, unit, curves in (
            ("force", "force", "N", forces),
            ("path_moment" if "point" in trajectory else "force", "torque", "N·m", moments),
        ):
            yield from _histories((kind, name), f"{what} along trajectory {name}", curves, f"{what} ({unit})")


def _components(results: Results, group: str) -> list[str]:
    return [str(each) for each in results.attributes(group)["components"]]


def _actuators(results: Results) -> Iterator[FigureRecord]:
    """What drives the robot: its motors, or without any the forces along its trajectories."""
    motors = list[FigureRecord]()
    for label, coordinate in labelled_coordinates(results.scene).items():
        limit = coordinate.limits.moment
        driven = curves_of(results, f"joints/{coordinate.joint}/moment", coordinate.column)
        limits = both_ways(limit) if np.isfinite(limit) else ()
        motors += _histories(("moment", label), f"motor of joint {label}", driven, _force(coordinate), limits=limits)
        if np.isfinite([coordinate.limits.speed, coordinate.limits.power]).any():
            motors += _torque_speed(results, label, coordinate)
    yield from motors or _trajectory_forces(results)


def _joints(results: Results) -> Iterator[FigureRecord]:
    for label, coordinate in labelled_coordinates(results.scene).items():
        moved = curves_of(results, f"joints/{coordinate.joint}/coordinate", coordinate.column)
        if any(np.ptp(results.data(curve.data)) for curve in moved):
            y_label = f"{'angle' if coordinate.unit == 'rad' else 'displacement'} ({coordinate.unit})"
            yield from _histories(("coordinate", label), f"joint {label}", moved, y_label)
        yield from _torque_speed(results, label, coordinate)
    for joint in members(results, "joints"):
        curves = curves_of(results, f"joints/{joint}/reaction", magnitude=True)
        yield from _histories(("reaction", joint), f"magnitude of the reaction, joint {joint}", curves, "reaction (N)")


def _force(coordinate: Coordinate) -> str:
    return f"{'torque' if coordinate.unit == 'rad' else 'force'} ({coordinate.force_unit})"


def _torque_speed(results: Results, label: str, coordinate: Coordinate) -> Iterator[FigureRecord]:
    curves, joint = [], coordinate.joint
    for analysis in results.analyses:
        moment, rate, of_motor = (f"{analysis}/joints/{joint}/{key}" for key in ("moment", "rate", "motor_rate"))
        rate = of_motor if results.has(of_motor) else rate  # behind a compliant gear
        if results.has(moment) and results.has(rate) and len(results.time(analysis)) > 1:
            curves.append(Curve(data=moment + coordinate.column, x=rate + coordinate.column, label=analysis))
    about = {"kind": "torque-speed", "joint": joint, "x_label": f"speed ({coordinate.unit}/s)"}
    title = f"torque–speed curve, joint {label}"
    yield from _histories(("torque_speed", label), title, curves, _force(coordinate), **about)


def _stresses(results: Results) -> Iterator[FigureRecord]:
    for body in members(results, "stress"):
        points = (point for a in results.analyses for point in results.names(f"{a}/stress/{body}/points"))
        places = [(f"points/{point}/von_mises", point) for point in dict.fromkeys(points)]
        for dataset, where in (*places, ("surface/von_mises_max", "surface")):
            curves = curves_of(results, f"stress/{body}/{dataset}")
            title = f"stress in {body}, {'largest on its surface' if where == 'surface' else where} (von Mises)"
            yield from _histories(("stress", body, where), title, curves, "stress (MPa)", scale=1e-6)


def _energies(results: Results) -> Iterator[FigureRecord]:
    for analysis in results.analyses:
        kinds = ("kinetic", "strain", "gravitational")
        curves = (Curve(data=of, label=kind) for kind in kinds if results.has(of := f"{analysis}/energy/{kind}"))
        yield from _histories(("energy", analysis), f"energies, {analysis}", curves, "energy (J)")


def _voltages(results: Results) -> Iterator[FigureRecord]:
    limits = {layout.get("name", layout["body"]): layout.get("limit") for layout in results.scene.get("pzt", [])}
    for analysis in results.analyses:
        if results.attributes(analysis)["kind"] == "motors-only":
            continue  # round-off
        for body in results.names(f"{analysis}/pzt"):
            group = f"{analysis}/pzt/{body}"
            required = results.data(f"{group}/required_voltage")
            top = np.abs(required).max()
            cut = np.abs(results.data(f"{group}/voltage") - required).max() > SEEN * top
            limit = () if limits.get(body) is None else both_ways(limits[body])
            for key, what, is_shown in (
                ("required_voltage", "required voltages", top > 0.0),
                ("voltage", "voltages within the limit", cut),
            ):
                curves = [Curve(data=f"{group}/{key}", label="patch")] if is_shown else []
                title = f"{what}, patches of {body}, {analysis}"
                yield from _histories((key, analysis, body), title, curves, "voltage (V)", limits=limit)


def _linear(results: Results) -> Iterator[FigureRecord]:
    """Places of patches; of linear models the mode shapes of the robot, and responses to the first input."""
    for analysis in results.analyses:
        if results.has(f"{analysis}/placement"):
            yield _of_analysis("placement", "patches", analysis)
        if results.has(f"{analysis}/linear"):
            yield _of_analysis("modes", "modes", analysis)
            yield from islice(_responses_of(results, analysis), 1)


def _responses(results: Results) -> Iterator[FigureRecord]:
    for analysis in results.analyses:
        if results.has(f"{analysis}/linear"):
            yield from _responses_of(results, analysis)


def _responses_of(results: Results, analysis: str) -> Iterator[FigureRecord]:
    """How points and joints respond to each motor and to the first patch of each layout."""
    attributes = results.attributes(f"{analysis}/linear")
    inputs, outputs = ([str(name) for name in attributes[key]] for key in ("input_names", "output_names"))
    for source in inputs:
        is_first = source.startswith("joint/") or (source.startswith("pzt/") and source.endswith("/1"))
        seen = tuple((source, name) for name in outputs if name.startswith("point/") or name == source)
        if is_first and seen:
            title, y_label = f"response to {source}", "magnitude (m, rad per N·m, V)"
            yield _of_analysis("bode", title, analysis, source.replace("/", "_"), transfers=seen, y_label=y_label)


Figures = tuple[Callable[[Results], Iterator[FigureRecord]], ...]
MAIN: Figures = (
    _configurations,
    _paths,
    _tip_errors,
    _path_errors,
    _actuators,
    _largest_deflections,
    _stresses,
    _voltages,
    _linear,
)
OTHERS: Figures = (_angles, _deflections, _modes, _trajectory_forces, _joints, _energies, _responses)
"""In this order."""
