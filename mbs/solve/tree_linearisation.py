"""The linear equations of a planar mechanism from exact derivatives of its accelerations in joint coordinates.

The core (core/recursion/derivatives.h) has a bare tree: joints without rotors, friction and springs, modes without
stiffness and damping. All these act along lines: rows E that do not change with the coordinates y of the tree. Their
forces are held in the core, and what they answer to E δy, E δẏ and E δÿ is added exactly, to K, to D and, of rotors, to
the accelerations. Rotors before gears that give turn by coordinates of their own, the last of y.

With C δy = 0 of loops and δs = S δy, δy = H δs and δẏ = H δṡ + Ḣ δs. Accelerations answer by
δÿ = a_y δy + a_ẏ δẏ + a_f δf, where M S a_f = Hᵀ.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ..joints.measure import Marker, Measure
from ..model.masses import block_diagonal
from ..model.model import Model
from ..model.planar_tree import PlanarTree
from ..model.system import MechanismSystem
from ..model.tree_layout import NotInTreeError
from .answering_forces import AnsweringForces


class Resistance(NamedTuple):
    """D δṡ + K δs, what changes of the forces along s that a motion needs; (f, f) each."""

    D: Array
    K: Array


class Answer(NamedTuple):
    """Derivatives of ÿ by y, ẏ and forces (n, n), and of the rows of loops and their rates by y (rows, n)."""

    a_y: Array
    a_y_dot: Array
    a_f: Array
    C: Array
    C_dot: Array


class TreeLinearisation:
    """What is the same at every configuration; s are the values of `independent` measures, then p of all bodies.

    Raises `NotInTreeError` where the tree has not the mechanism, or a measure is not linear in its coordinates.
    """

    def __init__(self, model: Model, independent: Sequence[Measure]) -> None:
        bare = _bare(model)
        assembly = MechanismSystem(bare, bare.joints, bare.loads)
        self._tree, self._model = PlanarTree(assembly, is_forced=True), model
        self._bare_size, self._n = assembly.system.coordinates, self._tree.core.n_v
        self._rotors = {gear.rotor: self._n + k for k, gear in enumerate(model.gears)}
        self._p = [k for body in bare.bodies for k in self._tree.modes[body.name]]
        self._S = np.vstack([self._lines(independent), self._identity[self._p]])
        self._of_rotors = self._lines(measure for measure, _ in model.rotors)
        self._answering = AnsweringForces(model)
        self._of_answers = self._lines(self._answering.measures)
        self._of_moments = self._lines(measure for measure, _ in model.loads if measure.carries_moment)
        self._inertia = np.array([inertia for _, inertia in model.rotors])
        self._stiffness = np.concatenate([body.stiffness for body in model.links])
        self._damping = block_diagonal([body.damping for body in model.links])

    def at(self, t: float, q: Array, v: Array, a: Array, force: Array, M: Array) -> Resistance:
        """About a motion (coordinates,) that `force` (f,) along s drives; M (f, f) of s."""
        S, E, (y, y_dot, y_ddot) = self._S, self._of_answers, self._motion(q, v, a)
        answer, K, D, p = self._answering.at(t, q, v), 0.0 * self._identity, 0.0 * self._identity, self._p
        K[p, p], D[np.ix_(p, p)] = self._stiffness, self._damping
        moments = [size(t)[0] for measure, size in self._model.loads if measure.carries_moment]
        held = S.T @ force - K @ y - D @ y_dot + E.T @ answer.force + self._of_moments.T @ moments
        held -= self._of_rotors.T * self._inertia @ (self._of_rotors @ y_ddot)
        K, D = K - E.T @ answer.by_value @ E, D - E.T @ answer.by_rate @ E
        core = self._answer(t, y, y_dot, held)
        left = np.vstack([core.C, S])
        H = np.linalg.solve(left, np.eye(len(left))[:, len(core.C) :])
        H_dot = np.linalg.solve(left, np.vstack([-core.C_dot @ H, np.zeros((len(S), len(S)))]))
        by_s = core.a_y @ H + core.a_y_dot @ H_dot
        return Resistance(H.T @ D @ H - M @ (S @ core.a_y_dot @ H), H.T @ (K @ H + D @ H_dot) - M @ (S @ by_s))

    @property
    def _identity(self) -> Array:
        return np.eye(self._n + len(self._rotors))

    def _lines(self, measures: Iterable[Measure]) -> Array:
        """E (measures, n). Raises `NotInTreeError` for a measure that is not linear."""
        rows = [self._line(measure) for measure in measures]
        return np.array(rows).reshape(len(rows), len(self._identity))

    def _line(self, measure: Measure) -> Array:
        if (coordinate := self._tree.layout.coordinate(measure)) is not None:
            along: Array = coordinate.sign * self._identity[coordinate.number]
            return along
        if not measure.carries_moment:
            raise NotInTreeError(f"a coordinate that is not linear in those of the tree ({measure.label})")
        of_b, of_a = measure.angle_ratios
        between: Array = of_b * self._angle(measure.b) - of_a * self._angle(measure.a)
        return between

    def _angle(self, marker: Marker) -> Array:
        if marker.body in self._rotors:
            own: Array = self._identity[self._rotors[marker.body]]
            return own
        return np.pad(self._tree.layout.section_angle(marker), (0, len(self._rotors)))

    def _motion(self, q: Array, v: Array, a: Array) -> Array:
        """Y, ẏ and ÿ (3, n)."""
        states = np.array([q, v, a])
        of_tree = self._tree.motion(*states[:, : self._bare_size])
        return np.hstack([of_tree, states[:, self._bare_size + 2 :: 3]])  # of rotors θ in (R, θ)

    def _answer(self, t: float, y: Array, y_dot: Array, forces: Array) -> Answer:
        """Of the tree with rotors, under `forces` (n,) and the loads at time t."""
        n, core = self._n, self._tree.core
        core.keep_independent_rows(y[:n], y_dot[:n])
        loads, wrench = self._tree.given_forces(t)
        rows = len(self._tree.constraints)
        bare = core.derivatives(y[:n], y_dot[:n], np.zeros(rows), forces[:n] + loads, wrench, self._tree.scene, t)
        beside = len(self._rotors)
        a_y, a_y_dot = (np.pad(found, (0, beside)) for found in (bare.a_q, bare.a_v))
        a_f = np.pad(bare.a_f, (0, beside))
        a_f[n:, n:] = np.diag([1.0 / self._model.body(rotor).inertia for rotor in self._rotors])
        # δÿ = … + a_f (δf − Eᵀ J E δÿ)
        of_rotors = self._of_rotors.T * self._inertia @ self._of_rotors
        of_bare = np.linalg.inv(np.eye(len(a_f)) + a_f @ of_rotors)
        C, C_dot = (np.pad(found, ((0, 0), (0, beside))) for found in (bare.value_q, bare.rate_q))
        return Answer(of_bare @ a_y, of_bare @ a_y_dot, of_bare @ a_f, C, C_dot)


def _bare(model: Model) -> Model:
    """Without rotors before gears that give, and without what acts along lines; forces at points stay."""
    rotors = {gear.rotor for gear in model.gears}
    return replace(
        model,
        bodies=tuple(
            replace(body, stiffness=np.zeros_like(body.stiffness), damping=np.zeros_like(body.damping))
            for body in model.links
        ),
        joints=tuple(constraint for constraint in model.joints if constraint.owner not in rotors),
        loads=tuple((measure, size) for measure, size in model.loads if not measure.carries_moment),
        trajectories=(), motors={}, rotors=(), frictions=(), gears=(), state_forces=(),
    )  # fmt: skip
