"""Residual vibration and settling: how far points are from their final position once the commanded motion is over.

The final position is that of the commanded robot at rest: paths at their ends hold, and links, compliant gears and
joints that nothing else holds are in static equilibrium under gravity, payloads and loads. Where the shape of links is
prescribed, too, it is that of the end. It is never read off a motion that may ring.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, PPoly, null_space
from ...common.errors import InputError, SolveError
from ...common.libraries import scipy
from ...common.structs import struct
from .._core import TimeFunction
from ..linear.statics import Statics
from ..model.known_motion import mass_matrices
from ..model.model import Model
from ..run.record import Run
from ..scene.analysis import TimedAnalysis
from ..scene.mechanism import MechanismScene
from ..scene.trajectories import Trajectory
from .motion import section_motion

MOVED = 1e-6  # of the range of a target: by more it is not yet at its end
GRID, ROUNDS = 2001, 3  # times at which a target is compared with its end, and how often between two of them
NEXT = 0.02  # of the run: an instant at which a target changes, or the run ends, this soon after it, ends it exactly
PERIOD = 800  # times of the last period
DEPENDENT = 1e-9  # of the largest singular value of rows: below it they depend on others
FLOOR, FREE = 1e-7, 1e-3  # of the largest stiffness, and of stiffnesses above that: less is none
PARTS = 4  # of an interval between samples


@struct
class Settling:
    """Residual vibration of a point about its final position, that of the commanded robot at rest."""

    residual: float  # m, peak to peak: the largest distance of two places in the last period of `frequency`
    at_path_end: float  # m, distance from the final position then
    at_end: float  # m, the same at the end of the run
    frequency: float  # Hz, the lowest of the commanded robot at rest, or of the loop; NaN where nothing vibrates
    # s, after the path's end, until the distance stays below `tolerance`, for a period at least; NaN where it does not
    time_to: float
    tolerance: float  # m
    path_end: float  # s, when all paths are over


class Rest(NamedTuple):
    """Final commanded posture of a run, rad and m."""

    model: Model  # the robot under its paths
    q: Array  # (n_q,) rad and m
    since: float  # s, when the last path is over
    frequency: float  # Hz, the lowest of that robot there; NaN where nothing vibrates


def commanded_rest(commanding: Run, since: float | None = None) -> Rest | None:
    """The final posture of a run on paths, over at `since`, s, or as `_end` finds.

    None if paths last to its end, the robot can move freely, the run did not complete, or no equilibrium is near its
    last posture.
    """
    analysis, model = commanding.analysis, commanding.details.held or commanding.model
    if not isinstance(analysis, TimedAnalysis) or commanding.status != "completed":
        return None
    end = analysis.last_time
    if since is None:
        ends = [_end(target, end, _breaks(path)) for path in model.scene.trajectory for _, target in path.targets]
        ends += (_end(shape, end, shape.switches()) for _, shape, _ in analysis.prescribed())
        since = max(ends, default=0.0)
    if not since < commanding.time[-1] or not any(row.is_trajectory for row in model.rows):
        return None
    q = commanding.q[-1]
    if analysis.is_algebraic:
        return Rest(model, q, since, _lowest_frequency(model, q, end) or np.nan)
    try:
        q = Statics(model, end).equilibrium(q)
    except (SolveError, InputError):
        return None
    frequency = _lowest_frequency(model, q, end)
    return None if frequency == 0.0 else Rest(model, q, since, frequency)


def _lowest_frequency(model: Model, q: Array, t: float) -> float:
    """Of small vibrations about rest at q (n_q,), Hz, gravity and loads included; NaN where rows hold all.

    0 where rows leave the robot free to move, or the equilibrium is unstable.
    """
    statics, tree = Statics(model, t), model.tree
    at = statics.balance(q, np.arange(tree.n_v))
    free = null_space(at.gradient, DEPENDENT)
    if not free.shape[1]:
        return np.nan
    ways = statics.sizes[:, None] * free
    K, M = free.T @ statics.stiffness(q, at) @ free, ways.T @ mass_matrices(statics.system, q[None], t)[0] @ ways
    K, M, own = (K + K.T) / 2, (M + M.T) / 2, np.abs(K.diagonal())
    scale = 1.0 / np.sqrt(np.maximum(own, FLOOR * max(own.max(), np.finfo(float).tiny)))
    if np.linalg.eigvalsh(scale[:, None] * K * scale)[0] < FREE:
        return 0.0
    return float(np.sqrt(scipy.linalg.eigh(K, M, eigvals_only=True)[0]) / (2 * np.pi))


def _breaks(path: Trajectory) -> Sequence[float]:
    if path.path is not None:
        return [float(t) for t in path.path.breaks]
    return [t for _, target in path.targets for t in target.switches()]


def _end(target: TimeFunction, end: float, breaks: Sequence[float]) -> float:
    """When the target is at its value at `end` for good: at the next of the `breaks`, or `end`, where one is near."""

    def off(times: Array) -> Array:
        return np.abs(target.sample(times)[0] - last)

    first, then = 0.0, end
    last = float(target.sample(np.array([end]))[0][0])
    level = MOVED * float(off(np.linspace(first, then, GRID)).max())
    if not level > 0.0:
        return 0.0
    for _ in range(ROUNDS):
        times = np.linspace(first, then, GRID)
        k = int(np.flatnonzero(off(times) > level)[-1])
        first, then = float(times[k]), float(times[k + 1])
    return next((t for t in sorted([*breaks, end]) if first <= t <= first + NEXT * end), then)


def end_points(scene: MechanismScene, points: Mapping[str, Sequence[str]]) -> Iterator[str]:
    """Yield "BODY.POINT" of tools, points on paths, free tips and payloads; if there are none, the last point.

    `points`: known labels by body.
    """
    joined = {side for joint in scene.joint for side in joint.between}
    tips = (f"{body}.tip" for body, labels in points.items() if "tip" in labels)
    named = [*(tool.reference for tool in scene.tool), *scene.path_points]
    named += [*(tip for tip in tips if tip not in joined), *(str(load.point) for load in scene.payload)]
    known = {f"{body}.{label}" for body, labels in points.items() for label in labels}
    present = [point for point in dict.fromkeys(named) if point in known]
    yield from present or [f"{body}.{labels[-1]}" for body, labels in list(points.items())[-1:] if labels]


def settling(run: Run, rest: Rest, points: Sequence[str], tolerance: float, lowest: float) -> dict[str, Settling]:
    """The residual vibration of `points`, "BODY.POINT", in a run that should end at `rest`.

    `tolerance`, m, is for settling times; `lowest`, Hz, the lowest frequency of the robot or loop, or NaN.
    """
    first = max(int(np.searchsorted(run.time, rest.since, side="right")) - 1, 0)
    still = np.zeros((1, rest.model.tree.n_v))
    at_rest = replace(run, model=rest.model, time=np.zeros(1), q=rest.q[None], v=still)
    settled = {}
    for point in points:
        moving, place = section_motion(run, point), section_motion(at_rest, point).r[0]
        path = scipy.interpolate.CubicHermiteSpline(run.time[first:], moving.r[first:], moving.velocity[first:])
        settled[point] = _settling(path, place, rest.since, tolerance, lowest)
    return settled


def _settling(path: PPoly, place: Array, since: float, tolerance: float, lowest: float) -> Settling:
    """Of a point on its `path` (m, by s), by the distance from its final `place` (d,)."""

    def off(t: Array | float) -> Array:
        return np.linalg.norm(path(t) - place, axis=-1)

    end = float(path.x[-1])
    window = min(1.0 / lowest, end - since) if lowest > 0.0 else end - since
    last = path(np.linspace(end - window, end, PERIOD))
    residual = max(float(np.linalg.norm(last - one, axis=1).max()) for one in last)
    knots = np.append(since, path.x[path.x > since])
    times = np.interp(np.arange(PARTS * (len(knots) - 1) + 1) / PARTS, np.arange(len(knots)), knots)
    beyond, time_to = np.flatnonzero(off(times) > tolerance), 0.0
    if beyond.size and times[beyond[-1]] + window > end:
        time_to = np.nan
    elif beyond.size:
        near = times[beyond[-1] : beyond[-1] + 2]
        time_to = float(scipy.optimize.brentq(lambda t: float(off(t)) - tolerance, *near)) - since
    return Settling(
        residual=residual,
        at_path_end=float(off(since)),
        at_end=float(off(end)),
        frequency=lowest,
        time_to=time_to,
        tolerance=tolerance,
        path_end=since,
    )
