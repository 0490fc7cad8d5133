"""Newton's steps of a tracking problem (`problem`): quadratic programs in the values at breaks of its intervals."""

from collections.abc import Mapping
from itertools import product
from math import comb, factorial

import numpy as np

from ...common.arrays import Array, Indices, PPoly
from ...common.libraries import scipy
from ...common.structs import struct
from ..inversion.collocation import GAUSS, Elimination, between, piecewise, stage_states
from .interior_point import GAP, Minimum, Program, minimize
from .transition import RATE, Tracked, Transition, displaced_at, forces_off_path

TOLERANCE = 1e-8  # of the last Newton step, relative to the peak of its quantity
# second derivative by ξ of the cubic through values at the Gauss points, four by four
POWERS = np.arange(2, len(GAUSS.c))
CURVATURE = (GAUSS.c[:, None] ** (POWERS - 2) * POWERS * (POWERS - 1)) @ GAUSS.to_powers[2:]
# Bernstein's coefficients (5, 4) on [0, 1] of a polynomial's integral, by its values at the Gauss points
BERNSTEIN = np.array([[comb(i, k) / (k * comb(4, k)) for k in range(1, 5)] for i in range(5)]) @ GAUSS.to_powers
FIFTHS, THIRDS = np.linspace(0.0, 1.0, 5), np.linspace(0.0, 1.0, 4)
# Bernstein's coefficients of polynomials by their values there
OF_FIFTHS, OF_THIRDS = (
    np.linalg.inv([[comb(m, k) * x**k * (1 - x) ** (m - k) for k in range(m + 1)] for x in at])
    for m, at in ((4, FIFTHS), (3, THIRDS))
)
# of a cubic on both halves of an interval, without the last one, which is the first of the next half
HALVES, OF_HALVES = np.concatenate([THIRDS, 1.0 + THIRDS]) / 2, np.kron(np.eye(2), OF_THIRDS[:3])
UNIQUE = 1e-7  # of the effort, which chooses among motions of the same least share
BEND = 1e-5  # of the square of ë, relative to its limit, in the objective: it makes e unique, and smooth


@struct
class Curves:
    """`count` voltages V(t), or path errors e(t), whose derivative of `order` is linear between `breaks` (N + 1,), s.

    On an interval they follow from this derivative at both ends, and from V and the lower derivatives at its start:
    `places` (order + 2,) are the first numbers of these among the `width` unknowns z of an interval. SI units.
    """

    breaks: Array
    order: int
    count: int
    places: Indices
    width: int

    def curve(self, u: Array) -> PPoly:
        """V(t) by `u` (N + 1, count (order + 1)), SI, at breaks: the linear derivative, then V and the lower ones."""
        linear, *lower = np.split(u, self.order + 1, axis=1)
        slope = np.diff(linear, axis=0) / (factorial(self.order + 1) * np.diff(self.breaks)[:, None])
        powers = [of[:-1] / factorial(k) for k, of in enumerate([*lower, linear])]
        return scipy.interpolate.PPoly(np.array([slope, *powers[::-1]]), self.breaks)

    def _parts(self, xi: Array, derivative: int) -> Array:
        """A derivative of V at shares ξ (S,) of intervals, (N, S, order + 2), by what it follows from."""
        h, times = np.diff(self.breaks)[:, None], self.order - derivative  # times it is integrated
        *lower, constant = (
            (h * xi) ** k / factorial(k) if k >= 0 else 0.0 * h * xi for k in range(-derivative, times + 1)
        )
        last = h**times * xi ** (times + 1) / factorial(times + 1)
        return np.stack([constant - last, last, *lower], axis=2)

    def by_z(self, xi: Array, derivative: int = 0) -> Array:
        """Matrices (N, S, count, width), SI, from the unknowns z to a derivative at shares ξ (S,) of intervals."""
        parts, each = self._parts(xi, derivative), np.arange(self.count)
        by_z = np.zeros((*parts.shape[:2], self.count, self.width))
        for k, place in enumerate(self.places):
            by_z[:, :, each, place + each] = parts[:, :, k, None]
        return by_z

    def squares(self, weights: Array, derivative: int) -> Array:
        """Quadratic forms (N, width, width) of Σ weights |derivative|², weights (N, 4), SI, at Gauss points."""
        parts, each = self._parts(GAUSS.c, derivative), np.arange(self.count)
        squares = np.einsum("Ns,Nsa,Nsb->abN", weights, parts, parts)
        found = np.zeros((len(parts), self.width, self.width))
        for (i, first), (j, second) in product(enumerate(self.places), repeat=2):
            found[:, first + each, second + each] += squares[i, j][:, None]
        return found


