"""How far a run leaves the small deformations that modes describe, and how wrong its results may be for that. SI units.

Deflection and section rotation are measured from the chord, the straight line between the ends of a link's axis: a
rigid rotation of the frame counts for nothing, so that they are the same under every reference condition. The
foreshortening ½ pᵀG p = ½∫w'² dx is that in the link's own frame, for just that is what the equations leave out, or
know to second order where geometric stiffening is on; a cantilever, whose frame turns away from its chord, loses more
than a link on simple supports.
"""

from collections.abc import Iterator, Mapping
from math import ceil, sqrt

import numpy as np

from ...common.arrays import Array
from ...common.structs import struct
from ...fe_models.modal_body import ModalBody
from ...fe_models.modal_body.unit_loads import interface_load_names
from ..run.record import Run
from .link_loads import loads_in_equations
from .motion import constraint_rows, cut_motions, node_of, places
from .second_order import (
    LoadedPoint,
    Missing,
    ModalLoads,
    Rotations,
    largest_displacement,
    largest_lengths,
    largest_rotations,
    lasting,
    missing_to_first_order,
    missing_to_second_order,
    stiffness_change,
)

NOTABLE_STIFFNESS_CHANGE = 0.01  # relative, of a link, from which on "auto" switches geometric stiffening on
DEFLECTION_LIMIT = {False: 0.02, True: 0.05}  # of the length, from the chord; without and with geometric stiffening
SHORTENING_LIMIT = {False: 1e-3, True: 1e-2}  # of the length: a half wave at 2 %; where the second order ends
USELESS = 0.1  # of the length, in the position of points
ENOUGH = 1e-3  # shortening of a piece by bending: tips are then right to some 1e-4 of the length (docs/theory.md)


@struct
class Bending:
    """Largest values of one flexible link over a run."""

    deflection: float  # distance of its axis from its chord, of its length
    rotation: float  # angle between a section's normal and the chord, rad
    foreshortening: float  # ½∫w'² dx over its length, in its own frame, m
    # N·m, that times the largest force at an interface at the same time: what moments miss
    foreshortening_moment: float
    # by the loads of the run, relative, of the shape where it is largest; 0 where the modal body file does not tell
    stiffness_change: float
    length: float  # m, of the link
    is_stiffened: bool  # whether geometric stiffening is in the equations
    missing: Missing  # errors as `second_order` estimates them
    rotations: Rotations  # largest rotations of sections
    pieces: int = 1  # into how many it is divided; the values are then those of its worst piece
    is_divisible: bool = False  # whether the scene lets it be divided
    buckling: float = 0.0  # how many times the loads under which the link buckles are reached, from 1 on

    @property
    def shortening(self) -> float:
        """The foreshortening, of the length."""
        return self.foreshortening / self.length

    @property
    def is_beyond(self) -> bool:
        """Whether small deformations end before."""
        return (
            self.deflection > DEFLECTION_LIMIT[self.is_stiffened]
            or self.shortening > SHORTENING_LIMIT[self.is_stiffened]
            or (not self.is_stiffened and self.stiffness_change > NOTABLE_STIFFNESS_CHANGE)
            or self.buckling >= 1.0
        )

    @property
    def in_words(self) -> str:
        """Deflection, rotation and change of stiffness as text."""
        stiffening = "with geometric stiffening" if self.is_stiffened else "geometric stiffening is off"
        times = f" and are {self.buckling:.3g} times those under which it buckles" if self.buckling >= 1.0 else ""
        return (
            f"bends by {_percent(self.deflection)} of its length, loads change its stiffness by"
            f" {_percent(self.stiffness_change)}{times} ({stiffening})"
        )

    @property
    def estimate(self) -> str:
        """Estimated errors of results as text."""
        if self.missing.of_length > USELESS:
            return "results may be entirely wrong"
        return (
            f"points may be off by {_percent(self.missing.of_length)} of its length, deflections and moments by"
            f" {_percent(self.missing.of_deflections)} of their peaks"
        )

    @property
    def advice(self) -> str:
        """Remedy as text."""
        if not self.is_stiffened and self.shortening <= SHORTENING_LIMIT[True]:
            return "consider geometric_stiffening = true"
        if not self.is_divisible:
            return "divide the link into shorter ones, welded"
        if self.missing.of_length > USELESS:  # it does not really bend as far as this run says
            return 'divide the link: pieces = "auto" in its [[body]]'
        return f"divide the link: pieces = {enough_pieces(self.shortening, self.pieces)} in its [[body]]"


