"""Motors and patches together on a path, within limits: an optimal control problem on the internal dynamics.

With patches r(t, p, ṗ, p̈) = Φ_V V (`zero_dynamics`). p̈ is a polynomial on each interval through the four Gauss
points of `collocation`, V is linear between breaks: limits at breaks are limits everywhere. Each Newton step solves

    min  1/(t₁−t₀) ∫ ½ |τ − τ_qs|²/τ_ref² + ½ |V|²/V_ref² + ½ T_r² |V̇|²/V_ref² dt,
    V_min ≤ V ≤ V_max, |V̇| ≤ s_max, |C V̇ + Φ_Vᵀ ṗ| ≤ i_max, |τ| ≤ τ_max

or the least share of the limits of voltages, currents or torques, of the linearized equations; τ_qs carries the links
as they sag. Links rest at both ends. Output transition with free internal states: Perez and Devasia, Automatica 39
(2003).

A motor behind a compliant gear supplies τ + I τ̈_s/K, with what the gear transmits, τ_s: there V̈ is linear between
breaks, and T_r⁴|V̈|² takes the place of T_r²|V̇|².
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from math import comb

import numpy as np

from ...common.arrays import Array, Indices
from ...common.structs import struct
from ..inversion.collocation import GAUSS, Elimination, bernstein_integral, piecewise, stage_states
from ..inversion.zero_dynamics import shape_along
from .interior_point import GAP, Minimum, Program, minimize
from .transition import RATE, Tracked, Transition
from .voltages import Voltages

MOST_ITERATIONS = 30
TOLERANCE = 1e-8  # of the last Newton step, relative to the peak of its quantity
# second derivative by ξ of the cubic through values at the Gauss points, four by four
POWERS = np.arange(2, len(GAUSS.c))
CURVATURE = (GAUSS.c[:, None] ** (POWERS - 2) * POWERS * (POWERS - 1)) @ GAUSS.to_powers[2:]
# of a polynomial's integral by its values at the Gauss points, five coefficients by four
BERNSTEIN = bernstein_integral(GAUSS)
FIFTHS = np.linspace(0.0, 1.0, len(BERNSTEIN))
# Bernstein's coefficients of a polynomial by its values at `FIFTHS`
OF_FIFTHS = np.linalg.inv(np.array([[comb(4, k) * x**k * (1 - x) ** (4 - k) for k in range(5)] for x in FIFTHS]))
UNIQUE = 1e-7  # of the effort, which chooses among motions of the same least share
FEWEST_ITERATIONS = 6  # after which Newton's steps are taken to wander among these motions
WANDERING = (1e-2, 1e-3)  # of the effort, one after the other, where they do
SLOW = 0.5  # of the step before: what moves more is damped
DAMPING = 0.01  # of the square of changes, in the effort; four times as much with each such step
WHILE_SETTLING = 1e-4  # of the last change of a share by Newton's steps, relative, where intervals are to change
ROUGH_GAP = 1e-6  # of the objective, there


def track(
    asked: Transition, breaks: Array, near: Tracked | None = None, calm: float | None = None, within: float = TOLERANCE
) -> Tracked:
    """Solve on `breaks` (N + 1,), from a motion `near`, or from links as they sag and no voltages.

    Newton's method ends with a step `within` that share of the peaks.
    With `calm`, such a share of the effort joins a least share, which a few steps find within `WHILE_SETTLING`. That of
    voltages grows to one away from the ends: with equal weights, forces are left over between Gauss points (theory.md).
    """
    driven, h = asked.driven, np.diff(breaks)
    times = breaks[:-1, None] + h[:, None] * GAUSS.c
    N, s, n, m = *times.shape, *asked.Phi_V.shape
    flat = times.ravel()
    p_s = shape_along(driven, np.concatenate([breaks, flat]))
    p, v, u = p_s[: N + 1].copy(), np.zeros((N + 1, n)), np.zeros((N + 1, m * (asked.order + 1)))
    K, sag_at = np.zeros((N, s, n)), p_s[N + 1 :]
    tau_qs = driven.quasi_static(flat, sag_at).reshape(N, s, -1)
    size = max(float(np.abs(driven.scale * p_s).max()), 1e-300)
    if near is not None:
        p, v = near.curve(breaks), near.curve(breaks, 1)
        u = np.hstack([near.voltage(breaks, order) for order in (asked.order, *range(asked.order))])
        K = near.curve(flat, 2).reshape(K.shape)
    steps = _Steps(asked, breaks, tau_qs, size)
    steps.tolerance = within if calm is None else WHILE_SETTLING
    steps.gap = GAP if calm is None else ROUGH_GAP
    start = _Iterate(p, v, K, u, near.share if near is not None and steps.has_share else 1.0)
    if near is not None and near.objective == asked.objective and np.array_equal(near.voltage.x, breaks):
        start = replace(start, moved=near.step, found=near.found)
    if calm is not None:
        middle = 0.5 * (breaks[1:] + breaks[:-1])
        away = asked.rate * np.minimum(middle - breaks[0], breaks[-1] - middle)
        steps.unique, steps.of_voltages = calm, np.minimum(1.0, calm * np.exp(away)) / calm
        return _newton(steps, start, FEWEST_ITERATIONS).tracked(steps)
    last = _newton(steps, start, FEWEST_ITERATIONS if steps.has_share else MOST_ITERATIONS)
    if steps.has_share and not last.converged:
        start = replace(start, iterations=last.iterations)
        for steps.unique in WANDERING:
            iterate = _newton(steps, start, MOST_ITERATIONS)
            if not iterate.converged:
                break
            start = last = iterate
    return last.tracked(steps)


@struct
class _Iterate:
    """p, ṗ, V at breaks (N+1, …), p̈ at stages (N, 4, n) and σ, and the minimum they come from.

    Behind gears V are V̈, V and V̇ side by side.
    """

    p: Array
    v: Array
    K: Array
    V: Array
    share: float
    found: Minimum | None = None
    converged: bool = False
    iterations: int = 0
    moved: float = np.inf

    def tracked(self, steps: _Steps) -> Tracked:
        """As piecewise polynomials."""
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
        )


def _newton(steps: _Steps, start: _Iterate, most: int) -> _Iterate:
    """Newton's steps from `start`, no more than `most`, counted on from it."""
    scale, size = steps.asked.driven.scale, steps.size
    now, steps.sigma, previous, previous_share = replace(start, converged=False), start.share, start.moved, np.inf
    for iteration in range(start.iterations + 1, start.iterations + most + 1):
        old = now
        p, v, K, V, found = steps.take(old)
        moved = max(float(np.abs(scale * (p - old.p)).max()), float(np.abs(v - old.v).max())) / max(
            float(np.abs(scale * p).max()), float(np.abs(v).max()), size
        )
        now = _Iterate(p, v, K, V, steps.sigma, found, iterations=iteration, moved=moved)
        if not (np.isfinite(moved) and found.converged):
            break
        if steps.has_share:  # V(t) of linear programs is not unique
            moved = abs(now.share - previous_share) / abs(now.share)
            previous_share = now.share
        shrinks = moved**2 <= steps.tolerance * previous < np.inf  # so does the next step, which is not taken
        if moved <= steps.tolerance or (shrinks and not steps.has_share) or (moved <= 1e-7 and moved > 0.3 * previous):
            return replace(now, converged=True)
        if not steps.has_share and moved > SLOW * previous:
            steps.damping = max(DAMPING, 4 * steps.damping)
        previous = moved
    return now


