"""What a tracking problem requires at least, and what would do where limits are too small."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...common.arrays import Array, ComplexArray, as_floats
from ...common.errors import InputError, SolveError
from ...common.structs import struct
from .._core import TimeFunction
from ..inversion.motors_only import decay_times
from ..inversion.servo import Servo
from ..inversion.stable_inversion import invert
from ..inversion.zero_dynamics import LIGHT, Linearisation, equilibrium, first_order, linear_dynamics, linearise
from ..model.nodes import rotor
from ..run.context import Context
from .geared import without_rotor
from .intervals import OUT_OF_REACH, settled, start_breaks
from .path_error import Tolerance, forces_off_path, rows_of_points
from .transition import Tracked, Transition

NEAR = 0.97  # times the limits of patches, which more time is sought for
MOST_TRIES = 6
ROUGHLY = 0.1  # change of the least share by finer intervals, which only lower it: what is advised does
NEAR_END = 1e-3  # of the path's time, of its start and of its end, for derivatives there
FAR = 0.1  # of the time constant of the slowest zero: t_ℓ of patches whose voltages need not converge with modes
INVERTED = 1e-6  # tolerance of stable inversion
SEEN = 1e-3  # of the limits: by less than that a tolerance saves, and gaps of quadratic programs hide its price


@struct
class Bounds:
    """Voltages (k,) V that zeros (k,) 1/s need at least, the largest first, at the `times` (k,) s when they count.

    `relief` (k,) V/m: by how much less for a larger path tolerance; zero where no point has a path.
    """

    zeros: ComplexArray
    times: Array
    voltages: Array
    relief: Array


def bounds_of_zeros(
    servo: Servo, asked: Transition, linear: Linearisation, around: tuple[float, float], unit: Array
) -> Bounds:
    """Least voltages that each zero needs, V, by the motion of motors alone; patches take shares of `unit` (m,), V.

    Rest at the start requires ∫ e^{−st} ℓᵀB V dt = −ζ of each zero in the right half plane, with its left eigenvector ℓ
    and ζ = ℓᵀ(y − y_rest) of stable inversion there: |V| ≥ |ζ| Re s / Σ|ℓᵀB|; likewise the others at the end.
    A path error e takes off up to |ℓᵀM⁻¹(∂r/∂e + s ∂r/∂ė + s² ∂r/∂ë)| e_max. Vibrations (`LIGHT`) are left out.
    Raises `SolveError` where motors alone have no bounded motion.
    """
    end = float(linear.times[-1])
    pre, post = decay_times(linear, end, needs_future=True)
    pre, post = max(pre, around[0]), max(post, around[1])
    inverted = invert(servo, linear, pre, post, INVERTED, lambda _: True)
    if inverted.status != "completed":
        raise SolveError(f"{servo.where}: torques without voltages have no bounded motion: {inverted.status}")
    zeros, times, shares, reliefs = [], [], [], []
    for t, rest, sign in ((-around[0], asked.rest[0], 1.0), (end + around[1], asked.rest[1], -1.0)):
        still = np.zeros((1, len(rest)))
        dynamics = linear_dynamics(servo, np.array([t]), rest[None], still, still)
        s, left = np.linalg.eig(first_order(dynamics, 0, servo.scale).T)
        y = np.concatenate([servo.scale * (inverted.curve(t) - rest), inverted.curve(t, 1)])
        B = np.linalg.solve(dynamics.M[0], asked.Phi_V) * unit
        off = np.zeros((3, 1, len(rows_of_points(servo))))
        slopes = forces_off_path(servo, np.array([t]), (rest[None], still, still), off)[1]
        by_error = np.linalg.solve(dynamics.M[0], slopes[:, 0, : len(rest)])
        counts = (sign * s.real > LIGHT * np.abs(s)) & (s.imag >= 0)
        for k in np.flatnonzero(counts):
            reach = float(np.abs(left[len(rest) :, k] @ B).sum())
            zeros.append(s[k])
            times.append(t)
            relieved = np.abs(left[len(rest) :, k] @ np.tensordot(s[k] ** np.arange(3), by_error, 1)).sum()
            required = max(0.0, float(abs(left[:, k] @ y) * abs(s[k].real) - asked.allowed * relieved))
            shares.append(required / reach if reach else np.inf)
            reliefs.append(relieved / reach if reach else 0.0)
    voltages, relief = np.array(shares) * float(unit.max()), np.array(reliefs) * float(unit.max())
    order = np.argsort(-voltages)
    return Bounds(np.array(zeros, dtype=complex)[order], np.array(times)[order], voltages[order], relief[order])


def enough_time(servo: Servo, asked: Transition, intervals: int, around: tuple[float, float], share: float) -> float:
    """Return the pre- and post-actuation (s) that voltages within limits need; NaN if not found.

    The least voltage falls about as e^{−s t}, s the slowest zero to the right (Zou and Devasia, 1999).
    """
    end, zeros = servo.end, linearise(servo, servo.end).zeros.real
    rate = float(zeros[zeros > 1.0 / end].min(initial=np.inf))

    def share_with(more: float) -> float:
        start, last = -around[0] - more, end + around[1] + more
        return _share(servo, asked, start_breaks(start, end, last, intervals // 2))

    return _enough(share_with, share, rate)


def enough_path_time(
    servo: Servo, asked: Transition, intervals: int, around: tuple[float, float], share: float
) -> float:
    """The path's time (s) for voltages within their limits, of the same path slowed down; NaN where not found.

    The least voltage falls about as T^−m, m the order with which the path starts.
    """

    def share_with(more: float) -> float:
        slower = servo.slowed(float(np.exp(more)))
        end = slower.end + around[1]
        rest = equilibrium(slower, -around[0] - NEAR_END), equilibrium(slower, end + NEAR_END)
        breaks = start_breaks(-around[0], slower.end, end, intervals // 2)
        return _share(servo, replace(asked, driven=slower, rest=rest), breaks)

    return float(servo.end * np.exp(_enough(share_with, share, _lower_order(servo))))


def enough_tolerance(
    servo: Servo, asked: Transition, intervals: int, around: tuple[float, float], share: float, relief: float
) -> float:
    """The path tolerance (m) that voltages within limits need; NaN if not found.

    The least voltage falls about linearly with it, by less than `relief` (shares per m).
    """
    if asked.gears is not None or not relief:
        return np.nan
    breaks = start_breaks(-around[0], servo.end, servo.end + around[1], intervals // 2)
    given = asked.tolerance or Tolerance(0.0)

    def share_with(more: float) -> float:
        wider = replace(given, error=given.error + more)
        return float(np.exp(_share(servo, replace(asked, tolerance=wider), breaks) - 1.0))  # its logarithm is linear

    return given.error + _enough(share_with, float(np.exp(share - 1.0)), relief)


def check_within_reach(asked: Transition, linear: Linearisation, bounds: Bounds | None, share: float) -> None:
    """Raise `SolveError` where a lower bound of the least voltage exceeds the limits by the factor `share`.

    What would do follows from how the bound of the zero falls: as e^{−s t}, as T^−m, linearly with a path tolerance.
    """
    if share <= OUT_OF_REACH:
        return
    servo = asked.driven
    zeros, limit = linear.zeros[[0, -1]], asked.units.max()
    rate, found = slowest(zeros), f"at least {share:.3g} times the limits"
    if bounds is not None and len(bounds.voltages):
        rate = abs(float(bounds.zeros[0].real))
        found += f"; the zero at {bounds.zeros[0].real:.4g} 1/s alone requires {bounds.voltages[0]:.4g} V"
    would = [f"{1e3 * np.log(share) / rate:.3g} ms more of pre_actuation and post_actuation"] if rate else []
    if bounds is not None and bounds.relief.any() and asked.gears is None:
        of_zeros = bounds.relief > 0.0
        error = float(((bounds.voltages - limit) / bounds.relief)[of_zeros].max()) + asked.allowed
        would.append(f"a path_tolerance of more than {1e3 * error:.3g} mm")
    would += [
        f"the same path in {servo.end * share ** (1 / _lower_order(servo)):.3g} s instead of {servo.end:g} s",
        f"patches that bend the links {share:.3g} times as much per volt",
    ]
    raise SolveError(
        f"{servo.where}: patches cannot carry the robot: they would need {found}. Any of these comes near:"
        f" {'; '.join(would)}"
    )


def price_of_tolerance(asked: Transition, least: Tracked) -> float | None:
    """V/m, by how much less the least voltage is for a larger path tolerance; None without one, or one too small."""
    if asked.tolerance is None:
        return None
    prices = float(least.prices["error"].sum() + least.prices["curving"].sum() / asked.tolerance.time**2)
    return None if least.share and prices * asked.allowed < SEEN else prices * float(asked.units.max())


def slowest(zeros: ComplexArray) -> float:
    """1/s, of the slowest of the zeros; 0 without any but vibrations."""
    sizes = np.abs(zeros.real)[np.abs(zeros.real) > LIGHT * np.abs(zeros)]
    return float(sizes.min()) if sizes.size else 0.0


def _share(servo: Servo, asked: Transition, breaks: Array) -> float:
    least = settled(asked, breaks, servo.goes_on, ROUGHLY)
    return least.share if least.converged and servo.goes_on() else np.nan


def _enough(share_with: Callable[[float], float], share: float, rate: float) -> float:
    """The least x ≥ 0 with share_with(x) just below one, by secants of its logarithm; about `share` e^{−rate x}."""
    more, low, high, tried = 0.0, 0.0, np.inf, [(0.0, np.log(share))]
    for _ in range(MOST_TRIES):
        more += (tried[-1][1] - np.log(NEAR)) / rate
        if not low < more < high:
            more = (low + min(high, 4 * low)) / 2
        found = share_with(more)
        if not np.isfinite(found):
            break
        if NEAR**2 <= found <= 1.0:
            return float(more)
        low, high = (more, high) if found > 1.0 else (low, more)
        tried.append((more, np.log(found)))
        (x_0, log_0), (x_1, log_1) = tried[-2:]
        rate = max((log_0 - log_1) / (x_1 - x_0), 0.1 * rate)
    return np.nan


def path_orders(targets: Sequence[TimeFunction], end: float) -> tuple[float, float]:
    """Power of time with which a path leaves its start and reaches its `end` (s): 2 where its acceleration jumps."""
    orders = []
    for t, ahead in ((0.0, 1.0), (end, -1.0)):
        near = as_floats(t + ahead * NEAR_END * end * np.array([1.0, 2.0]))
        size = np.sqrt(sum(target.sample(near)[2] ** 2 for target in targets))
        orders.append(2.0 + np.log2(size[1] / size[0]) if size[0] > 0 else np.inf)
    return float(orders[0]), float(orders[1])


def _lower_order(servo: Servo) -> float:
    """The power of time with which a path leaves its start or reaches its end, the lower one that is known; else 4."""
    return min((order for order in path_orders(servo.functions, servo.end) if order > 1), default=4.0)


def rough_ends(targets: Sequence[TimeFunction], end: float) -> Iterator[str]:
    """A warning for a path whose acceleration or jerk jumps where it begins or ends."""
    names = {2: "acceleration", 3: "jerk"}
    rough = [(where, round(order)) for where, order in zip(("begins", "ends"), path_orders(targets, end), strict=True)
             if np.isfinite(order) and round(order) in names]  # fmt: skip
    for order in sorted({order for _, order in rough}):
        where = " and ".join(f"where it {name}" for name, of in rough if of == order)
        cost = "no voltage without jumps makes up for that" if order == 2 else "that takes several times the voltage"
        yield (f"the path's {names[order]} jumps {where}: {cost}. Smoother ends: 35*s**4 - 84*s**5 + 70*s**6 - 20*s**7")


def check_ends_for_gears(servo: Servo) -> float:
    """The power of time with which the path begins and ends, the lower of both.

    Raises `InputError` where it is not smooth enough for motors behind compliant gears: at rest a gear has no rate, nor
    has τ_s, of which ÿ is a part.
    """
    for text in rough_ends(servo.functions, servo.end):
        raise InputError(
            f"{servo.where}: trajectory: expected jerk and acceleration without jumps for compliant gears, whose"
            " motors would need impulses",
            f"that {text}",
        )
    return min(path_orders(servo.functions, servo.end))


def singular_times(servo: Servo, linear: Linearisation) -> Iterator[str]:
    """Yield where the modal inertia with free motors changes its sign, and the remedy.

    That is a rotor without which its sign stays, or else less mass; other modes may help.
    """
    for k in linear.singular_after[:1]:
        names = [node.joint.name for node in servo.model.tree.nodes if rotor(node)[0]]
        without = {name: replace(servo, model=without_rotor(servo.model, name)) for name in names}
        rotors = [name for name, other in without.items() if not linearise(other, servo.end).singular_after]
        remedy = f"Reduce rotor_inertia of {' or '.join(rotors)}" if rotors else "Put less mass on links, say a third"
        yield (
            f"between t = {linear.times[k]:.4g} and {linear.times[k + 1]:.4g} s a zero of the modes passes through"
            f" infinity, where the search need not converge. {remedy}, or try another number of modes in link files"
        )


def far_patches(context: Context, zeros: ComplexArray) -> Iterator[str]:
    """A warning for each point of a path that is far from the last patch: voltages need not converge with modes.

    In the continuum the path must start flatter than exp(−t_ℓ/t), t_ℓ = ℓ² √(ρA/EI)/8 (`docs/theory.md`).
    """
    rate = float(zeros.real[zeros.real > LIGHT * np.abs(zeros)].min(initial=np.inf))
    model = context.model if context.whole is None else context.whole.model
    for name in dict.fromkeys(path.point for path in model.scene.trajectory if path.point is not None):
        body, _, point = name.partition(".")
        of_link = context.patches.get(body)
        if of_link is None or not np.isfinite(rate):
            continue
        at = float(model.tree.nodes[model.tree.index[body]].body.points[point].position[0])
        length = float(np.maximum(at - of_link.edges[:, 1], 0.0).min())
        t_l = length**2 * of_link.slowness / 8
        if t_l * rate > FAR:
            yield (
                f"the last patch ends {length:.3g} m before {name}: voltages need not converge with the number of"
                f" modes (ℓ²√(ρA/EI)/8 = {1e3 * t_l:.3g} ms, more than {FAR:g} of 1/s = {1e3 / rate:.3g} ms of the"
                " slowest zero). Put patches nearer to the point"
            )
