"""The verdict of a results file: what its analyses say, how far points are off their paths, and what to try next."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from ..common.arrays import Array, in_parts
from ..common.peaks import largest, root_mean_square
from ..mbs.quantities.motion import AT_ONCE, section_motion
from ..mbs.run.record import Run
from ..mbs.scene.trajectories import Trajectory
from ..run.result import AnalysisResult, Solution
from .joints import Coordinates, Scene, labelled_coordinates
from .kinds import at_rest_in_words, own_results, read_motors, read_unsupplied
from .peaks import POWER, peak_of
from .verdict import AnalysisVerdict, PatchNeed, Place, Settled, ToolError, Verdict, millimeters, vibrates

if TYPE_CHECKING:
    from ..actuation.motors import MotorFeasibility

SAME = 1e-9  # of a time: what differs by less is round-off
SAME_TIME = 9  # digits of output times (s) that count


def _is_controlled(group: h5py.Group) -> bool:
    return bool(group.attrs["kind"] == "closed-loop")


def write_off_path(group: h5py.Group, solution: Solution, result: AnalysisResult) -> None:
    """Write off_path/: distance of a replay from the paths of its actuation, at outputs and between."""
    source, run = str(group.attrs["actuation"]), result.histories.run
    if source not in solution.analyses or _is_controlled(group) or not len(run.time):
        return
    of, last = group.parent[source], solution.analyses[source].analysis.last_time
    both = np.flatnonzero((run.time >= of["time"][0]) & (run.time <= of["time"][-1] * (1.0 + SAME)))
    time, parts = run.time[both], in_parts(len(both) or 1, AT_ONCE)
    for trajectory in run.model.scene.trajectory:
        if f"trajectories/{trajectory.name}/target" in of and trajectory.point is not None and trajectory.components:
            distance = np.concatenate([_distance(run.at(both[some]), trajectory, last) for some in parts])
            entry = group.create_group(f"off_path/{trajectory.name}")
            entry.attrs.update(point=trajectory.point, distance=largest(time, distance)[0])
            entry.attrs["distance_rms"] = root_mean_square(time, distance)


def _distance(run: Run, trajectory: Trajectory, last: float) -> Array:
    """(T,), m, of its point from where the path has it, which rests before 0 and after `last`, s."""
    position, inside = section_motion(run, str(trajectory.point)).r, np.clip(run.time, 0.0, last)
    off = [position[:, "xyz".index(axis)] - f.sample(inside)[0] for axis, f in trajectory.components.items()]
    return np.linalg.norm(off, axis=0)


def tool_error(group: h5py.Group, scene: Scene, *, feasible: bool | None) -> ToolError:
    """Return the tool error of an analysis; `feasible`: whether motors and patches suffice, by its verdict."""
    if _is_controlled(group) and (about := own_results(group).about(group)):
        return ToolError(controlled=float(about["tip_error_max"]))
    if (replayed := max((most for _, most, _ in off_path(group, scene)), default=None)) is not None:
        return ToolError(open_loop=replayed)
    missed = read_unsupplied(group["feasibility"]) if "feasibility" in group else None
    if missed is not None and missed.point:
        growth = missed.growth if np.isfinite(missed.growth) else 0.0
        return ToolError(missed.angles_kept, missed.moments_repeated, growth)
    if feasible and missed is None:
        return ToolError(max((most for _, most, _ in _apart(group, group, scene)), default=None))
    return ToolError()


def off_path(group: h5py.Group, scene: Scene) -> Iterator[tuple[str, float, float]]:
    """Yield each point of a replay with its largest and RMS distance (m) from its prescribed path.

    Over the time of both and along the axes that the path prescribes; for old files at outputs of both.
    """
    if "off_path" in group:
        for one in group["off_path"].values():
            yield str(one.attrs["point"]), float(one.attrs["distance"]), float(one.attrs["distance_rms"])
        return
    name = str(group.attrs.get("actuation", ""))  # of an analysis that takes none: empty
    if not name or _is_controlled(group):
        return
    if (source := group.parent.get(name)) is not None:
        yield from _apart(group, source, scene)


def _apart(group: h5py.Group, source: h5py.Group, scene: Scene) -> Iterator[tuple[str, float, float]]:
    """Points of `group` from the paths that `source` follows."""
    times, path_times = (one["time"][()].round(SAME_TIME) for one in (group, source))
    shared, now, then = np.intersect1d(times, path_times, return_indices=True)
    for record in scene.get("trajectory", ()):
        point, path = f"points/{record.get('point')}/position", f"trajectories/{record['name']}"
        if not len(shared) or point not in group or f"{path}/target" not in source:
            continue
        places = [(k, "xyz".index(axis)) for k, axis in enumerate(source[path].attrs["components"]) if axis in "xyz"]
        target, position = source[f"{path}/target"][()][then], group[point][()][now]
        off = np.sqrt(sum((position[:, axis] - target[:, k]) ** 2 for k, axis in places))
        if places:
            yield str(record["point"]), float(off.max()), float(np.sqrt(np.mean(off**2)))


FASTER = "amplifiers of more current or slew, or a slower path"
FAR_BEYOND = 10.0  # times their limit: no realistic patch supplies that
STILL = 1e-9  # rad or m: what joints of a robot that does not move do
AT_REST = 0.3  # of the mean rate of a path: what its first and last steps have at most


def judge(file: h5py.File, analyses: Sequence[str], scene: Scene) -> Verdict:
    """The verdict on the `analyses` of a results `file` of a `scene`."""
    return Verdict(tuple(_judge(name, file[name], scene) for name in analyses))


def _judge(name: str, group: h5py.Group, scene: Scene) -> AnalysisVerdict:
    coordinates = labelled_coordinates(scene)
    motors = _motors(group, coordinates)
    units = {label: coordinate.force_unit for label, coordinate in coordinates.items()}
    patches = {body: _patches(entry) for body, entry in group.get("feasibility/pzt", {}).items()}
    answer, feasible = _answer(group, motors, patches)
    answer = answer or ", ".join(
        f"{point} off its path by {millimeters(most)} at most, {millimeters(rms)} RMS"
        for point, most, rms in off_path(group, scene)
    )
    about = group.attrs
    return AnalysisVerdict(
        name=name,
        kind=str(about["kind"]),
        status=str(about["status"]),
        cause=str(about.get("cause", "")),
        reached=(float(group["time"][-1]), end_of(scene, name)),
        answer=answer,
        feasible=feasible,
        motors=motors,
        units=units,
        patches=patches,
        tool_error=tool_error(group, scene, feasible=feasible),
        deflection=None if _ended_early(group) else _deflection(group),
        stress=None if _ended_early(group) else _stress(group),
        margins=_margins(own_results(group).about(group)),
        settled=_settled(group),
        at_rest=at_rest_in_words(group),
        warnings=tuple(map(str, about.get("warnings", ()))),
        notes=tuple(map(str, about.get("notes", ()))),
        advice=tuple(_advice(group, motors, units, patches)),
    )


def end_of(scene: Scene, name: str) -> float:
    """Return the end, s, of the analysis `name`, or of its actuation; 0 for one without duration."""
    keys: Mapping[str, Any] = next((keys for keys in scene.get("analysis", []) if keys["name"] == name), {})
    return float(keys["end"]) if "end" in keys else end_of(scene, keys["actuation"]) if "actuation" in keys else 0.0


def _motors(group: h5py.Group, coordinates: Coordinates) -> "dict[str, MotorFeasibility]":
    """As the analysis judged them; of kinds that do not, such as closed loops, from what their motors did."""
    if "feasibility" in group:
        return read_motors(group["feasibility"], list(coordinates))
    motors, time = {}, group["time"][()]
    for label, coordinate in coordinates.items():
        entry = group.get(f"joints/{coordinate.joint}")
        if entry is not None and "moment" in entry and "rate" in entry:
            from ..actuation.motors import judge_motion

            rate_of = "motor_rate" if "motor_rate" in entry else "rate"
            moment, rate = (coordinate.of(entry[dataset][()]) for dataset in ("moment", rate_of))
            motors[label] = judge_motion(time, moment, rate, coordinate.limits, float(time[-1]))
            if POWER in entry.attrs:
                of_moment, of_rate = entry["moment"].attrs, entry[rate_of].attrs
                motors[label] = replace(
                    motors[label],
                    moment=float(of_moment["peak"]),
                    speed=float(of_rate["peak"]),
                    power=float(entry.attrs[POWER]),
                    moment_time=float(of_moment["peak_time"]),
                    rms_moment=float(of_moment["rms"]),
                )
    return motors


def _patches(entry: h5py.Group) -> PatchNeed:
    factors, since = entry["factor"][()], entry["saturation_time"][()]
    beyond = since[~np.isnan(since)]
    limit = float(entry["remedies"].attrs["limit"])
    return PatchNeed(float(factors.max()), float(beyond.min()) if beyond.size else float("nan"), limit)


def _answer(
    group: h5py.Group, motors: "Mapping[str, MotorFeasibility]", patches: Mapping[str, PatchNeed]
) -> tuple[str, bool | None]:
    """Whether it can be done, in words and as such; of a run that ended early nothing is known of that."""
    own = own_results(group)
    about = own.about(group)
    if about and (answer := own.answer(about)):
        return answer, None
    if "feasibility" not in group or _ended_early(group):
        return "", None
    needs = [(f"motor {name}", motor.factor, motor.saturation_time) for name, motor in motors.items()]
    needs += [(f"patches of {body}", need.factor, need.since) for body, need in patches.items()]
    lacking = [
        f"{name} (required/available = {factor:.3g}, first at t = {since:g} s)"
        for name, factor, since in needs
        if factor > 1.0
    ]
    if lacking:
        return f"limits exceeded: {', '.join(lacking)}; details: ffrobot feasibility", False
    has_limits = any(motor.has_limits for motor in motors.values()) or any(
        np.isfinite(e["available_moment"]).any() for e in group.get("feasibility/pzt", {}).values()
    )
    if (missed := read_unsupplied(group["feasibility"])) is not None:
        means = "motors and patches" if missed.with_patches else "motor torques"
        within = " within their limits" if has_limits else ""
        return f"{means}{within} cannot do it: the path needs other forces on the links, see the warning", False
    within = "within the limits that are given" if has_limits else "no limits are given"
    return f"motors{' and patches' if patches else ''} can do it, {within}{_least_voltage(group)}", True


def _least_voltage(group: h5py.Group) -> str:
    if "tracking" not in group:
        return ""
    about = group["tracking"].attrs
    off = about.get("without_patches", np.nan)
    alone = f"; torques alone are off by {1e3 * off:.3g} mm" if np.isfinite(off) else ""
    limits = [np.ravel(one.attrs["limit"]) for one in group["pzt"].values() if "limit" in one.attrs]
    is_one = not limits or np.unique(np.concatenate(limits)).size == 1
    is_one &= not any("range" in one.attrs for one in group["pzt"].values())
    size = f"{about['least_voltage']:.3g} V" if is_one else f"{100 * about['least_share']:.3g} % of limits"
    if np.isfinite(price := about.get("tolerance_price", np.nan)):
        less = f" with path_tolerance, {1e-3 * price:.3g} V less per mm of it"
        size += less if about["least_voltage"] else ": torques alone stay within path_tolerance"
    return f"; least voltage {size}{alone}"


def _margins(about: Mapping[str, Any]) -> str:
    if "gain_margin" not in about:
        return ""
    if about["delay_margin"] == 0.0:
        return f"margins (linear model): none, spectral radius of the sampled loop {about['spectral_radius']:.6g}"
    gain, delay = float(about["gain_margin"]), float(about["delay_margin"])
    if np.isnan(gain):
        return "margins (linear model): not computed for a delay of so many samples"
    texts = (
        f"gains may grow {gain:.3g}-fold" if np.isfinite(gain) else "gains may grow freely",
        f"the delay by {1e3 * delay:.3g} ms" if np.isfinite(delay) else "the delay by 50 sample times or more",
    )
    return f"margins (linear model): {', '.join(texts)}"


def _ended_early(group: h5py.Group) -> bool:
    return bool(group.attrs["status"] != "completed")


def _deflection(group: h5py.Group) -> Place | None:
    time = group["time"][()]
    points = group.get("points", {}).items()
    places = (_peak(point["deflection"], name, time) for name, point in points if "deflection" in point)
    return max((place for place in places if place[0] > 0.0), default=None)


def _settled(group: h5py.Group) -> Settled | None:
    """Of the point that vibrates most; None where that is next to nothing."""
    keys = ("residual", "frequency", "time_to", "tolerance")
    moving = {name: at.attrs for name, at in group.get("settling", {}).items() if vibrates(at.attrs)}
    settled = (Settled(name, *(float(about[key]) for key in keys)) for name, about in moving.items())
    return max(settled, key=lambda one: one.residual, default=None)


def _stress(group: h5py.Group) -> Place | None:
    time, places = group["time"][()], []
    for body, entry in group.get("stress", {}).items():
        points = entry.get("points", {}).items()
        places += [_peak(point["von_mises"], f"{body}, {name}", time) for name, point in points]
        if "surface" in entry:
            places.append(_peak(entry["surface/von_mises_max"], f"the surface of {body}", time))
    return max(places, default=None)


def _peak(dataset: h5py.Dataset, where: str, time: Array) -> Place:
    value, at = peak_of(dataset, time)
    return value, where, at


def _advice(
    group: h5py.Group,
    motors: "Mapping[str, MotorFeasibility]",
    units: Mapping[str, str],
    patches: Mapping[str, PatchNeed],
) -> Iterator[str]:
    """What to try next, the nearest thing first."""
    asked = "feasibility" in group and not _ended_early(group)
    beyond = [name for name, motor in motors.items() if motor.factor > 1.0]
    for name, motor in motors.items() if asked else ():
        if (motor.jump or motor.moment > motor.moment_limit) and (text := motor.spike_in_words(units[name])):
            yield f"motor of {name}: {text}"
    if beyond and asked:
        joints = (joint["coordinate"][()] for joint in group["joints"].values() if "coordinate" in joint)
        moves = any(np.ptp(one, axis=0).max(initial=0.0) > STILL for one in joints)
        at_rest = [name for name in beyond if not moves or motors[name].static_moment > motors[name].moment_limit]
        if at_rest:
            why = ", whose torques at rest along the path exceed their limits" if moves else ""
            yield f"less load, or another motor or gear for {', '.join(at_rest)}{why}"
        if others := [name for name in beyond if name not in at_rest]:
            slower = "a slower path (fastest = true finds the smallest time-scaling factor)"
            yield f"{slower}, or another motor or gear for {', '.join(others)}"
    from_rest = asked and _is_from_rest_to_rest(group)
    for body, need in patches.items() if asked else ():
        if np.isinf(need.limit):
            yield f"patches of {body}: {FASTER}"
        elif 1.0 < need.factor <= FAR_BEYOND:
            yield f"patches of {body}: a limit of {_number(need.limit)} V is sufficient; others: ffrobot feasibility"
    is_compliant = any("gear_moment" in joint for joint in group.get("joints", {}).values())
    far = [body for body, need in patches.items() if asked and need.factor > FAR_BEYOND and need.limit < np.inf]
    if far and group.attrs["kind"] != "tracking":
        carried = "" if is_compliant else f'kind = "tracking"{"" if from_rest else " on a path from rest to rest"}, or '
        other = "a slower path" if group.attrs["kind"] == "fcid" else 'kind = "fcid" with shape = "static"'
        yield f"{carried}{other}: no realistic patch can supply the voltages of {', '.join(far)}"
    if asked and "trajectories" in group and read_unsupplied(group["feasibility"]) is not None:
        inversion = 'kind = "motors-only", or ' if from_rest else ""
        tracked = "" if is_compliant else ' with kind = "tracking"'
        yield f"{inversion}patches ([[pzt]]) on the links{tracked}"
    about = own_results(group).about(group)
    yield from (texts := [str(text) for text in np.atleast_1d(about.get("advice", ())) if text])
    if asked and not about.get("is_needed", True):
        of = "path_tolerance" if about.get("path_tolerance") else "the tolerance, relative to its length"
        yield f"patches are not needed: torques alone stay on the path within {of}"
    if not texts and _is_controlled(group) and about and about["verdict"] not in ("stable", "not settled"):
        yield "smaller gains, a shorter sample_time, or rotor_inertia in the joints"


def _is_from_rest_to_rest(group: h5py.Group) -> bool:
    """Whether the paths begin and end at rest, as inversion with motors alone needs: next to their mean rates."""
    for entry in group.get("trajectories", {}).values():
        target = entry["target"][()] if "target" in entry else np.zeros((0, 1))
        steps = np.abs(np.diff(target.reshape(len(target), target[:1].size), axis=0))
        if len(steps) and (steps[[0, -1]].max(axis=0) > AT_REST * steps.mean(axis=0)).any():
            return False
    return True


def _number(value: float) -> str:
    """Four digits, large ones in full."""
    return f"{value:.0f}" if 1e4 <= abs(value) < 1e7 else f"{value:.4g}"
