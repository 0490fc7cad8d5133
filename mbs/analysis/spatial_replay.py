"""What an inverse analysis in space found, as functions of time that act again.

Forces are sampled on finer and finer grids until splines through every second value meet the others: samples at the
outputs alone would alias fast modes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, as_floats
from .._core import TimeFunction
from ..fields.waypoints import spline
from ..model.spatial_model import row_values
from ..model.spatial_motors import MotorForces, motor_forces, path_forces
from ..model.spatial_wrench import row_wrenches
from ..scene.analysis import TimedAnalysis, output_times
from ..solve.spatial_posture import robot_size
from .outcome import Outcome

FEWEST_NODES = 401
MOST_NODES = 200_000
CHUNK = 2000  # states that are looked at at once
SHARE = 0.3  # of the tolerance that the splines may take
OFF_PATH = 0.01  # sizes of the robot, rad: a replay that is off by more has left its path
GAIN = 32.0  # at least: by how much half the step makes a quintic spline better (64 where it is smooth)


class Replayed(NamedTuple):
    """Functions of time of each column, and how far they are off (share of the largest value, mean over time).

    Where it `was_stopped`, on request, they are what they are at the start.
    """

    functions: list[TimeFunction]
    unresolved: float
    was_stopped: bool = False


def replay_times(source: Outcome, analysis: TimedAnalysis) -> Array:
    """Output times (T,) of a run under what `source` found, s.

    With what it does before t = 0 and, where the run goes to the end of the path, after that.
    """
    after = source.details.post_actuation if analysis.end == source.analysis.last_time else 0.0
    return output_times(analysis.end, analysis.output_step, source.details.pre_actuation, after)


def replayed(source: Outcome, read: Callable[[Outcome], Array], times: Array, tolerance: float) -> Replayed:
    """What `read` (T, columns) finds of a run over `times` (s), to a share of the tolerance where that can be had."""
    assert source.again is not None
    count = 2 * max(FEWEST_NODES // 2, source.statistics.steps) + 1
    while True:
        nodes = as_floats(np.linspace(times[0], times[-1], count))
        made_again = source.again(nodes)
        if made_again.status == "interrupted":
            at_start = read(source.at(slice(0, 1)))[0]
            return Replayed([TimeFunction.constant(float(value)) for value in at_start], 0.0, was_stopped=True)
        made_again.check_completed()
        values = in_parts(made_again, read)
        peak = float(np.abs(values).max(initial=0.0))
        rough = np.array([f.sample(nodes[1::2])[0] for f in spline(nodes[::2], values[::2])]).T
        off = float(np.abs(rough - values[1::2]).mean(axis=0).max(initial=0.0)) if values.size else 0.0
        unresolved = off / GAIN / peak if peak > 0 else 0.0
        if unresolved <= SHARE * tolerance or 2 * count - 1 > MOST_NODES:
            return Replayed(spline(nodes, values), unresolved)
        count = 2 * count - 1


def motor_forces_of(run: Outcome) -> MotorForces:
    """τ and F_p of a run, its gears rigid (see `mbs.model.spatial_motors`)."""
    return motor_forces(run.model, run.q, supplied_in(run))


def supplied_in(run: Outcome) -> Array:
    """What the paths of a run, or a prescribed shape, take along v (T, n_v)."""
    if run.forces.required is not None:
        return run.forces.required
    return path_forces(run.model, run.time, run.q, run.multipliers)


def path_wrenches(run: Outcome) -> dict[str, Array]:
    """What a path does on its point: force and moment (T, 6) about there, by point, of a run's motion."""
    tree, frames = run.model.tree, run.model.tree.frames(run.q)
    found: dict[str, Array] = {}
    paths = {path.name: path for path in run.model.scene.trajectory if path.point is not None}
    for k, row in enumerate(run.model.rows):
        if not row.is_trajectory or row.owner not in paths:
            continue
        point = paths[row.owner].point
        assert point is not None
        of_a, of_b = row_wrenches(tree, row, -run.multipliers[:, k], run.q, run.time, frames)
        arm = tree.motion(tree.section(point, np.eye(3)), run.q, frames).r
        acting = (of_b if row.a.body < 0 else of_a).seen_from(-arm)
        found[point] = found.get(point, 0.0) + np.hstack([acting.force, acting.moment])
    return found


def in_parts(run: Outcome, read: Callable[[Outcome], Array]) -> Array:
    """`read` of a long run, part by part: Jacobians of all states at once would not fit into memory."""
    return np.concatenate([read(run.at(slice(k, k + CHUNK))) for k in range(0, len(run.time), CHUNK)])


def left_paths(source: Outcome, run: Outcome) -> Iterator[str]:
    """Of a replay under the forces on all rows, which would move as `source` did: a warning where it does not."""
    now = (run.time >= 0.0) & (run.time <= source.time[-1])
    model, times, q = source.model, run.time[now], run.q[now]
    if not len(times):
        return
    sizes = np.array([robot_size(model) if model.measures_way(row) else 1.0 for row in model.rows])
    share = np.abs(row_values(model, q, times)[0]) / sizes
    for path in dict.fromkeys(row.owner for row in model.rows if row.is_trajectory):
        off = share[:, [row.is_trajectory and row.owner == path for row in model.rows]].max(axis=1)
        if off.max() > OFF_PATH:
            yield (
                f'the forces of "{source.analysis.name}" do not follow trajectory "{path}": from t ='
                f" {times[int(np.argmax(off > OFF_PATH))]:.4g} s on the deviation is up to {100 * off.max():.3g} % of"
                " the robot's size, or of 1 rad. Open-loop forces are unstable near singular postures; apply ="
                ' "joints", or a controller, keeps to the path'
            )