def enough_pieces(shortening: float, count: int) -> int:
    """Return the number of pieces for a link that in `count` pieces shortens by that part of its length.

    It goes down with the square of their number.
    """
    return max(2, ceil(count * sqrt(shortening / ENOUGH)))


def link_bending(run: Run, links: Mapping[str, ModalBody]) -> dict[str, Bending]:
    """Return the deflection measures of flexible bodies of the equations; `links` are their modal bodies."""
    loads = loads_in_equations(run, links) if len(run.time) else {}
    return {
        name: _bending_of(run, name, link, loads[name].sizes if name in loads else {}) for name, link in links.items()
    }


def _bending_of(run: Run, name: str, link: ModalBody, sizes: Mapping[str, Array]) -> Bending:
    """Of one link under loads of `sizes` (T,) by the names of `fe_models.modal_body.unit_loads`."""
    body, T = node_of(run, name).body, node_of(run, name).body.modal_transform
    own = run.q[:, node_of(run, name).p_q]
    p, force = own @ T.T, np.zeros(len(own))
    for point in body.points:
        parts = [sizes[load] for axis in "xyz" if (load := f"force/{point}/{axis}") in sizes]
        force = np.maximum(force, np.linalg.norm(parts, axis=0)) if parts else force
    deflection, rotation, shortening = shape_from_chord(link, p)
    peaks = (deflection / link.length, rotation, shortening, force * shortening)
    w, phi, s, moment = (float(x.max(initial=0.0)) for x in peaks)
    change, buckling, missing, rotations = 0.0, 0.0, Missing(0.0, 0.0), largest_rotations(link, p)
    if body.n_modes:
        on_modes = lasting(_on_modes(link, run, name, sizes), run.time)
        change, buckling = stiffness_change(on_modes)
        if body.stiffening is not None:
            displacement = largest_displacement(link, p)
            missing = missing_to_second_order(displacement, s / link.length, rotations, change)
        else:
            stations, places = link.stations.translation @ T, link.stations.position
            missing = missing_to_first_order(on_modes, own, stations, places, link.length, is_at_rest=run.is_at_rest)
    return Bending(
        deflection=w,
        rotation=phi,
        foreshortening=s,
        foreshortening_moment=moment,
        stiffness_change=change,
        length=link.length,
        is_stiffened=body.stiffening is not None,
        missing=missing,
        rotations=rotations,
        buckling=buckling,
    )


def _on_modes(link: ModalBody, run: Run, name: str, sizes: Mapping[str, Array]) -> ModalLoads:
    """Loads of `sizes` (T,) of which the file has a geometric stiffness, whether it is in the equations or not."""
    node = node_of(run, name)
    T, n = node.body.modal_transform, len(node.body.stiffness)
    K = {load: T.T @ of_load @ T for load, of_load in link.geometric_stiffness.items()}
    known = [load for load in sizes if load in K]
    f = np.stack([sizes[load] for load in known], axis=1) if known else np.zeros((0, 0))
    points = {
        point: LoadedPoint(
            at.position,
            np.vstack([at.translation, at.rotation]) @ T,
            np.stack([K.get(load, np.zeros((n, n))) for load in interface_load_names([point])]),
        )
        for point, at in link.interfaces.items()
        if all(f"force/{point}/{axis}" in K for axis in "xyz")
    }
    support = points.get(node.outer.point)
    if support is not None:
        # Of rotations at the joint what is left without those that it is free to, unless trajectories prescribe them
        counts, axis = np.eye(6), node.outer.triad[:, 2:]
        along = [row for row in run.model.rows if row.is_trajectory and row.kind == "coordinate"]
        free = (node.joint.guess_units or node.joint.units).count("rad")
        if free and node.joint.name not in map(run.model.joint_of, along):
            counts[3:, 3:] = np.eye(3) - axis @ axis.T if free == 1 else 0.0
        support = LoadedPoint(support.position, counts @ support.by_modes, np.tensordot(counts, support.K, axes=1))
    K_known = np.array([K[load] for load in known]).reshape(-1, n, n)
    return ModalLoads(f, K_known, node.body.stiffness, tuple(points.values()), support)


