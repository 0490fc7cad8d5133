"""How a tree moves, as the core says: frames, sections and rows of constraints over states, in global axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, as_list
from .. import _core
from .nodes import Node, Section
from .parts import ZERO, Markers
from .rows import ConstraintRow

MOTION = 18  # numbers of one motion in the core: r, F, velocity, omega


class Motion(NamedTuple):
    """Of a triad over states: place r (T, 3), axes F (T, 3, 3), velocity and angular velocity (T, 3)."""

    r: Array
    F: Array
    velocity: Array
    omega: Array


class PostureSearch(NamedTuple):
    """How postures are sought."""

    scales: Array  # (n_v,) natural sizes of coordinates; those of size 0 stay
    sizes: Array  # (rows,) natural sizes of C
    largest_step: float  # of any coordinate in one iteration, in natural sizes: keeps to the branch of the guess


class Kinematics:
    """The core's model of a tree without loads, with the sections and rows that may be asked for."""

    def __init__(
        self, nodes: Sequence[Node], sections: Sequence[Section] = (), rows: Sequence[ConstraintRow] = ()
    ) -> None:
        sections = list({_key(section): section for section in sections}.values())  # joints may share one
        markers, self._scene = Markers(nodes), _core.TreeScene()
        measures = [markers.row(row) for row in rows]
        places = [_core.MarkerAt(*markers.place(section)) for section in sections]
        self.nodes, self._numbers = nodes, {_key(section): len(nodes) + k for k, section in enumerate(sections)}
        self.core = _core.SpatialModel(markers.bodies(), markers.standing(), measures, places, np.zeros(3))
        self._signs = np.array([row.sign for row in rows])
        for row in rows:
            self._scene.add_target(ZERO if row.target is None else row.target, row.sign)
        for number, law in markers.turning:
            self._scene.turn_marker(number, law.in_core)

    @classmethod
    def of_points(cls, nodes: Sequence[Node]) -> Kinematics:
        """With the frames and points of all bodies, and the sections at joints.

        The core takes outputs of rotors, which have no mass, without sections: their frames are where it has them.
        """
        still = [side for node in nodes for side in (node.inner, node.outer) if side.still and side.body >= 0]
        points = [
            Section(number, point, np.eye(3), np.zeros(3))
            for number, node in enumerate(nodes)
            for point in (*(("",) if node.body.mass else ()), *node.body.points)
        ]
        return cls(nodes, [*points, *still])

    def places(self, q: Array, v: Array | None = None) -> Places:
        """At states q (T, n_q) and v (T, n_v), by default at rest."""
        rates = np.zeros((len(q), self.core.n_v)) if v is None else v
        return Places(
            self._numbers, self.core.motions(q, rates).reshape(len(q), len(self.nodes) + len(self._numbers), MOTION)
        )

    def constraints(self, q: Array, times: Array) -> tuple[Array, Array]:
        """C (T, rows) at q (T, n_q) and `times` (T,), and C_v (T, rows, n_v)."""
        values, gradients = self.core.constraints(self._scene, as_list(times), q)
        return self._signs * values, self._signs[:, None] * gradients.reshape(len(q), len(self._signs), self.core.n_v)

    def constraint_rates(self, q: Array, v: Array, times: Array) -> Array:
        """Ċ (T, rows) at q (T, n_q), v (T, n_v) and `times` (T,)."""
        return self._signs * self.core.constraint_rates(self._scene, as_list(times), q, v)

    def postures(
        self, q: Array, times: Array, search: PostureSearch, beside: Array | None = None
    ) -> tuple[Array, Array]:
        """Q (T, n_q) moved onto C = `beside` (T, rows), by default 0, at `times` (T,); what is left of it (T,).

        By Newton's method with the least steps; what is left is in terms of the sizes, NaN where it is not finite.
        """
        more = np.zeros((0, 0)) if beside is None else self._signs * beside
        return self.core.postures(
            self._scene, as_list(times), q, more, search.scales, search.sizes, search.largest_step
        )

    def mobilities(
        self, q: Array, times: Array, is_path: Sequence[bool], length: float, loop_rank: int = -1
    ) -> list[_core.Mobility]:
        """How joints can move with rigid links at q (T, n_q) and `times` (T,), ways in terms of `length` (m).

        Rows that are of no path close loops, of `loop_rank`; by default of the rank that they have there.
        """
        return self.core.mobilities(self._scene, as_list(times), q, is_path, length, loop_rank)


class Places:
    """Where frames and sections of a tree are in states, and how they move."""

    def __init__(self, numbers: dict[tuple[object, ...], int], motions: Array) -> None:
        """`numbers` of sections in `motions` (T, frames and sections, 18)."""
        self._numbers, self._motions = numbers, motions

    def frame(self, number: int) -> Motion:
        """Of the frame of body no. `number`."""
        return self._motion(self._numbers.get((number, "", None), number))

    def _motion(self, number: int) -> Motion:
        found = self._motions[:, number]
        return Motion(found[:, :3], found[:, 3:12].reshape(-1, 3, 3), found[:, 12:15], found[:, 15:])

    def at(self, section: Section) -> Motion:
        """Of the triad of a section."""
        if section.body < 0:
            zero = np.zeros((len(self._motions), 3))
            return Motion(section.position + zero, np.tile(section.triad, (len(zero), 1, 1)), zero, zero)
        found = self._motion(self._numbers[_key(section)]) if section.point else self.frame(section.body)
        return found if section.still else found._replace(F=found.F @ section.triad)


def _key(section: Section) -> tuple[object, ...]:
    """One that is `still` turns by its own triad."""
    return (section.body, section.point, section.triad.tobytes() if section.still else None)