@struct
class Iterate:
    """p, ṗ = v, V and e at breaks (N+1, …), p̈ = K at Gauss points (N, 4, n), σ = `share`, and their minimum; SI units.

    With compliant gears V are V̈, V and V̇ side by side; e are ë, e and ė. `moved`: size of the last step, relative.
    """

    p: Array
    v: Array
    K: Array
    V: Array
    e: Array
    share: float
    found: Minimum | None = None
    converged: bool = False
    iterations: int = 0
    moved: float = np.inf

    def tracked(self, steps: "Steps") -> Tracked:
        """The motion as piecewise polynomials, with effort and its decrease per unit of limits by `steps`."""
        assert self.found is not None
        breaks, steps.sigma = steps.breaks, self.share
        cost = steps.cost(self.found)
        return Tracked(
            piecewise(GAUSS, breaks, self.p, self.v, self.K),
            steps.voltages.curve(self.V),
            self.converged,
            self.iterations,
            self.share,
            cost=0.0 if steps.has_share else cost,
            prices=steps.prices(self.found),
            objective=steps.asked.objective,
            step=self.moved,
            found=self.found,
            added=steps.unique * cost if steps.has_share else 0.0,
            error=steps.errors.curve(self.e) if self.e.shape[1] else None,
        )


class Steps:
    """Newton's steps, each the minimum of the linearized problem in x = (V, p, ṗ, σ) at breaks.

    The motion between two breaks depends on z_k = (x_k, V_{k+1}). With compliant gears x = (V̈, p, ṗ, V, V̇, σ), and
    z_k = (x_k, V̈_{k+1}).

    σ is the constant share of limits, an unknown where it is the objective. A little of the effort then picks one of
    many V(t); where Newton's steps would wander among them, enough of it for steps that shrink, and then less.
    Steps of the effort leave out the curvature of constraints; where that matters they need not shrink, and are damped.
    """

    program: Program
    tolerance, gap = TOLERANCE, GAP
    effort: tuple[Array, Array, float]  # H, g, and the constant that the program leaves out
    unique, damping = UNIQUE, 0.0  # shares of the effort, and of sizes of steps, in the objective
    of_voltages: float | Array = 1.0  # (N,), no unit, times the share of the effort
    rows: list[tuple[str, Array, Indices]]  # of inequalities: kind, limits (i,), SI, and whose they are (i,)

    def __init__(self, asked: Transition, breaks: Array, tau_qs: Array, size: float) -> None:
        self.asked, self.breaks, self.h, self.tau_qs, self.size = asked, breaks, np.diff(breaks), tau_qs, size
        self.n, self.m = asked.Phi_V.shape
        self.has_share = asked.objective != "effort"
        k, lower = asked.errors, asked.order * self.m
        self.controls, self.y = slice(0, self.m + k), slice(self.m + k, self.m + k + 2 * self.n)
        self.states = slice(self.y.start, self.y.stop + lower + 2 * k)
        self.width = self.states.stop + self.has_share
        places = np.append([0, self.width], self.y.stop + self.m * np.arange(asked.order))
        self.voltages = Curves(breaks, asked.order, self.m, places, self.width + self.m + k)
        places = np.array([self.m, self.width + self.m, self.y.stop + lower, self.y.stop + lower + k])
        self.errors = Curves(breaks, 2, k, places, self.width + self.m + k)
        self.sigma, pace = 1.0, asked.weights.rate or RATE  # below: sizes that divide unknowns
        volts, error = np.full(self.m, asked.weights.voltage), np.full(k, asked.allowed)
        sizes = [size / asked.driven.scale, np.full(self.n, size)]
        sizes += [volts / pace**order for order in range(asked.order)]
        controls = [volts / pace**asked.order]
        if asked.tolerance is not None:
            sizes += [error, error / asked.tolerance.time]
            controls.append(error / asked.tolerance.time**2)
        self.state_unit, control = np.concatenate(sizes), np.concatenate(controls)
        self.unit = np.concatenate([control, self.state_unit, np.ones(int(self.has_share))])
        self.unit_z = np.concatenate([self.unit, control])

    def take(self, now: Iterate) -> Iterate:
        """The iterate after the Newton step from `now`, with the minimum it comes from."""
        n, x = self.n, self._at_breaks(now)
        z, (N, s, _) = self._z(x), now.K.shape
        states = [*stage_states(GAUSS, self.h, now.p, now.v, now.K), now.K]
        forces, slopes, by_z = self._forces(states, z)
        stages = Elimination(GAUSS, self.h, [of[:, :, :n] for of in slopes])
        left = forces[:, :, :n].reshape(N, s * n, 1)
        moved = -(stages.E_inverse @ left).reshape(N, s, n)  # of K, with all at breaks as it is
        K_z = -(stages.E_inverse @ by_z[:, :, :n].reshape(N, s * n, -1)).reshape(N, s, n, -1)
        K_z[..., self.y] += stages.response
        starts = np.zeros((2, n, len(self.unit_z)))
        starts[:, :, self.y] = np.eye(2 * n).reshape(2, n, 2 * n)
        ends = [*stages.at_end(starts[0], starts[1], K_z)]
        reached = [*stages.at_end(now.p[:-1], now.v[:-1], now.K + moved)]
        for unknowns in (self.voltages, self.errors):
            for order in range(unknowns.order if unknowns.count else 0):
                ends.append(unknowns.by_z(np.ones(1), order)[:, 0])
                reached.append(np.einsum("Nmz,Nz->Nm", ends[-1], z))
        offset = np.concatenate(reached, axis=1) - x[1:, self.states]
        tau, tau_z = self._torques(forces[:, :, n:], [of[:, :, n:] for of in slopes], moved, (starts, K_z))
        charges = self._charges(now.v, now.K + moved, (starts[1], K_z))
        of_motors = self._at_motors(tau), self._at_motors(tau_z + by_z[:, :, n:])
        self.program = self._program(np.concatenate(ends, axis=1), offset, *of_motors, x, charges)
        least = minimize(self.program, self.gap, now.found)
        change = least.x * self.unit
        K = now.K + moved + np.einsum("Nsnz,Nz->Nsn", K_z, self.program.z(change), optimize=True)
        return self._iterate(x + change, K, least)

    def _at_breaks(self, now: Iterate) -> Array:
        """All unknowns at breaks, x (N + 1, width)."""
        m, k = self.m, self.asked.errors
        sigma = np.full((len(now.p), int(self.has_share)), self.sigma)
        return np.concatenate([now.V[:, :m], now.e[:, :k], now.p, now.v, now.V[:, m:], now.e[:, k:], sigma], axis=1)

    def _iterate(self, x: Array, K: Array, found: Minimum) -> Iterate:
        """What `_at_breaks` puts together, and σ, which is kept."""
        controls, lower = x[:, self.controls], x[:, self.y.stop : self.states.stop]
        p, v = np.split(x[:, self.y], 2, axis=1)
        volts, errors = np.split(lower, [self.m * self.asked.order], axis=1)
        V, e = np.hstack([controls[:, : self.m], volts]), np.hstack([controls[:, self.m :], errors])
        self.sigma = float(x[0, -1]) if self.has_share else 1.0
        return Iterate(p, v, K, V, e, share=self.sigma, found=found)

    def _z(self, x: Array) -> Array:
        """All z_k (N, width + controls) of x."""
        return np.hstack([x[:-1], x[1:, self.controls]])

    def _forces(self, states: list[Array], z: Array) -> tuple[Array, list[Array], Array]:
        """Forces left on modes, and torques, (N, s, n + motors) at stages with these p, ṗ, p̈ (N, s, n).

        Their derivatives by p̈, ṗ and p, (N, s, n + motors, n), and by `z` without these, (N, s, n + motors, …).
        """
        (N, s, n), times = states[0].shape, between(self.breaks, GAUSS.c)
        at, driven = [of.reshape(-1, n) for of in states], self.asked.driven
        supplied = self.asked.Phi_V @ self.voltages.by_z(GAUSS.c)
        if self.errors.count:
            e_z = np.array([self.errors.by_z(GAUSS.c, order) for order in range(3)])
            off = np.einsum("oNskz,Nz->oNsk", e_z, z).reshape(3, len(times), -1)
            now, slopes = forces_off_path(driven, times, at, off)
            by_z = (slopes.reshape(3, N, s, -1, self.errors.count) @ e_z).sum(axis=0)
            driven = displaced_at(driven, times, off)
        else:
            now = np.hstack(driven.forces(times, *at))
            by_z = np.zeros((N, s, now.shape[1], len(self.unit_z)))
        forces = now.reshape(N, s, -1)
        by_z[:, :, :n] -= supplied
        forces[:, :, :n] -= np.einsum("Nsnz,Nz->Nsn", supplied, z, optimize=True)
        return forces, [of.reshape(N, s, -1, n) for of in driven.slopes(times, *at)], by_z

    def _at_motors(self, values: Array) -> Array:
        """Torques of motors (N, s, motors, …) at stages, or slopes, by those with rigid gears and transmitted ones."""
        if (gears := self.asked.gears) is None:
            return values
        motors, share = values.shape[2] - len(gears.joints), np.outer(self.h**-2, gears.inertia / gears.stiffness)
        of_motors = values[:, :, :motors].copy()
        of_motors[:, :, gears.columns] += np.einsum("Nk,ij,Njk...->Nik...", share, CURVATURE, values[:, :, motors:])
        return of_motors

    def _torques(self, tau: Array, slopes: list[Array], moved: Array, by_z: tuple[Array, Array]) -> tuple[Array, Array]:
        """τ (N, s, motors) at stages once K has `moved`, and its derivatives (N, s, motors, width + m) by z."""
        h, with_moved = self.h[:, None, None, None], np.concatenate([by_z[1], moved[..., None]], axis=3)
        p_0, v_0 = np.pad(by_z[0], ((0, 0), (0, 0), (0, 1)))
        once, twice = (np.einsum("ij,Nj...->Ni...", a, with_moved) for a in (GAUSS.stage_once, GAUSS.stage_twice))
        p_z = p_0 + GAUSS.c[:, None, None] * h * v_0 + h**2 * twice
        by_K, by_v, by_p = slopes
        found = by_p @ p_z + by_v @ (v_0 + h * once) + by_K @ with_moved
        return tau + found[..., -1], found[..., :-1]

    def _charges(self, v: Array, K: Array, by_z: tuple[Array, Array]) -> tuple[Array, Array]:
        """Φ_Vᵀ ṗ (N, 5, m), A, by Bernstein's coefficients, which bound it between breaks, and its derivatives by z."""
        if not np.isfinite(self.asked.limits.patches.current).any() and self.asked.objective != "least-current":
            return np.zeros((len(self.h), 0, self.m)), np.zeros((len(self.h), 0, self.m, len(self.unit_z)))
        v_z, K_z = by_z
        v_0 = v[:-1, None] + self.h[:, None, None] * np.einsum("ij,Njn->Nin", BERNSTEIN, K)
        v_z = v_z + self.h[:, None, None, None] * np.einsum("ij,Nj...->Ni...", BERNSTEIN, K_z)
        return v_0 @ self.asked.Phi_V, np.einsum("nm,Ninz->Nimz", self.asked.Phi_V, v_z)

    def _program(
        self, ends: Array, offset: Array, tau_0: Array, tau_z: Array, x: Array, charges: tuple[Array, Array]
    ) -> Program:
        """For changes of `x` (N+1, width) in `unit`: what is left stays small against what cancels."""
        n, width, (N, states) = self.n, self.width, offset.shape
        tau_z = tau_z * self.unit_z
        ends = ends * self.unit_z / self.state_unit[:, None]
        F, G = -ends[..., :width], np.zeros((N, states, width))
        G[..., self.controls], G[..., self.states] = -ends[..., width:], np.eye(states)
        c = offset / self.state_unit
        now = x / self.unit
        H, g = self._effort(tau_0, tau_z, now)
        if self.has_share:
            H, g = self.unique * H, self.unique * g
            g[0, width - 1] += 1.0
            keep = np.zeros((N, 1, width))
            keep[..., -1] = 1.0
            F, G, c = np.hstack([F, -keep]), np.hstack([G, keep]), np.hstack([c, np.zeros((N, 1))])
        C, d = self._inequalities({"torque": (tau_0, tau_z)} | self._of_patches(x, charges))
        at_rest = [slice(self.states.start, self.states.stop)] if self.asked.is_free else [slice(self.m), self.states]
        rows = np.vstack([np.eye(width)[part] for part in at_rest])
        rest = np.zeros((2, width))
        rest[:, self.y.start : self.y.start + n] = self.asked.rest / self.state_unit[:n]
        start, end = (rest - now[[0, -1]]) @ rows.T
        return Program(H, g, F, G, c, start=(rows, start), end=(rows, end), C=C, d=d)

    def _effort(self, tau_0: Array, tau_z: Array, now: Array) -> tuple[Array, Array]:
        """H and g of J."""
        weights = self.asked.weights
        whole = self.breaks[-1] - self.breaks[0]
        b = self.h[:, None] * GAUSS.end_once / (whole * weights.torque**2)  # (N, s)
        off = tau_0 - self.tau_qs
        H = np.einsum("Ns,Nsta,Nstb->Nab", b, tau_z, tau_z, optimize=True)
        g = np.einsum("Ns,Nsta,Nst->Na", b, tau_z, off, optimize=True)
        share, others = (self.of_voltages * self.h)[:, None] * GAUSS.end_once / whole, np.zeros_like(H)
        for order in (0, max(1, self.voltages.order)):
            others += self.voltages.squares(share * (weights.rate**order / weights.voltage) ** 2, order)
        if (allowed := self.asked.tolerance) is not None:
            share = BEND / (self.unique if self.has_share else 1.0) * self.h[:, None] * GAUSS.end_once / whole
            others += self.errors.squares(share / allowed.acceleration**2, 2)
        others *= self.unit_z[:, None] * self.unit_z
        z = self._z(now)[..., None]
        pull = (others @ z)[..., 0]
        constant = 0.5 * float(np.einsum("Ns,Nst->", b, off**2) + (pull * z[..., 0]).sum())
        each = np.arange(self.y.stop)
        H[:, each, each] += self.damping * self.h[:, None] / whole
        self.effort = H + others, g + pull, constant
        return self.effort[:2]

    def _of_patches(self, x: Array, charges: tuple[Array, Array]) -> dict[str, tuple[Array, Array]]:
        """What patches, and path errors, may have limits of: values (N, rows, …) and derivatives by z.

        "end" are voltages, "curving" ë, "curving end" that at the end.
        """
        z, C = self._z(x), self.asked.limits.patches.capacitance

        def values(by_z: Array, of: Array | float = 0.0, slopes: Array | float = 0.0) -> tuple[Array, Array]:
            return of + np.einsum("Nsmz,Nz->Nsm", by_z, z, optimize=True), (slopes + by_z) * self.unit_z

        within = np.zeros(1) if self.voltages.order == 0 else np.append(0.0, GAUSS.c)  # linear ones at breaks alone
        limited = {"voltage": values(self.voltages.by_z(within))}
        if self.asked.errors:
            by_end = self.errors.by_z(np.ones(1), 2)
            by_end[:-1] = 0.0
            limited |= {
                "error": values(np.einsum("ij,Njkz->Nikz", OF_HALVES, self.errors.by_z(HALVES))),
                "curving": values(self.errors.by_z(np.zeros(1), 2)),
                "curving end": values(by_end),
            }
        if self.asked.is_free and self.voltages.order == 0:  # else V ends at zero
            by_end = self.voltages.by_z(np.ones(1))
            by_end[:-1] = 0.0
            limited["end"] = values(by_end)
        if self.asked.limits.patches.has_rates:
            limited["slew"] = values(self.voltages.by_z(within, 1))
        if charges[0].shape[1]:
            rates = np.einsum("ij,Njmz->Nimz", OF_FIFTHS, self.voltages.by_z(FIFTHS, 1))
            limited["current"] = values(C @ rates, *charges)
        return limited

    def _inequalities(self, values: Mapping[str, tuple[Array, Array]]) -> tuple[Array, Array]:
        """C and d: limits of voltages at breaks, of rates, currents and path errors between, of torques at stages.

        `values` (N, rows, …) with their derivatives by z.
        """
        limits, ranges, self.rows, rows, most = self.asked.limits, self.asked.ranges, [], [], []
        of = limits.patches
        known = ranges | {"voltage": of.range, "slew": of.slew, "current": of.current, "torque": limits.torque}
        for name, (now, by_z) in values.items():
            kind = "voltage" if name == "end" else name.removesuffix(" end")
            is_shared = self.asked.objective == f"least-{kind}"
            finite = np.isfinite(np.atleast_2d(known[kind])).any(axis=0)
            bounded = np.arange(now.shape[2]) if is_shared else np.flatnonzero(finite)
            for limit in ranges[kind][:, bounded]:
                slopes = by_z[:, :, bounded] / limit[:, None]
                acts = slopes.any(axis=3)
                if is_shared:
                    slopes[..., self.width - 1] = -1.0 * acts
                N, share = len(slopes), self.sigma if is_shared else 1.0
                rows.append(slopes.reshape(N, -1, slopes.shape[3]))
                most.append(np.where(acts, share - now[:, :, bounded] / limit, 1.0).reshape(N, -1))
                self.rows.append((kind, np.tile(np.abs(limit), now.shape[1]), np.tile(bounded, now.shape[1])))
        return np.concatenate(rows, axis=1), np.concatenate(most, axis=1)

    def prices(self, found: Minimum) -> dict[str, Array]:
        """The decrease of the objective per unit of each limit, by kind of limit: as in `Tracked.prices`.

        `found`: the last program's minimum with its multipliers.
        """
        prices = {kind: np.zeros(range.shape[1]) for kind, range in self.asked.ranges.items()}
        parts = np.split(found.multipliers.sum(axis=0), np.cumsum([len(limit) for _, limit, _ in self.rows[:-1]]))
        for (kind, limit, owners), multipliers in zip(self.rows, parts, strict=True):
            own = self.sigma if self.asked.objective == f"least-{kind}" else 1.0
            np.add.at(prices[kind], owners, own * multipliers / limit)
        return prices

    def cost(self, found: Minimum) -> float:
        """The effort J at the minimum `found`: mean squares of torques and voltages in shares; no unit."""
        (H, g, constant), z = self.effort, self.program.z(found.x)
        return float((z * (0.5 * (H @ z[..., None])[..., 0] + g)).sum()) + constant