def shape_from_chord(link: ModalBody, p: Array) -> tuple[Array, Array, Array]:
    """Return largest deflection (m), section rotation (rad) from the chord, foreshortening (m), (T,), at p (T, n).

    Across along y and z: v' = φ_z, w' = −φ_y.
    """
    stations, x = link.stations, link.stations.position[:, 0]
    shares = 0.5 * (np.append(np.diff(x), 0.0) + np.append(0.0, np.diff(x)))  # of the length, by the trapezoidal rule
    across, slopes = stations.translation[:, 1:], stations.rotation[:, [2, 1]] * [[1.0], [-1.0]]  # (stations, 2, n)
    chord = (across[-1] - across[0]) / (x[-1] - x[0])
    off = across - across[0] - (x - x[0])[:, None, None] * chord
    G = np.einsum("k,kan,kam->nm", shares, slopes, slopes)
    return largest_lengths(p, off), largest_lengths(p, slopes - chord), 0.5 * ((p @ G) * p).sum(axis=1)


def largest(bodies: Mapping[str, Bending]) -> tuple[str, Bending] | None:
    """The link whose results are worst, of those beyond small deformations where there are any; None of no links."""
    return max(bodies.items(), key=lambda item: (item[1].is_beyond, item[1].missing.of_length), default=None)


def deflection_warning(bodies: Mapping[str, Bending]) -> str:
    """Return the warning on links that bend too much; empty if none does."""
    worst = largest(bodies)
    if worst is None or not worst[1].is_beyond:
        return ""
    name, link = worst
    return f"{name} {link.in_words}: {link.estimate}; {link.advice}"


def _percent(value: float) -> str:
    return f"{100 * value:.0f} %" if value >= 1.0 else f"{100 * value:.2g} %"


TURN = 2 * np.pi
LEAST = 1e-9  # of the robot's size, or rad: constraints that are off by less are met


def doubts(run: Run, tolerance: float) -> Iterator[str]:
    """Yield doubts about a motion computed to `tolerance`: unmet constraints, ambiguous turns and angles."""
    yield from _violated(run, max(tolerance, LEAST))
    for one, of_cut in cut_motions(run):
        if not of_cut.is_counted:
            yield (
                f"{one.joint.label}: outputs are too far apart to count the turns of its coordinate, which may be off"
                " by whole turns: the loop is cut at this joint; choose a smaller output_step"
            )
    for joint in run.model.scene.joint:
        if max(map(abs, joint.rpy)) > TURN:
            angles = ", ".join(f"{angle:g}" for angle in joint.rpy)
            yield f'{joint.label}: rpy = [{angles}] rad is more than a turn (degrees are written "90*deg")'


def _violated(run: Run, allowed: float) -> Iterator[str]:
    """The constraint that is violated most, where that is more than `allowed`, of the robot's size or rad."""
    if not run.model.rows or not len(run.time):
        return
    C = np.abs(constraint_rows(run)[0])
    is_way = np.array([run.model.measures_way(row) for row in run.model.rows])
    share = np.where(is_way, C / _extent(run), C)
    at, k = np.unravel_index(int(np.argmax(share)), share.shape)  # the first NaN, if there is one
    if not share[at, k] <= allowed:
        row = run.model.rows[k]
        yield (
            f'{"trajectory" if row.is_trajectory else "joint"} "{row.owner}" is violated by {C[at, k]:.3g}'
            f" {'m' if is_way[k] else 'rad'} at t = {run.time[at]:.6g} s: the result is not a motion of this robot;"
            " choose a smaller tolerance or another integrator"
        )


def _extent(run: Run) -> float:
    """A length (m) of the robot: its largest body, or the space in which its bodies move."""
    origins = np.concatenate([places(run).frame(number).r for number in range(len(run.model.tree.nodes))])
    bodies = [
        np.ptp([at.position for at in node.body.points.values()], axis=0)
        for node in run.model.tree.nodes
        if node.body.points
    ]
    return max(float(np.linalg.norm(size)) for size in (*bodies, np.ptp(origins, axis=0))) or 1.0
