"""Time scaling: the fastest motion along a path at which motors and patches keep their limits.

The first inverse analysis of the scene judges, with flexible links, friction and gears; what is sought is one factor of
the times of all legs (`stretch`). A slower motion is taken to be easier: that is so but for vibrations that one
duration excites more than another, and the motion that is found has been solved for and keeps the limits in any case.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, sqrt

from ..actuation.feasibility import Feasibility
from ..common.errors import InputError, quoted
from ..mbs.joints.transmission import MotorLimits
from ..mbs.scene.analysis import TimedAnalysis
from ..scene.scene import Scene

Judge = Callable[[Scene], Feasibility | None]
"""Solves a scene with the one analysis that it has; None where there is no motion along the path."""

GROWTH = 1.5  # of the stretch, until one is found that is too fast and one that is not
NEAR = 1.005  # ratio of these two at which the search ends
MOST = 64.0  # times faster than the scene says
KEPT = 1.0 + 1e-9  # times a limit


@dataclass
class Search:
    """Motions that were tried, by their stretch: the largest ratio of what is required to a limit, and of what."""

    scene: Scene
    analysis: TimedAnalysis
    judge: Judge
    tried: dict[float, tuple[float, str]] = field(default_factory=dict)

    def keeps_limits(self, stretch: float) -> bool:
        """Whether the motion at this stretch does."""
        if stretch not in self.tried:
            self.tried[stretch] = self._try(stretch)
        return self.tried[stretch][0] <= KEPT

    def _try(self, stretch: float) -> tuple[float, str]:
        found = self.judge(stretched(self.scene, stretch).model_copy(update={"analysis": (self.analysis,)}))
        if found is None:
            return inf, "no motion along the path"
        return max((factor, name) for name, factor in found.factors.items())


def fastest(scene: Scene, judge: Judge) -> tuple[Scene, str]:
    """The scene with its paths stretched by the least factor that keeps all limits, to 0.5 %, and what was found.

    Raises `InputError` where nothing has a limit, no analysis can judge, or the run is too short for any such motion.
    """
    search = Search(scene, judging(scene), judge)
    least, most = _bounds(scene, search.analysis)
    found = least_stretch(search.keeps_limits, least, most)
    if found is None:
        factor, name = search.tried[most]
        raise InputError(
            f"{scene.path}: trajectory {_names(scene)}: fastest: expected actuators that can follow within"
            f' end = {search.analysis.end:g} s of "{search.analysis.name}", found {name}, with required/available ='
            f" {factor:.3g} at stretch = {most:.4g}. A later end helps, unless torques at rest exceed the limits"
        )
    factor, name = search.tried[found]
    at = f"{name} is at {100 * factor:.3g} % of its limit"
    limit = at if found > least else f"the keys of the path limit it, and {at}"
    note = f"{_names(scene)}: fastest at stretch = {found:.4g}, where {limit}; {len(search.tried)} motions tried"
    return stretched(scene, found), note


def least_stretch(keeps_limits: Callable[[float], bool], least: float, most: float) -> float | None:
    """The least stretch in [least, most] that `keeps_limits`, to 0.5 %; None where there is none.

    From 1 on by factors until it lies between two, then halving their ratio.
    """
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
    """The scene with the paths that are to be fastest slowed down by a factor."""
    paths = [one.changed(stretch=stretch, fastest=False) if one.fastest else one for one in scene.trajectory]
    return scene.model_copy(update={"trajectory": tuple(paths)})


def judging(scene: Scene) -> TimedAnalysis:
    """The first inverse analysis. Raises `InputError` where there is none, or nothing to judge by."""
    where = f"{scene.path}: trajectory {_names(scene)}: fastest"
    inverse = [one for one in scene.analysis if one.applicable and isinstance(one, TimedAnalysis)]
    if not inverse:
        raise InputError(
            f"{where}: expected an inverse analysis (pcid, fcid, motors-only) with feasibility results, found none"
        )
    limits = [joint.motor_limits for joint in scene.motor_joints]  # in space one for each coordinate
    limited = any(of != MotorLimits() for each in limits for of in ([each] if isinstance(each, MotorLimits) else each))
    if not limited and not any(layout.limit for layout in scene.pzt):
        raise InputError(f"{where}: expected limits of motors (moment_limit, speed_limit, …) or of patches, found none")
    if any(body.modes == "auto" for body in scene.body):
        raise InputError(
            f'{where}: expected bodies with a number of modes, found modes = "auto": solve once without fastest and'
            " write the numbers of modes that its summary prints"
        )
    return inverse[0]


def _bounds(scene: Scene, analysis: TimedAnalysis) -> tuple[float, float]:
    """Stretches at which the path keeps its own limits, and is over before the run is."""
    one, two = (_end(scene, stretch) for stretch in (1.0, 2.0))
    least = 1.0 if any(path.fastest and path.duration is None for path in scene.trajectory) else 1.0 / MOST
    most = 1.0 + (analysis.end - one) / (two - one)
    if most < least:
        raise InputError(
            f'{scene.path}: trajectory {_names(scene)}: fastest: expected a path that is over before "{analysis.name}"'
            f" ends at {analysis.end:g} s, found one that takes until {one:.4g} s"
        )
    return least, most


def _end(scene: Scene, stretch: float) -> float:
    """When the last of the paths that are to be fastest is over, s."""
    slower = (one.changed(stretch=stretch, fastest=False).path for one in scene.trajectory if one.fastest)
    return max(path.end for path in slower if path is not None)


def _names(scene: Scene) -> str:
    return quoted(one.name for one in scene.trajectory if one.fastest)
