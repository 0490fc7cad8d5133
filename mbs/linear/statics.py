"""Static equilibrium under gravity, given loads and the constraints at one time: one Newton's method for all callers.

With Q of gravity, elasticity and loads, and constraint equations C = 0 of which λ are the multipliers,

    Q(q, t) − C_vᵀ λ = 0,  C(q, t) = 0;      [K  C_vᵀ] [δ ]   [Q − C_vᵀ λ]
                                             [C_v   0] [δλ] = [   −C     ],   K = ∂(C_vᵀ λ − Q)/∂q.

The core has K from dual numbers. λ are at every step those of least squares at q (Nocedal and Wright, Numerical
Optimization, 2006, sec. 18.3), so that nothing adds up in them; of equations that depend on others there they are 0.
"""

from collections.abc import Callable, Container, Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Booleans, Indices, null_space
from ...common.errors import SolveError, quoted
from ...common.libraries import scipy
from .. import _core
from ..model.body import Body
from ..model.known_motion import State
from ..model.model import NO_SLOPE, Model
from ..model.system import MultibodySystem
from ..posture.start import AWAY, rates_on_rows

MOST_ITERATIONS = 60
FEW_ITERATIONS = 12  # from a posture next to it
LEAST_PART = 1 / 64  # of the loads, by which they grow
TOLERANCE = 1e-12  # residual forces relative to the largest that meet, positions to the size of the robot
ROUND_OFF = 4 * np.finfo(float).eps  # of coordinates, which stiff springs turn into forces
LARGEST_STEP = 0.3  # rad, sizes of the robot, and of p the same in sizes of its own
SLACK = 1e-3  # of the largest force over its natural size: less stiffness is none
SINGULAR = 1e-12  # of the largest singular value of scaled equations: below it nothing resists
DEPENDENT = 1e-12  # of the largest singular value of rows: below it they depend on others
UNSTABLE = -1e-7  # of the stiffness of single coordinates: closer to none is round-off
SETTLED = 1e-14  # of a shape's size: what the next step would change
SLOW = 0.1  # of a step, the next one: derivatives are taken again
NEIGHBORS = 20  # times that begin with the derivatives of the first of them
STRAIGHT = 1e-3  # of the size of modes, below which a shape counts as none
INDEPENDENT = 1e-7  # of the largest row, what others must leave of one that has a multiplier
MISSED = 1e-6  # rad, sizes of the robot: constraint equations that are off by more are the cause
SLACKEST = 1e-12  # of the largest stiffness over its natural size: less is round-off
TINY = 1e-300


def initial_state(model: Model, undeformed: State) -> State:
    """The state that the scene starts from: links undeformed, or in equilibrium near that.

    Raises `SolveError` where there is no equilibrium near it.
    """
    return static_equilibrium(model, undeformed) if model.scene.initial.state == "static" else undeformed


def hanging_joints(model: Model, undeformed: State, start: State, among: Container[str] | None = None) -> Iterator[str]:
    """Yield warnings where the equilibrium `start` is unstable, or has joints away from `undeformed`.

    Joints `among` these count; without any, all, where [initial] asks for an equilibrium.
    """
    if among is None and model.scene.initial.state != "static":
        return
    away, scales, moved = np.abs(start.q - undeformed.q), model.joint_sizes, []
    for node in model.tree.nodes:
        sizes = np.append(scales[node.v], np.ones(node.joint.q_count - node.joint.freedoms))
        if (away[node.q] / sizes).max(initial=0.0) > AWAY and (among is None or node.joint.name in among):
            moved.append(node.joint.name)
    if moved:
        yield (
            f"joints {quoted(moved)} hang, away from [initial], as no trajectory holds them there; motions start there"
            ' with state = "undeformed"'
        )
    yield from Statics(model).unstable_ways(start.q)


def newton(
    correct: Callable[[Array, Indices], tuple[Array, Booleans]],
    move: Callable[[Array, Array], Array],
    states: Array,
    most: int = MOST_ITERATIONS,
) -> tuple[Array, Booleans]:
    """Newton's method from `states` (T, …), any unit, in at most `most` steps: last states, and which converge (T,).

    `correct`(states, their numbers), called for those that do not converge yet, returns their steps (T, n), scaled to
    order 1, and which converge with these (T,). `move`(states, steps) returns the next states.
    """
    states, met, going = states.copy(), np.zeros(len(states), dtype=bool), np.arange(len(states))
    for _ in range(most):
        step, is_met = correct(states[going], going)
        known = np.isfinite(step).all(axis=1)
        longest = np.abs(step).max(axis=1, initial=0.0)
        step, going = step[known] * np.minimum(1.0, LARGEST_STEP / np.maximum(longest, TINY))[known, None], going[known]
        states[going], met[going] = move(states[going], step), is_met[known]
        going = going[~met[going]]
        if not len(going):
            break
    return states, met