class _Steps:
    """Newton's steps, each the minimum of the linearized problem in x = (V, p, ṗ, σ) at breaks.

    What happens between two breaks depends on z_k = (x_k, V_{k+1}). Behind gears x = (V̈, p, ṗ, V, V̇, σ), and V̈ takes
    the place of V there.

    σ, the share of limits, is a constant, and there where it is the objective. A little of the effort then picks one of
    many V(t); where Newton's steps would wander among them, enough of it for steps that shrink, and then less.
    Steps of the effort leave out how constraints curve; where that matters they need not shrink, and are damped.
    """

    program: Program
    tolerance, gap = TOLERANCE, GAP
    effort: tuple[Array, Array, float]  # H, g, and the constant that the program leaves out
    unique, damping = UNIQUE, 0.0
    of_voltages: float | Array = 1.0  # (N,) times the share of the effort
    rows: dict[str, tuple[slice, Array, Indices]]  # of inequalities, their limits (i,), and whose they are (i,)

    def __init__(self, asked: Transition, breaks: Array, tau_qs: Array, size: float) -> None:
        self.asked, self.breaks, self.h, self.tau_qs, self.size = asked, breaks, np.diff(breaks), tau_qs, size
        self.n, self.m = asked.Phi_V.shape
        self.has_share = asked.objective != "effort"
        self.V, self.y = slice(0, self.m), slice(self.m, self.m + 2 * self.n)
        self.voltages = Voltages(breaks, asked.order)
        self.states = slice(self.m, self.y.stop + asked.order * self.m)
        self.width = self.states.stop + self.has_share
        # where in z what V follows from begins
        self.starts = np.append([0, self.width], self.y.stop + self.m * np.arange(asked.order))
        pace = asked.weights.rate or RATE
        volts = np.full(self.m, asked.weights.voltage)
        y_unit = np.concatenate([size / asked.driven.scale, np.full(self.n, size)])
        self.state_unit = np.concatenate([y_unit, *(volts / pace**k for k in range(asked.order))])
        control = volts / pace**asked.order
        self.unit = np.concatenate([control, self.state_unit, np.ones(int(self.has_share))])
        self.unit_z = np.concatenate([self.unit, control])
        self.sigma = 1.0

    def _volts_by_z(self, xi: Array, order: int = 0) -> Array:
        """A derivative of V at shares ξ (S,) of intervals by z (N, S, m, width + m)."""
        parts = self.voltages.parts(xi, order)
        by_z, each = np.zeros((*parts.shape[:2], self.m, len(self.unit_z))), np.arange(self.m)
        for k, start in enumerate(self.starts):
            by_z[:, :, each, start + each] = parts[:, :, k, None]
        return by_z

    def take(self, now: _Iterate) -> tuple[Array, Array, Array, Array, Minimum]:
        """The next p, ṗ at breaks, K at stages and V at breaks, and the minimum they come from."""
        p, v, K, u, n, h = now.p, now.v, now.K, now.V, self.n, self.h
        N, s, _ = K.shape
        times = (self.breaks[:-1, None] + h[:, None] * GAUSS.c).ravel()
        at = [*(x.reshape(-1, n) for x in stage_states(GAUSS, h, p, v, K)), K.reshape(-1, n)]
        r, tau = self.asked.driven.forces(times, *at)
        slopes = [x.reshape(N, s, -1, n) for x in self.asked.driven.slopes(times, *at)]
        stages = Elimination(GAUSS, h, [x[:, :, :n] for x in slopes])
        sigma = np.full((N + 1, int(self.has_share)), self.sigma)
        x = np.concatenate([u[:, self.V], p, v, u[:, self.m :], sigma], axis=1)
        z, V_z = np.hstack([x[:-1], x[1:, self.V]]), self._volts_by_z(GAUSS.c)
        left = r.reshape(N, s, n) - np.einsum("Nsmz,Nz->Nsm", V_z, z, optimize=True) @ self.asked.Phi_V.T
        moved = -(stages.E_inverse @ left.reshape(N, s * n, 1)).reshape(N, s, n)  # of K, with all at breaks as it is
        K_z = (stages.E_inverse @ (self.asked.Phi_V @ V_z).reshape(N, s * n, -1)).reshape(N, s, n, -1)
        K_z[..., self.y] += stages.response
        starts = np.zeros((2, n, len(self.unit_z)))
        starts[:, :, self.y] = np.eye(2 * n).reshape(2, n, 2 * n)
        ends = [*stages.at_end(starts[0], starts[1], K_z)]
        reached = [*stages.at_end(p[:-1], v[:-1], K + moved)]
        for order in range(self.voltages.order):
            ends.append(self._volts_by_z(np.ones(1), order)[:, 0])
            reached.append(np.einsum("Nmz,Nz->Nm", ends[-1], z))
        offset = np.concatenate(reached, axis=1) - x[1:, self.states]
        of_torques = self._torques(tau.reshape(N, s, -1), [of[:, :, n:] for of in slopes], moved, (starts, K_z))
        tau_0, tau_z = (self._at_motors(of) for of in of_torques)
        charges = self._charges(v, K + moved, (starts[1], K_z))
        self.program = self._program(np.concatenate(ends, axis=1), offset, tau_0, tau_z, x, charges)
        least = minimize(self.program, self.gap, now.found)
        change = least.x * self.unit
        K_new = K + moved + np.einsum("Nsnz,Nz->Nsn", K_z, self.program.z(change), optimize=True)
        x = x + change
        self.sigma = float(x[0, -1]) if self.has_share else 1.0
        u = np.hstack([x[:, self.V], x[:, self.y.stop : self.states.stop]])
        return *np.split(x[:, self.y], 2, axis=1), K_new, u, least

    def _at_motors(self, values: Array) -> Array:
        """Torques of motors (N, s, motors, …) at stages, or slopes, by those with rigid gears and transmitted ones."""
        if (gears := self.asked.gears) is None:
            return values
        motors = values.shape[2] - len(gears.joints)
        h = self.h.reshape(-1, *(1 for _ in values.shape[1:]))
        second = np.einsum("ij,Nj...->Ni...", CURVATURE, values[:, :, motors:]) / h**2
        of_motors = values[:, :, :motors].copy()
        of_motors[:, :, gears.columns] += (second.swapaxes(2, -1) * (gears.inertia / gears.stiffness)).swapaxes(2, -1)
        return of_motors

    def _torques(self, tau: Array, slopes: list[Array], moved: Array, by_z: tuple[Array, Array]) -> tuple[Array, Array]:
        """τ (N, s, motors) at stages once K has `moved`, and its derivatives (N, s, motors, width + m) by z."""
        starts, K_z = by_z
        h = self.h[:, None, None, None]
        once, twice = (np.einsum("ij,Nj...->Ni...", a, K_z) for a in (GAUSS.stage_once, GAUSS.stage_twice))
        p_z = starts[0] + GAUSS.c[:, None, None] * h * starts[1] + h**2 * twice
        v_z = starts[1] + h * once
        h = h[..., 0]
        once, twice = (np.einsum("ij,Nj...->Ni...", a, moved) for a in (GAUSS.stage_once, GAUSS.stage_twice))
        found = np.zeros((*tau.shape, len(self.unit_z)))
        for by, of_z, of_moved in zip(slopes[::-1], (p_z, v_z, K_z), (h**2 * twice, h * once, moved), strict=True):
            found = found + by @ of_z
            tau = tau + np.einsum("Nstn,Nsn->Nst", by, of_moved)
        return tau, found

    def _charges(self, v: Array, K: Array, by_z: tuple[Array, Array]) -> tuple[Array, Array]:
        """Φ_Vᵀ ṗ (N, 5, m), A, by Bernstein's coefficients, which bound it between breaks, and its derivatives by z."""
        if not np.isfinite(self.asked.limits.patches.current).any() and self.asked.objective != "least-current":
            return np.zeros((len(self.h), 0, self.m)), np.zeros((len(self.h), 0, self.m, self.width + self.m))
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
        G[..., self.V], G[..., self.states] = -ends[..., width:], np.eye(states)
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
        rows = np.eye(width)[self.states if self.asked.is_free else slice(self.states.stop)]
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
        of_voltages = np.zeros_like(H)
        each, starts = np.arange(self.m), self.starts
        for order in (0, max(1, self.voltages.order)):
            parts = self.voltages.parts(GAUSS.c, order) * self.unit_z[starts] * weights.rate**order / weights.voltage
            share = (self.of_voltages * self.h)[:, None] * GAUSS.end_once / whole
            squares = np.einsum("Ns,Nsa,Nsb->abN", share, parts, parts)
            for (i, first), (j, second) in product(enumerate(starts), repeat=2):
                of_voltages[:, first + each, second + each] += squares[i, j][:, None]
        z = np.hstack([now[:-1], now[1:, self.V]])[..., None]
        pull = (of_voltages @ z)[..., 0]
        constant = 0.5 * float(np.einsum("Ns,Nst->", b, off**2) + (pull * z[..., 0]).sum())
        each = np.arange(self.y.stop)
        H[:, each, each] += self.damping * self.h[:, None] / whole
        self.effort = H + of_voltages, g + pull, constant
        return self.effort[:2]

    def _of_patches(self, x: Array, charges: tuple[Array, Array]) -> dict[str, tuple[Array, Array]]:
        """What patches may have limits of: values (N, rows, m) and derivatives by z; "end" are voltages at the end."""
        z, C = np.hstack([x[:-1], x[1:, self.V]]), self.asked.limits.patches.capacitance

        def values(by_z: Array, of: Array | float = 0.0, slopes: Array | float = 0.0) -> tuple[Array, Array]:
            return of + np.einsum("Nsmz,Nz->Nsm", by_z, z, optimize=True), (slopes + by_z) * self.unit_z

        within = self.voltages.within
        limited = {"voltage": values(self._volts_by_z(within))}
        if self.asked.is_free and self.voltages.order == 0:  # else V ends at zero
            by_end = self._volts_by_z(np.ones(1))
            by_end[:-1] = 0.0
            limited["end"] = values(by_end)
        if charges[0].shape[1] or self.asked.limits.patches.has_rates:
            limited["slew"] = values(self._volts_by_z(within, 1))
            rates = np.einsum("ij,Njmz->Nimz", OF_FIFTHS, self._volts_by_z(FIFTHS, 1))
            limited["current"] = values(C[:, None] * rates, *charges)
        return limited

    def _inequalities(self, values: Mapping[str, tuple[Array, Array]]) -> tuple[Array, Array]:
        """C and d: limits of voltages at breaks, of their rates and of currents between, and of torques at stages.

        `values` (N, rows, …) with their derivatives by z.
        """
        limits, ranges, rows, most = self.asked.limits, self.asked.ranges, [], []
        of_patches = limits.patches
        known = {"voltage": of_patches.range, "slew": of_patches.slew, "current": of_patches.current}
        self.rows, count = {}, 0
        for name, (now, by_z) in values.items():
            kind = "voltage" if name == "end" else name
            is_shared = self.asked.objective == f"least-{kind}"
            finite = np.isfinite(np.atleast_2d(known.get(kind, limits.torque))).any(axis=0)
            bounded = np.arange(now.shape[2]) if is_shared else np.flatnonzero(finite)
            for limit in ranges[kind][:, bounded]:
                of = by_z[:, :, bounded] / limit[:, None]
                acts = of.any(axis=3)
                share = self.sigma if is_shared else 1.0
                if is_shared:
                    of[..., self.width - 1] = -1.0 * acts
                rows.append(of.reshape(len(of), -1, of.shape[3]))
                most.append(np.where(acts, share - now[:, :, bounded] / limit, 1.0).reshape(len(of), -1))
                repeated = np.tile(bounded, now.shape[1])
                part = slice(count, count + len(repeated))
                self.rows[f"{name} {len(self.rows)}"] = part, np.tile(np.abs(limit), now.shape[1]), repeated
                count = part.stop
        return np.concatenate(rows, axis=1), np.concatenate(most, axis=1)

    def prices(self, found: Minimum) -> dict[str, Array]:
        """Those of `Tracked`, by the multipliers of the last program, whose rows are shares of limits."""
        prices = {name: np.zeros(range.shape[1]) for name, range in self.asked.ranges.items()}
        for name, (part, limit, owners) in self.rows.items():
            kind = name.split()[0].replace("end", "voltage")
            own = self.sigma if self.asked.objective == f"least-{kind}" else 1.0
            np.add.at(prices[kind], owners, own * found.multipliers[:, part].sum(axis=0) / limit)
        return prices

    def cost(self, found: Minimum) -> float:
        """J, with what `of_voltages` adds."""
        (H, g, constant), z = self.effort, self.program.z(found.x)
        return float((z * (0.5 * (H @ z[..., None])[..., 0] + g)).sum()) + constant
