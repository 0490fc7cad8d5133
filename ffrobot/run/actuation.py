"""From the modal forces of a motion to voltages of patches, and to whether motors and patches can do it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..actuation.patches.records import by_body
from ..actuation.points import PointSet, make_point_set
from ..common.arrays import Array, Indices
from ..common.errors import InputError, naming
from ..common.structs import struct
from ..mbs._core import TimeFunction
from ..mbs.fields.waypoints import spline
from ..mbs.model.drives import Drive
from ..mbs.model.model import Model
from ..mbs.run.record import Run
from ..mbs.scene.analysis import Analysis
from ..mbs.scene.space import SPACES
from ..scene.scene import Scene
from .bodies import LoadedBody

if TYPE_CHECKING:
    from ..actuation.feasibility import Feasibility
    from ..actuation.patches.link_patches import LinkPatches
    from ..actuation.patches.patches import Voltages

Bodies = Mapping[str, LoadedBody]
PARTS = [20_000 << k for k in range(8)]  # of time, in which voltages of loads are straight behind hysteresis
STRAIGHT = 2e-4  # of the largest voltage: what parts may miss
JUMPS, BETWEEN = 100, 0.381966  # parts that may miss more; where in parts that is seen: at no simple fraction


@struct
class Actuation:
    """Requirements of an analysis on motors and patches."""

    voltages: "Mapping[str, Voltages]"  # of patches, by layout ([[pzt]])
    # (T, n) N/√kg, by body with patches: forces on modes of its file that no voltage within limits supplies
    unmet: Mapping[str, Array]
    feasibility: "Feasibility"  # whether motors and patches keep their limits

    def at(self, rows: Indices) -> "Actuation":
        """Voltages and forces at outputs with numbers `rows` (k,) alone; the feasibility stays that of all outputs."""
        voltages = {name: of_layout.at(rows) for name, of_layout in self.voltages.items()}
        return replace(self, voltages=voltages, unmet={name: values[rows] for name, values in self.unmet.items()})


def make_patches(scene: Scene, bodies: Bodies) -> "dict[str, LinkPatches]":
    """Patches by body. Raises `InputError` for layouts that do not fit link or analyses."""
    if not scene.pzt:
        return {}
    from ..actuation.patches.link_patches import check_reach, link_patches, on_kept_modes

    patches = {}
    with naming(scene.path):
        for name, layouts in by_body(scene.pzt):
            body = bodies[name]
            assert body.modal is not None
            patches[name] = on_kept_modes(link_patches(layouts, body.modal, body.carrying), body.spatial)
        if scene.trajectory and any(analysis.allocates_patches for analysis in scene.analysis):
            for of_link in patches.values():
                check_reach(of_link)
    return patches


def points_3d(scene: Scene, bodies: Bodies) -> dict[str, PointSet]:
    """Actuation points by body. Raises `InputError` for points that do not fit their body."""
    points = {}
    for layout in scene.actuation_points:
        body = bodies[layout.body]
        with naming(f'{scene.path}: actuation_points "{layout.body}"'):
            points[layout.body] = make_point_set(layout, body.modal, body.spatial, SPACES[scene.space])
    return points


def given_voltages(scene: Scene, model: Model, patches: "Mapping[str, LinkPatches]") -> Iterator[Drive]:
    """Yield modal forces by the voltages that the scene prescribes for patches, with their hysteresis."""
    bodies = {label: body for body, of_link in patches.items() for label in of_link.arrays}
    for number, load in enumerate(scene.load, 1):
        if load.pzt is not None:
            of_link = patches[bodies[load.pzt]]
            directions = model.modal_directions(of_link.per_volt)[of_link.columns(load.pzt)]
            voltage, amplifiers = load.voltage or (), of_link.arrays[load.pzt].amplifiers
            if amplifiers.hysteresis.acts:
                times, wanted = _straight(f"{scene.path}: load no. {number}: voltage", scene.analysis, voltage)
                acting = spline(times, amplifiers.hysteresis.output(wanted), 3)
                voltage = tuple(function.held(times[0], times[-1]) for function in acting)
            yield from map(Drive, directions, voltage)


def _straight(key: str, analyses: Sequence[Analysis], voltage: Sequence[TimeFunction]) -> tuple[Array, Array]:
    """Times (T,), s, of all analyses, and voltages (T, k), V, which are straight in between but for a few jumps."""
    first = min((float(analysis.times[0]) for analysis in analyses), default=0.0)
    last = max((analysis.last_time for analysis in analyses), default=0.0)
    last = last if last > first else first + 1.0

    def sampled(times: Array) -> Array:
        return np.stack([function.sample(times)[0] for function in voltage], axis=1)

    for parts in PARTS:
        times = np.linspace(first, last, parts + 1)
        values = sampled(times)
        between = sampled(times[:-1] + BETWEEN * np.diff(times))
        missed = np.abs(between - values[:-1] - BETWEEN * np.diff(values, axis=0))
        bent = int(np.count_nonzero((missed > STRAIGHT * np.abs(values).max()).any(axis=1)))
        if bent <= JUMPS:
            return times, values
    if bent > BETWEEN * parts:
        raise InputError(
            f"{key}: expected no more than about {PARTS[-1] // 80} reversals of voltages on patches with hysteresis",
            f"more from {first:g} to {last:g} s: shorten the analyses",
        )
    return times, values


def find_actuation(scene: Scene, run: Run, bodies: Bodies, patches: "Mapping[str, LinkPatches]") -> Actuation:
    """Find voltages (V) of patches that come nearest to the modal forces of a motion, and judge all actuators.

    Links with actuation points need no patches. No link does where a later analysis applies forces on paths or points.
    """
    from ..actuation.feasibility import find_unmet, judge_actuators, links_in_motion

    flexible = {name: (body.modal, body.carrying) for name, body in bodies.items() if body.modal is not None}
    links = links_in_motion(run, flexible)
    voltages: dict[str, Voltages] = {}
    analysis, known = run.analysis, run.voltages
    for name, of_link in patches.items():
        F_p = links[name].F_p
        voltages |= of_link.voltages(F_p, known.get(name))
    unmet = find_unmet({name: links[name] for name in patches}, patches, voltages, limited=True)
    others = {of.body for of in scene.actuation_points}
    applied = {getattr(one, "apply", None) for one in scene.analysis if one.source == analysis.name}
    if analysis.supplies_all or applied & {"trajectory", "points"}:  # forces there need no modal forces
        others |= links.keys()
    return Actuation(voltages, unmet, judge_actuators(run, links, patches, voltages, others))
