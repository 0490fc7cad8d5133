"""What an inverse analysis found, at any time of it, to act again in other runs. SI units.

Steps that were recorded are made again, stage by stage where another run has the same ones; prescribed motions are
solved anew.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...common.arrays import Array
from .. import _core
from .._core import TimeFunction
from ..fields.waypoints import spline
from ..model.model import Model
from ..model.nodes import ConstraintRow
from ..model.projection import EXACT
from ..model.system import MultibodySystem, driven_mechanism, frames_in_core, integrated_mechanism
from ..scene.analysis import TimedAnalysis, output_times
from ..scene.loads import OF_POINT
from .context import PatchedLink, PointsOfBody
from .record import Run

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

PARTS = 20  # of each piece of a curve, between which it is linear where limits cut it
OFF_PATH = 0.01  # sizes of the robot, rad: a replay that is off by more has left its path

Reader = Callable[[Any], Any]
"""Makes what reads forces of the states of a `_core.PlanarDriven`, or of a `_core.SpatialDriven`."""


def replay_times(source: Run, analysis: TimedAnalysis) -> Array:
    """Output times (T,), s, of a replay of `source`, with its pre- and post-actuation."""
    after = source.details.post_actuation if analysis.end == source.analysis.last_time else 0.0
    return output_times(analysis.end, analysis.output_step, source.details.pre_actuation, after)


def supplied(run: Run, most: Array, patches: Mapping[str, PatchedLink], *, limited: bool) -> _core.ForceSource:
    """Return the forces that `run` found, for the core to apply: of motors, N·m or N, then voltages of `patches`, V.

    Motors, in the order of `Model.motors`, act on the joints' second bodies with at most `most` (motors,), N·m or N.
    `limited`: voltages stay within the ranges of amplifiers.
    """
    if run.prescribed is not None and run.prescribed.voltages:
        torques = _found(run, lambda driven: _core.actuator_reader(driven, most, []))
        voltages: list[TimeFunction] = []
        for name, of_link in patches.items():
            ends = of_link.amplifiers.range if limited else ()
            voltages += functions_within(run.prescribed.voltages[name], *ends)
        return _core.ForcesOfBoth(torques, _core.ForcesOfTime(voltages)) if voltages else torques
    links = [(*_reached(run.model, of.to_reached), of.allocation(limited=limited)) for of in patches.values()]
    return _found(run, lambda driven: _core.actuator_reader(driven, most, links), MultibodySystem(run.model))


def _reached(model: Model, to_reached: Mapping[str, Array]) -> tuple[int, Array]:
    """Where the modes of the bodies that carry patches begin in v, and (m, …) what makes `reached` of v from there."""
    nodes = [node for node in model.tree.nodes if node.body.name in to_reached]
    first, end = nodes[0].p_v.start, nodes[-1].p_v.stop
    reached = np.zeros((len(to_reached[nodes[0].body.name]), end - first))
    for node in nodes:
        reached[:, node.p_v.start - first : node.p_v.stop - first] = to_reached[node.body.name] @ node.body.on_file.T
    return first, reached


def functions_within(
    curve: "PPoly", least: Array | float = -np.inf, most: Array | float = np.inf
) -> list[TimeFunction]:
    """The k components of a `curve` as functions of time, constant before and after it.

    Cut to `least` … `most` in the curve's unit; linear in parts of its pieces where these limits act.
    """
    parts = np.linspace(0.0, 1.0, 1 if len(curve.c) == 2 else PARTS, endpoint=False)
    times = np.append((curve.x[:-1, None] + np.diff(curve.x)[:, None] * parts).ravel(), curve.x[-1])
    values = curve(times)
    within = np.clip(values, least, most)
    if np.array_equal(values, within):
        columns = curve.c.reshape(*curve.c.shape[:2], -1).transpose(2, 1, 0)
        functions = [TimeFunction.polynomial(curve.x, np.ascontiguousarray(of_one)) for of_one in columns]
    else:
        functions = spline(times, within.reshape(len(times), -1), 1)
    return [function.held(curve.x[0], curve.x[-1]) for function in functions]


class OfPaths(NamedTuple):
    """Constraint forces of paths over time, N·m and N: `source` returns all `total` numbers.

    `joints`: their numbers along coordinates of joints; `points`: along global axes at "BODY.POINT", by component.
    Components that `points` lacks are zero.
    """

    source: _core.ForceSource
    joints: Mapping[str, list[int]]
    points: Mapping[str, Mapping[str, int]]
    total: int


def path_numbers(run: Run) -> OfPaths:
    """The constraint forces of the paths of `run` over time: along joint coordinates, and on points."""
    model = run.model
    rows = [(k, row) for k, row in enumerate(model.rows) if row.is_trajectory]
    along = [(k, row) for k, row in rows if row.kind == "coordinate"]
    on_points = [(k, row, *side) for k, row in rows if row.kind != "coordinate" for side in _sides(model, row)]
    joints = {model.joint_of(row): [number] for number, (_, row) in enumerate(along)}
    firsts = range(len(along), len(along) + len(OF_POINT) * len(on_points), len(OF_POINT))
    points = dict(zip(dict.fromkeys(point for *_, point, _ in on_points), firsts, strict=False))
    parts = [(k, number, float(row.sign)) for number, (k, row) in enumerate(along)]
    parts += [(k, points[point], sign) for k, _, point, sign in on_points]
    count = len(along) + len(OF_POINT) * len(points)
    system = MultibodySystem(model)

    def reader(driven: _core.PlanarDriven | _core.SpatialDriven) -> _core.PlanarForceReader | _core.SpatialForceReader:
        if isinstance(driven, _core.SpatialDriven):
            return _core.path_reader(driven, np.eye(3), parts, count)
        assert system.plane is not None
        at = {int(k): number for number, k in enumerate(system.plane.followed)}
        in_plane = [(at[k], number, sign) for k, number, sign in parts]
        return _core.path_reader(driven, system.plane.axes.T, in_plane, count)

    # Joints carry what is across the plane
    plane, ways = system.plane, [row.f for _, row, *_ in on_points if row.kind == "point"]
    are_in_plane = plane is not None and all(abs(plane.axes[2] @ way) <= EXACT for way in ways)
    source = _found(run, reader, system if are_in_plane else None)
    turned = {point for _, row, point, _ in on_points if row.kind != "point"}
    components = {
        point: {name: first + k for k, name in enumerate(OF_POINT if point in turned else OF_POINT[:3])}
        for point, first in points.items()
    }
    return OfPaths(source, joints, components, count)


def _sides(model: Model, row: ConstraintRow) -> Iterator[tuple[str, float]]:
    """Sections of bodies on which the force along a row acts, and its sign there: "BODY.POINT", or "BODY"."""
    for section, sign in ((row.b, 1.0), (row.a, -1.0)):
        if section.body >= 0:
            yield ".".join(filter(None, (model.tree.nodes[section.body].body.name, section.point))), sign


def point_numbers(run: Run, chosen: Mapping[str, PointsOfBody]) -> _core.ForceSource:
    """Driving forces at actuation points `chosen` by body, N, global axes: three numbers of each component."""
    tree, in_core = run.model.tree, frames_in_core(run.model, run.q[0])
    bodies = [(tree.index[name], *in_core[tree.index[name]], *of_body.of_core()) for name, of_body in chosen.items()]
    return _found(run, lambda driven: _core.point_reader(driven, bodies))


def _found(run: Run, reader: Reader, system: MultibodySystem | None = None) -> _core.ForceSource:
    """Read of the recorded steps of a run, as `system` was integrated (None: in 3D), or of its prescribed motion."""
    if run.recording is not None:
        of_run = driven_mechanism(run.model, has_motors=False) if system is None else integrated_mechanism(system)
        return _core.recorded_forces(of_run, run.recording, reader(of_run))
    assert run.prescribed is not None
    equations, shape, near, *_ = run.prescribed
    motion = equations()
    return _core.prescribed_forces(motion, shape, near, reader(motion.driven))


def left_paths(source: Run, run: Run) -> Iterator[str]:
    """Yield a warning for each path that `run`, a replay of the forces of `source`, leaves."""
    now = (run.time >= 0.0) & (run.time <= source.time[-1])
    model, times, q = source.model, run.time[now], run.q[now]
    if not len(times):
        return
    share = np.abs(model.constraints.values(q, times)[0]) / model.row_sizes
    for path in dict.fromkeys(row.owner for row in model.rows if row.is_trajectory):
        off = share[:, [row.is_trajectory and row.owner == path for row in model.rows]].max(axis=1)
        if off.max() > OFF_PATH:
            yield (
                f'the forces of "{source.analysis.name}" do not follow trajectory "{path}": from t ='
                f" {times[int(np.argmax(off > OFF_PATH))]:.4g} s on the deviation is up to {100 * off.max():.3g} % of"
                " the robot's size, or of 1 rad. Open-loop forces are unstable near singular postures; apply ="
                ' "joints", or a controller, keeps to the path'
            )