class Balance(NamedTuple):
    """Forces and m constraint equations at a posture, in natural sizes: N·m, rad, sizes of the robot and of modes."""

    load: Array  # (n_v,) Q
    left: Array  # (n_v,) Q − C_vᵀ λ
    missed: Array  # (m,) C
    gradient: Array  # (m, n_v) C_v, 0 of equations that depend on others
    multipliers: Array  # (m,) λ in N·m, 0 of equations that depend on others
    independent: list[int]  # numbers of the other equations
    size: float  # N·m, of the largest single force


Relief = tuple[Array | float, Array | float]
"""What is taken off loads (n_v,) and equations (rows,), in natural sizes."""


class Statics:
    """A model at rest at time t (s), q in rad and m, with Newton's method for its equilibria, for many postures."""

    def __init__(self, model: Model, t: float = 0.0) -> None:
        self.model, self.t, self.system = model, t, MultibodySystem(model)
        self.sizes, self.row_sizes, self.length = model.natural_sizes, model.row_sizes, model.size

    def equilibrium(self, q: Array, locked: Indices | None = None) -> Array:
        """The equilibrium that Newton's method reaches from q, both (n_q,), rad and m.

        Coordinates of v with numbers `locked` stay. Raises `SolveError` where it reaches none.
        """
        tree = self.model.tree
        free = np.delete(np.arange(tree.n_v), [] if locked is None else locked)
        rest, is_met, cause = self._newton(q, free)
        if not is_met:
            rest, is_met = self._loaded(q, free)
        for node in tree.nodes if is_met else ():
            if np.sum(rest[node.p_q] ** 2) > node.body.largest_moment:
                is_met, cause = False, f'"{node.body.name}" bends by more than its length there'
        if not is_met:
            raise SolveError(
                f"{self.model.scene.path}: no static equilibrium was found near the initial posture: {cause}. Without"
                " motors or trajectories, or with links too soft for their loads, there may be none; else give joint"
                " coordinates closer to it"
            )
        return rest

    def _newton(
        self, q: Array, free: Indices, relief: Relief = (0.0, 0.0), most: int = MOST_ITERATIONS
    ) -> tuple[Array, bool, str]:
        """Where Newton's method gets from q (n_q,), whether that is met, and what else is left there."""
        cause = ""

        def correct(states: Array, _: Indices) -> tuple[Array, Booleans]:
            nonlocal cause
            at, step = self.balance(states[0], free, relief), np.zeros((1, self.model.tree.n_v))
            if not np.isfinite(at.size):
                return np.full_like(step, np.nan), np.zeros(1, dtype=bool)
            K = self.stiffness(states[0], at)
            round_off = ROUND_OFF * (np.abs(K) @ self._natural(states[0]))
            excess = (np.abs(at.left) / (TOLERANCE * at.size + round_off + TINY))[free]
            is_met = excess.max(initial=0.0) <= 1.0 and np.abs(at.missed).max(initial=0.0) <= TOLERANCE
            if not is_met:
                step[0, free] = _step(at, K, free)
                cause = self._cause(at, int(free[excess.argmax()]))
            return step, np.array([is_met])

        rest, is_met = newton(correct, lambda at, step: self.model.tree.integrate(at, step * self.sizes), q[None], most)
        return rest[0], bool(is_met[0]), cause

    def _loaded(self, q: Array, free: Indices) -> tuple[Array, bool]:
        """The equilibrium that q (n_q,) comes to as the loads on it grow from nothing, and whether it does.

        A homotopy as in E. L. Allgower and K. Georg, Numerical Continuation Methods, 1990, ch. 1.
        """
        at = self.balance(q, free)
        taken, part = 0.0, 0.5
        while taken < 1.0 and part >= LEAST_PART and np.isfinite(at.size):
            left = 1.0 - min(taken + part, 1.0)
            rest, is_met, _ = self._newton(q, free, (left * at.load, left * at.missed), FEW_ITERATIONS)
            if is_met:
                q, taken = rest, 1.0 - left
                part = min(2.0 * part, left)
            else:
                part /= 2.0
        return q, taken == 1.0

    def balance(self, q: Array, free: Indices, relief: Relief = (0.0, 0.0)) -> Balance:
        """Forces and constraint equations at q (n_q,), rad and m, less `relief`: what is taken off each.

        Multipliers balance the forces best along v[`free`].
        """
        at, J = self._at_rest(q)
        independent = _independent(J[:, free])
        J[np.setdiff1d(np.arange(len(J)), independent)] = 0.0
        Q = at.Q * self.sizes - relief[0]
        missed = self.model.row_signs * at.value / self.row_sizes - relief[1]
        multipliers = np.linalg.lstsq(J[:, free].T, Q[free], rcond=DEPENDENT)[0]
        elastic = np.zeros_like(Q)
        for node in self.model.tree.nodes:
            elastic[node.p_v] = node.body.stiffness * q[node.p_q]
        elastic *= self.sizes
        outer = np.array([at.force * self.length, at.moment])
        terms = (Q, Q + elastic, elastic, J * multipliers[:, None], outer)
        size = max(float(np.abs(term).max(initial=0.0)) for term in terms)
        return Balance(Q, Q - multipliers @ J, missed, J, multipliers, independent=independent, size=size)

    def stiffness(self, q: Array, at: Balance) -> Array:
        """Exact slopes (n_v, n_v), natural sizes, of constraint forces less loads at q (n_q,), SI; see `at`."""
        multipliers = at.multipliers / self.row_sizes * self.model.row_signs
        K = self.system.core.stiffness_at_rest(self.system.scene, self.t, q, multipliers, at.independent)
        return K * self.sizes * self.sizes[:, None]

    def holding_multipliers(self, q: Array) -> Array:
        """Multipliers, N or N·m, by equation, that balance loads at q (n_q,), SI; the least if some are redundant."""
        at, J = self._at_rest(q)
        return np.linalg.lstsq(J.T, at.Q * self.sizes, rcond=DEPENDENT)[0] / self.row_sizes

    def unstable_ways(self, q: Array) -> Iterator[str]:
        """Yield a warning if the equilibrium q (n_q,), rad and m, is unstable.

        Then `stiffness` has a negative eigenvalue in the directions that constraints leave free.
        """
        tree = self.model.tree
        at = self.balance(q, np.arange(tree.n_v))
        K = self.stiffness(q, at)
        scale = _scales(K, at.size)
        free = null_space(at.gradient * scale, DEPENDENT)
        values, shapes = np.linalg.eig(free.T @ (K * scale * scale[:, None]) @ free)
        if not len(values) or values.real.min() > UNSTABLE:
            return
        moved = np.abs(free @ shapes[:, values.real.argmin()])
        node = max(tree.nodes, key=lambda node: float(moved[np.r_[node.v, node.p_v]].max(initial=0.0)))
        bends = moved[node.p_v].max(initial=0.0) > moved[node.v].max(initial=0.0)
        what = (
            f'"{node.body.name}" buckles' if bends else f'joint "{node.joint.name}" leaves it; start near another one'
        )
        yield f"the equilibrium is unstable: after any disturbance {what}"

    def _at_rest(self, q: Array) -> tuple[_core.ForcesAtRest, Array]:
        """What the core finds at q (n_q,), and C_v (rows, n_v) in natural sizes."""
        at = self.system.core.forces_at_rest(self.system.scene, self.t, q)
        C_v = (self.model.row_signs / self.row_sizes)[:, None] * at.C_q * self.sizes
        return at, np.where(np.abs(C_v) > NO_SLOPE, C_v, 0.0)

    def _natural(self, q: Array) -> Array:
        """|q| (n_v,) in natural sizes, 1 of orientations; of links without loads, not 0 but round-off."""
        sizes = np.ones(self.model.tree.n_v)
        for node in self.model.tree.nodes:
            if node.joint.q_count == node.joint.freedoms:
                sizes[node.v] = np.abs(q[node.q]) / self.sizes[node.v]
            sizes[node.p_v] = np.abs(q[node.p_q]) / self.sizes[node.p_v] + np.finfo(float).eps
        return sizes

    def _cause(self, at: Balance, worst: int) -> str:
        """What is left at a posture that is none in equilibrium, `worst` along v."""
        if at.missed.size and np.abs(at.missed).max() > MISSED:
            return f'"{self.model.rows[int(np.abs(at.missed).argmax())].owner}" cannot be met with links that bend so'
        node = next(node for node in self.model.tree.nodes if node.v.start <= worst < node.p_v.stop)
        what = f'joint "{node.joint.name}"' if worst < node.p_v.start else f'"{node.body.name}"'
        slides = worst in [node.v.start + k for k, axis in enumerate(node.joint.axes) if axis < 3]
        left = f"{abs(at.left[worst]):.3g} {'N' if slides else 'N·m'}"
        return f"after {MOST_ITERATIONS} steps of Newton's method {left} are left at {what}"


