"""The linear equations of a planar mechanism in absolute coordinates, for what the recursion does not have yet.

The forces f = M a − Q that a motion needs and accelerations of measures are smooth functions of q: polynomials in R and
p, sines and cosines of angles and of what modes turn sections. Central differences of order 8 over steps that turn
nothing by more than 0.02 rad leave errors near rounding. Both are quadratic in v: differences by v are exact. Forces
that answer otherwise to the motion are held, and their derivatives added (`AnsweringForces`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...common.arrays import Array
from .. import _core
from ..joints.measure import Measure
from ..model.masses import system_mass_matrix
from ..model.model import Model
from ..model.system import MechanismSystem
from .answering_forces import Answer, AnsweringForces
from .gradients import gradient_rates, gradients
from .tree_linearisation import Resistance

STEP = 0.02  # of the size of a coordinate
CENTRAL = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
"""Weights of f(x + k h) − f(x − k h), k from 1 (Fornberg, Math. Comput. 51, 1988), of order 8."""


class AbsoluteLinearisation:
    """As `TreeLinearisation`, of any model."""

    def __init__(self, model: Model, independent: Sequence[Measure]) -> None:
        self._model, self._rows = model, [*(constraint.measure for constraint in model.joints), *independent]
        self._assembly = MechanismSystem(model, (), model.loads, self._rows)
        self._forces = ForcesOfMotion(model, self._rows)

    def at(self, t: float, q: Array, v: Array, a: Array, H: Array, H_dot: Array) -> Resistance:
        """About a motion (coordinates,) with H = ∂q/∂s (coordinates, f), where δv = H δṡ + Ḣ δs.

        With the rows' gradients G, G a + Ġ v = (0; s̈): δa = H δs̈ + 2 Ḣ δṡ + Ḧ δs.
        """
        rows, frames = self._assembly.motor_measures, self._assembly.frame_coordinates
        G, G_dot = gradients(self._assembly, rows, q), gradient_rates(self._assembly, rows, q, v)
        bent = position_derivative(self._assembly, lambda x: self._accelerations(x, v, a), q) @ H
        H_ddot = np.zeros_like(H)
        H_ddot[frames] = -np.linalg.solve(G[:, frames], 2 * G_dot @ H_dot + bent)
        f = self._assembly.system.required_forces(np.array([t]), q[None], v[None], a[None])[0]
        forces = self._forces.at(t, q, v, np.linalg.solve(G[:, frames].T, f[frames]))
        M, K, D = system_mass_matrix(self._assembly, q), forces.stiffness(a), forces.damping(a)
        return Resistance(H.T @ (D @ H + 2 * M @ H_dot), H.T @ (K @ H + D @ H_dot + M @ H_ddot))

    def _accelerations(self, q: Array, v: Array, a: Array) -> Array:
        """Of rows (T, rows) at q (T, coordinates)."""
        along = [(row, 2) for row in self._assembly.motor_measures]
        found: Array = _core.Sensing(self._assembly.system, along, []).read(q, *_tiled(len(q), v, a))
        return found


class ForcesOfMotion:
    """f = M a − Q of motions of a model, with forces along `rows` held beside its loads: what is the same in all."""

    def __init__(self, model: Model, rows: Sequence[Measure]) -> None:
        self._answering = AnsweringForces(model)
        passive = replace(model, frictions=(), gears=(), state_forces=())
        held = [*rows, *self._answering.measures]
        self._assembly, self._count = MechanismSystem(passive, (), model.loads, held), len(rows)

    def at(self, t: float, q: Array, v: Array, pulls: Array) -> HeldForces:
        """Of a motion through q with v (coordinates,) at time t, `pulls` (rows,) held."""
        answer = self._answering.at(t, q, v)
        return HeldForces(self._assembly, self._count, answer, np.concatenate([pulls, answer.force]), t, q, v)


@dataclass(frozen=True)
class HeldForces:
    """Derivatives of the forces of one motion: through q with v (coordinates,) at time t.

    `pulls` act along the measures of `assembly`: `rows` of them given ones, then what answers to the motion.
    """

    assembly: MechanismSystem
    rows: int
    answer: Answer
    pulls: Array
    t: float
    q: Array
    v: Array

    def stiffness(self, a: Array) -> Array:
        """∂f/∂q (coordinates, coordinates)."""
        K = position_derivative(self.assembly, lambda x: self._forces(x, *_tiled(len(x), self.v, a)), self.q)
        E, E_dot = self._gradients, gradient_rates(self.assembly, self._answering, self.q, self.v)
        return K - E.T @ (self.answer.by_value @ E + self.answer.by_rate @ E_dot)

    def damping(self, a: Array) -> Array:
        """∂f/∂v (coordinates, coordinates)."""
        v, scales, E = self.v, self.assembly.scales, self._gradients
        u = scales * max(1.0, np.abs(v / scales).max(initial=0.0))
        at, under = _tiled(len(v), self.q, a)
        ahead, behind = (self._forces(at, v + sign * np.diag(u), under) for sign in (1.0, -1.0))
        found: Array = ((ahead - behind) / (2 * u[:, None])).T - E.T @ self.answer.by_rate @ E
        return found

    @property
    def _answering(self) -> Sequence[_core.Measure]:
        return self.assembly.motor_measures[self.rows :]

    @property
    def _gradients(self) -> Array:
        return gradients(self.assembly, self._answering, self.q)

    def _forces(self, q: Array, v: Array, a: Array) -> Array:
        pulls = list(zip(self.assembly.motor_measures, self.pulls, strict=True))
        found: Array = self.assembly.system.required_forces(np.full(len(q), self.t), q, v, a, pulls)
        return found


def position_derivative(assembly: MechanismSystem, function: Callable[[Array], Array], q: Array) -> Array:
    """∂function/∂q (m, coordinates) of the functions above, (T, m) of q (T, coordinates)."""
    steps = np.diag(STEP * _sizes(assembly))
    ways = ((function(q + k * steps) - function(q - k * steps)).T for k in range(1, 1 + len(CENTRAL)))
    found: Array = sum(weight * way for weight, way in zip(CENTRAL, ways, strict=True)) / steps.diagonal()
    return found


def _sizes(assembly: MechanismSystem) -> Array:
    """Natural sizes of coordinates (coordinates,), of p no more than what turns a section by a radian."""
    sizes = assembly.scales.copy()
    for first, body in zip(assembly.first, assembly.model.bodies, strict=True):
        turning = [np.abs(point.rotation) for point in body.points.values()]
        of_p = slice(first + 3, first + 3 + body.n_modes)
        sizes[of_p] = 1.0 / np.max([1.0 / sizes[of_p], *turning], axis=0)
    return sizes


def _tiled(count: int, *x: Array) -> tuple[Array, ...]:
    """Each (count, n) of (n,)."""
    return tuple(np.tile(values, (count, 1)) for values in x)
