"""Time scaling: the fastest motion along a path at which motors and patches keep their limits.

The first inverse analysis of the scene judges; one factor of the times of all legs (`stretch`) is sought. A slower
motion is taken to be easier, which is so but for vibrations; the motion that is found has been solved for and keeps the
limits in any case.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, sqrt
from typing import TYPE_CHECKING

from ..common.errors import InputError, quoted
from ..mbs.joints.joint import MotorLimits
from ..mbs.linear.vibration import frequencies_along
from ..mbs.model.model import Model
from ..mbs.scene.analysis import TimedAnalysis
from ..mbs.scene.trajectories import Shaper
from ..scene.plausibility import remarks_on_times
from ..scene.scene import Scene

if TYPE_CHECKING:
    from ..actuation.feasibility import Feasibility

    Judge = Callable[[Scene], Feasibility | None]
    """Solves a scene with the one analysis that it has; None where there is no motion along the path."""

GROWTH = 1.5  # of the stretch, until one is found that is too fast and one that is not
NEAR = 1.005  # ratio of these two at which the search ends
MOST = 64.0  # times faster than the scene says
KEPT = 1.0 + 1e-9  # times a limit


@dataclass
class Search:
    """Search for the least factor of the path's times, `stretch`, at which motors and patches keep their limits.

    `tried`, by stretch: the largest ratio of requirement to limit, and its actuator. `judge` finds these of a scene.
    """

    scene: Scene
    analysis: TimedAnalysis
    judge: "Judge"
    tried: dict[float, tuple[float, str]] = field(default_factory=dict)
    too_weak: tuple[str, ...] = ()  # motors whose torques at rest along the last motion exceed their limits

    def keeps_limits(self, stretch: float) -> bool:
        """Whether all actuators keep their limits in the motion with its times multiplied by `stretch`."""
        if stretch not in self.tried:
            feasibility = self.judge(stretched(self.scene, stretch).model_copy(update={"analysis": (self.analysis,)}))
            factors = {"no motion along the path": inf} if feasibility is None else feasibility.factors
            self.tried[stretch] = max((factor, name) for name, factor in factors.items())
            motors = {} if feasibility is None else feasibility.motors
            self.too_weak = tuple(name for name, one in motors.items() if one.static_moment > one.moment_limit)
        return self.tried[stretch][0] <= KEPT


def fastest(scene: Scene, judge: "Judge") -> tuple[Scene, str]:
    """The scene with its paths stretched by the least factor (to 0.5 %) that keeps all limits, and a note on it.

    `judge` returns the feasibility of a scene. Raises `InputError` where nothing has a limit, no analysis can judge, or
    the run is too short for any such motion.
    """
    search = Search(scene, judging(scene), judge)
    least, most = _bounds(scene, search.analysis)
    stretch = least_stretch(search.keeps_limits, least, most)
    if stretch is None:
        factor, name = search.tried[most]
        helps = (
            "No slower path helps, as torques at rest exceed limits: less load, or another motor or gear for"
            f" {', '.join(search.too_weak)}"
            if search.too_weak
            else "A later end helps"
        )
        raise InputError(
            f"{_where(scene)}: expected actuators that can follow within end = {search.analysis.end:g} s of"
            f' "{search.analysis.name}"',
            f"{name}, with required/available = {factor:.3g} at stretch = {most:.4g}. {helps}",
        )
    factor, name = search.tried[stretch]
    at = f"{name} is at {100 * factor:.3g} % of its limit"
    limit = at if stretch > least else f"the keys of the path limit it, and {at}"
    note = f"{_names(scene)}: fastest at stretch = {stretch:.4g}, where {limit}; {len(search.tried)} motions tried"
    return stretched(scene, stretch), note


def least_stretch(keeps_limits: Callable[[float], bool], least: float, most: float) -> float | None:
    """The least factor of times in [least, most] with which `keeps_limits`, to 0.5 %, or None."""
    stretch, good, bad = min(max(1.0, least), most), 0.0, 0.0
    while not (good and bad):
        if keeps_limits(stretch):
            good, following = stretch, max(least, stretch / GROWTH)
        else:
            bad, following = stretch, min(most, stretch * GROWTH)
        if following == stretch:  # at a bound
            return good or None
        stretch = following
    while good > NEAR * bad:
        middle = sqrt(good * bad)
        good, bad = (middle, bad) if keeps_limits(middle) else (good, middle)
    return good


def stretched(scene: Scene, stretch: float) -> Scene:
    """The scene with the times of its paths with `fastest` multiplied by `stretch`."""
    paths = [one.changed(stretch=stretch, fastest=False) if one.fastest else one for one in scene.trajectory]
    return scene.model_copy(update={"trajectory": tuple(paths)})


def judging(scene: Scene) -> TimedAnalysis:
    """The first inverse analysis of a scene. Raises `InputError` where there is none, or nothing to judge by."""
    where = _where(scene)
    inverse = [one for one in scene.analysis if one.applicable and isinstance(one, TimedAnalysis)]
    if not inverse:
        raise InputError(
            f"{where}: expected an inverse analysis (pcid, fcid, motors-only) with feasibility results", "none"
        )
    limited = any(of != MotorLimits() for joint in scene.motor_joints for of in joint.motor_limits)
    if not limited and not any(layout.limit or layout.amplifier for layout in scene.pzt):
        raise InputError(f"{where}: expected limits of motors (moment_limit, speed_limit, …) or of patches", "none")
    if any(body.modes == "auto" for body in scene.body):
        raise InputError(
            f"{where}: expected bodies with a number of modes",
            'modes = "auto": solve once without fastest and write the numbers of modes that its summary prints',
        )
    return inverse[0]


def _bounds(scene: Scene, analysis: TimedAnalysis) -> tuple[float, float]:
    """Stretches at which the path keeps its own limits, and is over before the run is."""
    one, two = (_end(scene, stretch) for stretch in (1.0, 2.0))
    least = 1.0 if any(path.fastest and path.duration is None for path in scene.trajectory) else 1.0 / MOST
    most = 1.0 + (analysis.end - one) / (two - one)
    if most < least:
        raise InputError(
            f'{_where(scene)}: expected a path that is over before "{analysis.name}" ends at {analysis.end:g} s',
            f"one that takes until {one:.4g} s",
        )
    return least, most


def _end(scene: Scene, stretch: float) -> float:
    """When the last of the paths that are to be fastest is over, s."""
    slower = (one.changed(stretch=stretch, fastest=False).path for one in scene.trajectory if one.fastest)
    return max(path.end for path in slower if path is not None)


def _where(scene: Scene) -> str:
    return f"{scene.path}: trajectory {_names(scene)}: fastest"


def _names(scene: Scene) -> str:
    return quoted(one.name for one in scene.trajectory if one.fastest)


def with_paths(
    scene: Scene, model: Model, judge: "Judge", stage: Callable[[str], None]
) -> tuple[Scene, tuple[str, ...]]:
    """Return the scene with shapers for its frequencies and paths stretched to be `fastest`, and remarks.

    Shapers are for the frequencies of `model`. `judge` returns the feasibility of a scene. `stage` is called with the
    name of each step. Raises `InputError` where there are no such frequencies, or no motion keeps the limits.
    """
    tables = [(one, one.waypoints) for one in scene.trajectory if one.waypoints is not None]
    notes = list(dict.fromkeys(remark for _, table in tables for remark in table.remarks))
    splines = ((one.name, table.abrupt_hold) for one, table in tables if one.profile in (None, "spline"))
    notes += [f'trajectory "{name}": {hold}' for name, hold in splines if hold]
    asking = ((one.name, of) for one in scene.trajectory if (of := one.shaper) and of.kind != "none")
    shapers = {name: shaper for name, shaper in asking if shaper.frequency is None}
    given = scene
    if shapers:
        paths = [path for one in scene.trajectory if (path := one.path) is not None]
        begin, end = min(path.begin for path in paths), max(path.end for path in paths)
        frequencies, ratios = frequencies_along(model, begin, end, max(shaper.modes for shaper in shapers.values()))
        for name, shaper in shapers.items():  # for the mean frequencies and damping along the path
            f, ratio = frequencies[:, : shaper.modes], shaper.damping_ratio
            ranges = (f"{one.mean():.4g} Hz ({one.min():.4g} to {one.max():.4g} along the path)" for one in f.T)
            notes.append(f"{name}: {shaper.kind} shaper for {', '.join(ranges)}")
            if ratio is None:
                ratio = tuple(ratios[:, : shaper.modes].mean(axis=0))
            shapers[name] = Shaper(kind=shaper.kind, frequency=tuple(f.mean(axis=0)), damping_ratio=ratio)
        changed = [one.changed(shaper=shapers[one.name]) if one.name in shapers else one for one in scene.trajectory]
        scene = scene.model_copy(update={"trajectory": tuple(changed)})
    if any(trajectory.fastest for trajectory in scene.trajectory):
        stage("fastest motion")
        scene, note = fastest(scene, judge)
        notes.append(note)
    if scene is not given:
        notes += remarks_on_times(scene)
    return scene, tuple(notes)