def _independent(J: Array) -> list[int]:
    """Which rows of J (m, k) do not depend on others: of each set of those that do, the largest."""
    if not J.size:
        return []
    R, order = scipy.linalg.qr(J.T, mode="r", pivoting=True)
    return sorted(order[: np.count_nonzero(np.abs(np.diag(R)) > INDEPENDENT * np.abs(R[0, 0]))].tolist())


def _scales(K: Array, size: float) -> Array:
    """Increments (n,) that single stiffnesses make of one size."""
    return 1 / np.sqrt(np.maximum(np.abs(np.diag(K)), max(SLACK * size, SLACKEST * np.abs(K).max(initial=0.0), TINY)))


def _step(at: Balance, K: Array, free: Indices) -> Array:
    """Newton's step along v[`free`], the least where nothing resists."""
    K, J = K[np.ix_(free, free)], at.gradient[at.independent][:, free]
    scale = _scales(K, at.size)
    J = J * scale
    of_rows = np.linalg.norm(J, axis=1)
    J, m = J / of_rows[:, None], len(J)
    matrix = np.block([[K * scale * scale[:, None], J.T], [J, np.zeros((m, m))]])
    right = np.concatenate([at.left[free] * scale, -at.missed[at.independent] / of_rows])
    return np.linalg.lstsq(matrix, right, rcond=SINGULAR)[0][: len(free)] * scale


