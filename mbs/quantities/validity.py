"""How far a run leaves the small deformations that modes describe, and how wrong its results may be for that.

Deflection and section rotation are measured from the chord, the straight line between the ends of a link's axis: a
rigid rotation of the frame counts for nothing, so that they are the same under every reference condition. The
foreshortening ½ pᵀG p = ½∫w'² dx is that in the link's own frame, for just that is what the equations leave out, or
know to second order where geometric stiffening is on; a cantilever, whose frame turns away from its chord, loses more
than a link on simple supports.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, sqrt
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...fe_models.modal_body import ModalBody
from ..analysis.planar_outcome import PlanarOutcome
from .observation import modes_of_file
from .second_order import (
    Missing,
    Rotations,
    largest_displacement,
    largest_rotations,
    missing_to_first_order,
    missing_to_second_order,
)
from .stiffening import NOTABLE
from .stiffness_change import ModalLoads, StiffnessChange, stiffness_change

IN_PLANE, IN_SPACE = (1,), (1, 2)  # axes across a link along which it bends

DEFLECTION_LIMIT = {False: 0.02, True: 0.05}  # of the length, from the chord; without and with geometric stiffening
SHORTENING_LIMIT = {False: 1e-3, True: 1e-2}  # of the length: a half wave at 2 %; where the second order ends
USELESS = 0.1  # of the length, in the position of points
ENOUGH = 1e-3  # shortening of a piece by bending: tips are then right to some 1e-4 of the length (docs/theory.md)


@dataclass(frozen=True)
class Bending:
    """Largest values of one flexible link over a run.

    Attributes:
        deflection: distance of its axis from its chord, of its length.
        rotation: angle between a section's normal and the chord, rad.
        foreshortening: ½∫w'² dx over its length, in its own frame, m.
        foreshortening_moment: N·m, that times the largest force at an interface at the same time: what moments miss.
        stiffness_change: by the loads of the run, relative, of the shape where it is largest; 0 where the modal body
            file does not tell.
        length: m, of the link.
        is_stiffened: whether geometric stiffening is in the equations.
        missing: errors as `second_order` estimates them.
        rotations: largest rotations of sections.
        pieces: into how many it is divided; the values are then those of its worst piece.
        is_divisible: whether the scene lets it be divided.
        buckling: how many times the loads under which the link buckles are reached, from 1 on.
    """

    deflection: float
    rotation: float
    foreshortening: float
    foreshortening_moment: float
    stiffness_change: float
    length: float
    is_stiffened: bool
    missing: Missing
    rotations: Rotations
    pieces: int = 1
    is_divisible: bool = False
    buckling: float = 0.0

    @property
    def shortening(self) -> float:
        """The foreshortening, of the length."""
        return self.foreshortening / self.length

    @property
    def relative_error(self) -> float:
        """Estimated error of deflections, forces and moments, of their peaks."""
        return self.missing.of_deflections

    @property
    def position_error(self) -> float:
        """Estimated error of positions, of the link's length."""
        return self.missing.of_length

    @property
    def is_beyond(self) -> bool:
        """Whether small deformations end before."""
        return (
            self.deflection > DEFLECTION_LIMIT[self.is_stiffened]
            or self.shortening > SHORTENING_LIMIT[self.is_stiffened]
            or (not self.is_stiffened and self.stiffness_change > NOTABLE)
            or self.buckling >= 1.0
        )

    @property
    def in_words(self) -> str:
        """What was measured."""
        stiffening = "with geometric stiffening" if self.is_stiffened else "geometric stiffening is off"
        times = f" and are {self.buckling:.3g} times those under which it buckles" if self.buckling >= 1.0 else ""
        return (
            f"bends by {_percent(self.deflection)} of its length, loads change its stiffness by"
            f" {_percent(self.stiffness_change)}{times} ({stiffening})"
        )

    @property
    def estimate(self) -> str:
        """How wrong results may be."""
        if self.position_error > USELESS:
            return "results may be entirely wrong"
        return (
            f"points may be off by {_percent(self.position_error)} of its length, deflections and moments by"
            f" {_percent(self.relative_error)} of their peaks"
        )

    @property
    def advice(self) -> str:
        """What to do about it."""
        if not self.is_stiffened and self.shortening <= SHORTENING_LIMIT[True]:
            return "consider geometric_stiffening = true"
        if not self.is_divisible:
            return "divide the link into shorter ones, welded"
        if self.position_error > USELESS:  # it does not really bend as far as this run says
            return 'divide the link: pieces = "auto" in its [[body]]'
        return f"divide the link: pieces = {enough_pieces(self.shortening, self.pieces)} in its [[body]]"