def static_equilibrium(model: Model, start: State) -> State:
    """The equilibrium at t = 0 near `start`, v meeting the constraints. Raises `SolveError` where there is none."""
    q = Statics(model).equilibrium(start.q)
    return State(q, rates_on_rows(model, q, start.v))


def static_shapes(
    omega: Array,
    sizes: Array,
    forces: Callable[[Array, Indices], Array],
    stiffness: Callable[[Array, Indices], Array],
    count: int,
) -> tuple[Array, Booleans]:
    """Modal coordinates p (T, n), m·√kg, of all bodies with zero `forces` at T = `count` times; which are found (T,).

    `omega`, `sizes` (n,): frequencies of the modes, rad/s, and p, m·√kg, that bends a link by about its length: beyond
    it nothing counts as found. `forces`(p, numbers of times) returns residual modal forces (k, n), N/√kg, with joints
    that follow p; `stiffness` returns their derivative (k, n, n), 1/s²: at one of `NEIGHBORS` times at first, then at
    each time whose steps shrink slowly.
    """
    K, ratio, before = np.zeros((count, len(omega), len(omega))), np.full(count, SLOW), np.full(count, np.inf)
    least = STRAIGHT * float((omega * sizes).min(initial=np.inf))

    def correct(p: Array, going: Indices) -> tuple[Array, Booleans]:
        r, slow = forces(p, going), ratio[going] > SLOW
        if not K.any():
            K[:] = stiffness(p[::NEIGHBORS], going[::NEIGHBORS])[going // NEIGHBORS]
            slow = ~np.isfinite(K).all(axis=(1, 2))
        if slow.any():
            K[going[slow]] = stiffness(p[slow], going[slow])
        known = np.isfinite(r).all(axis=1) & np.isfinite(K[going]).all(axis=(1, 2))
        step = np.full_like(p, np.nan)
        step[known] = -np.linalg.solve(K[going[known]], r[known, :, None])[:, :, 0]
        size = np.linalg.norm(omega * step, axis=1) / (np.linalg.norm(omega * (p + step), axis=1) + least)
        is_seen = (before[going] < np.inf) & (size > 10 * SETTLED)  # steps below that are round-off
        ratio[going] = np.where(is_seen, size / before[going], np.minimum(ratio[going], SLOW))
        before[going] = size
        return step / sizes, size * np.minimum(ratio[going], 1.0) <= SETTLED

    p, is_met = newton(correct, lambda p, step: p + step * sizes, np.zeros((count, len(omega))))
    return p, is_met & (np.abs(p) <= sizes).all(axis=1)


def modal_sizes(bodies: Iterable[Body]) -> Array:
    """Modal coordinates (n,), m·√kg, that deflect each body by about its length."""
    return np.concatenate([np.full(body.n_modes, np.sqrt(body.largest_moment)) for body in bodies])