def enough_pieces(shortening: float, count: int) -> int:
    """Into how many pieces to divide a link, of which now `count` lose that part of their length by bending.

    It goes down with the square of their number.
    """
    return max(2, ceil(count * sqrt(shortening / ENOUGH)))


def bending(
    outcome: PlanarOutcome,
    links: Mapping[str, ModalBody],
    loads: Mapping[str, ModalLoads],
    is_stiffened: bool,
) -> dict[str, Bending]:
    """Of the flexible `links` of a run, by name. They are modal bodies as their files have them."""
    wrenches = outcome.assembly.constraint_wrenches(outcome.q, outcome.lambda_)
    found = {}
    for name, link in links.items():
        body, is_at_rest = outcome.assembly.model.body(name), not outcome.analysis.is_integrated
        run = LinkInRun(modes_of_file(outcome, body), body.modal_transform, loads.get(name), is_stiffened, is_at_rest)
        forces = [np.linalg.norm(w[:, :2], axis=1) for w in wrenches.get(name, {}).values()]
        force = np.max(forces, axis=0) if forces else np.zeros(len(run.p))
        found[name] = bending_of_link(link, run, force, IN_PLANE)
    return found


class LinkInRun(NamedTuple):
    """A link in a run: p (T, n_file) of its file, which is T times that of the equations, and its loads if known."""

    p: Array
    T: Array
    loads: ModalLoads | None
    is_stiffened: bool
    is_at_rest: bool


def bending_of_link(link: ModalBody, run: LinkInRun, force: Array, axes: Sequence[int]) -> Bending:
    """Of one link, across along `axes`; see `Bending`. `force` (T,) N: the largest at an interface."""
    deflection, rotation, shortening = shape_from_chord(link, run.p, axes)
    peaks = (deflection / link.length, rotation, shortening, force * shortening)
    w, phi, s, moment = (float(x.max(initial=0.0)) for x in peaks)
    change = StiffnessChange() if run.loads is None else stiffness_change(run.loads)
    rotations = largest_rotations(link, run.p)
    if run.is_stiffened:
        missing = missing_to_second_order(largest_displacement(link, run.p), s / link.length, rotations, change.largest)
    elif run.loads is None:
        missing = Missing(s / link.length, min(1.0, s / link.length))
    else:
        p, stations = run.p @ np.linalg.pinv(run.T).T, link.stations.translation @ run.T
        missing = missing_to_first_order(run.loads, p, stations, link.length, is_at_rest=run.is_at_rest)
    return Bending(
        w, phi, s, moment, change.largest, link.length, run.is_stiffened, missing, rotations, buckling=change.buckling
    )


def shape_from_chord(link: ModalBody, p: Array, axes: Sequence[int]) -> tuple[Array, Array, Array]:
    """Largest deflection (m) and section rotation (rad) from the chord, and foreshortening (m), each (T,).

    Across along `axes`, 1 for y and 2 for z: v' = φ_z, w' = −φ_y.
    """
    stations, x = link.stations, link.stations.position[:, 0]
    off, turned, squares = (np.zeros((len(p), len(x))) for _ in range(3))
    for axis in axes:
        w, slope = p @ stations.translation[:, axis].T, p @ stations.rotation[:, 3 - axis].T
        slope = slope if axis == 1 else -slope
        chord = (w[:, -1:] - w[:, :1]) / (x[-1] - x[0])
        off += (w - w[:, :1] - chord * (x - x[0])) ** 2
        turned += (slope - chord) ** 2
        squares += slope**2
    shortening = 0.5 * (0.5 * (squares[:, 1:] + squares[:, :-1])) @ np.diff(x)
    return np.sqrt(off.max(axis=1)), np.sqrt(turned.max(axis=1)), shortening


def largest(bodies: Mapping[str, Bending]) -> tuple[str, Bending] | None:
    """The link whose results are worst, of those beyond small deformations where there are any; None of no links."""
    return max(bodies.items(), key=lambda item: (item[1].is_beyond, item[1].position_error), default=None)


def deflection_warning(bodies: Mapping[str, Bending]) -> str:
    """What to tell of links that bend too much; empty where none does."""
    worst = largest(bodies)
    if worst is None or not worst[1].is_beyond:
        return ""
    name, link = worst
    return f"{name} {link.in_words}: {link.estimate}; {link.advice}"


def _percent(value: float) -> str:
    return f"{100 * value:.0f} %" if value >= 1.0 else f"{100 * value:.2g} %"
