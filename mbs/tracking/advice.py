"""A tracking problem as posed for a scene: whether patches can do it, why not, what would do instead, and warnings."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from ...common.arrays import Array, ComplexArray
from ...common.errors import InputError, SolveError
from ...common.structs import struct
from .._core import TimeFunction
from ..inversion.motors_only import decay_times
from ..inversion.servo import Servo
from ..inversion.stable_inversion import invert
from ..inversion.zero_dynamics import LIGHT, Linearisation, equilibrium, first_order, linear_dynamics, linearise
from ..model.nodes import rotor
from ..run.context import Context
from .geared import motor_names, without_rotor
from .problem import OUT_OF_REACH, SETTLED, settled, start_breaks, track
from .transition import Limits, Tolerance, Tracked, Transition, forces_off_path, rows_of_points

NEAR = 0.97  # times the limits of patches, which more time is sought for
MOST_TRIES = 6
ROUGHLY = 0.1  # change of the least share by finer intervals, which only lower it: what is advised does
NEAR_END = 1e-3  # of the path's time, of its start and of its end, for derivatives there
FAR = 0.1  # of the time constant of the slowest zero: t_ℓ of patches whose voltages need not converge with modes
INVERTED = 1e-6  # tolerance of stable inversion
SEEN = 1e-3  # of the limits: by less than that a tolerance saves, and gaps of quadratic programs hide its price
ENOUGH = 1e-6  # of the limits: least voltages beyond them by less are within
WEAK = 1.05  # times the limits of motors: least torques on few intervals that finer ones do not bring within them
AMPLE = 1e3  # times the largest torque along the path: as good as no limit
NONE = 1e-4  # of the limits: voltages that motors alone do without


@struct
class Bounds:
    """Least voltages (k,) V that the zeros (k,) 1/s require, the largest first.

    `times` (k,) s: the start or end of the actuation, where each counts. `relief` (k,) V/m: decrease per path
    tolerance; zero where no point has a path.
    """

    zeros: ComplexArray
    times: Array
    voltages: Array
    relief: Array


@struct
class Posed:
    """The tracking problem `asked`, zero dynamics, `breaks` (N + 1,), s, and `coarse` ones for the least voltage.

    `around`: pre- and post-actuation, s.
    """

    asked: Transition
    linear: Linearisation
    around: tuple[float, float]
    breaks: Array
    coarse: Array

    @cached_property
    def bounds(self) -> Bounds | None:
        """Voltages, V, that each zero of the robot requires; None where motors alone have no bounded motion."""
        try:
            return bounds_of_zeros(self.asked, self.linear, self.around)
        except SolveError:
            return None


def bounds_of_zeros(asked: Transition, linear: Linearisation, around: tuple[float, float]) -> Bounds:
    """Least voltages that each zero needs, V, if all patches have equal shares of their limits.

    `around`: pre- and post-actuation, s. By docs/theory.md, (44): zeros in the right half plane count for rest at the
    start, others at the end, vibrations never. Raises `SolveError` where motors alone have no bounded motion.
    """
    servo, end, unit = asked.driven, float(linear.times[-1]), asked.units
    pre, post = map(max, decay_times(linear, needs_future=True), around)
    inverted = invert(servo, linear, pre, post, INVERTED, lambda _: True)
    if inverted.status != "completed":
        raise SolveError(f"torques without voltages have no bounded motion: {inverted.status}")
    found = list[tuple[complex, float, float, float]]()
    for t, rest, sign in ((-around[0], asked.rest[0], 1.0), (end + around[1], asked.rest[1], -1.0)):
        n, still = len(rest), np.zeros((1, len(rest)))
        dynamics = linear_dynamics(servo, np.array([t]), rest[None], still, still)
        s, left = np.linalg.eig(first_order(dynamics, servo.scale)[0].T)
        y = np.concatenate([servo.scale * (inverted.curve(t) - rest), inverted.curve(t, 1)])
        B = np.linalg.solve(dynamics.M[0], asked.Phi_V) * unit
        off = np.zeros((3, 1, len(rows_of_points(servo))))
        slopes = forces_off_path(servo, np.array([t]), (rest[None], still, still), off)[1]
        by_error = np.linalg.solve(dynamics.M[0], slopes[:, 0, :n])
        for k in np.flatnonzero((sign * s.real > LIGHT * np.abs(s)) & (s.imag >= 0)):
            reach = float(np.abs(left[n:, k] @ B).sum())
            relieved = np.abs(left[n:, k] @ np.tensordot(s[k] ** np.arange(3), by_error, 1)).sum()
            required = max(0.0, float(abs(left[:, k] @ y) * abs(s[k].real) - asked.allowed * relieved))
            found.append((s[k], t, *((required / reach, relieved / reach) if reach else (np.inf, 0.0))))
    found.sort(key=lambda one: -one[2])
    zeros, times, shares, reliefs = np.array(found, dtype=complex).reshape(-1, 4).T
    return Bounds(zeros, times.real, shares.real * float(unit.max()), reliefs.real * float(unit.max()))


def _remedies(posed: Posed, intervals: int, share: float) -> Iterator[str]:
    """What would bring a least voltage of `share` times the limits within them, each by a few solutions.

    It falls as after (44) in docs/theory.md, s the slowest zero to the right, m the order of the path's start.
    """
    asked, (pre, post), zeros = posed.asked, posed.around, posed.linear.zeros.real
    servo, end, given = asked.driven, asked.driven.end, asked.tolerance or Tolerance(0.0)

    def share_of(asked: Transition, more: float = 0.0) -> float:
        end = asked.driven.end
        least = settled(asked, start_breaks(-pre - more, end, end + post + more, intervals // 2), ROUGHLY)
        return least.share if least.converged and servo.goes_on() else np.nan

    def slowed(more: float) -> float:
        slower = servo.slowed(float(np.exp(more)))
        rest = equilibrium(slower, -pre - NEAR_END), equilibrium(slower, slower.end + post + NEAR_END)
        return share_of(replace(asked, driven=slower, rest=rest))

    def widened(more: float) -> float:
        wider = replace(given, error=given.error + more)
        return float(np.exp(share_of(replace(asked, tolerance=wider)) - 1.0))  # its logarithm is linear

    rate = float(zeros[zeros > 1.0 / end].min(initial=np.inf))
    if np.isfinite(more := _enough(lambda more: share_of(asked, more), share, rate)):
        yield f"{1e3 * more:.3g} ms more of pre_actuation and post_actuation"
    if np.isfinite(longer := float(end * np.exp(_enough(slowed, share, _lower_order(servo))))):
        yield f"the same path in {longer:.3g} s"
    relief = 0.0 if posed.bounds is None else float(posed.bounds.relief.max(initial=0.0)) / asked.units.max()
    if asked.gears is None and relief:
        wider = given.error + _enough(widened, float(np.exp(share - 1.0)), relief)
        if np.isfinite(wider):
            yield f"{1e3 * wider:.3g} mm of path_tolerance"


def _enough(share_with: Callable[[float], float], share: float, rate: float) -> float:
    """The least x ≥ 0 with share_with(x) just below one, by secants of its logarithm; about `share` e^{−rate x}."""
    more, low, high, tried = 0.0, 0.0, np.inf, [(0.0, np.log(share))]
    for _ in range(MOST_TRIES):
        more += (tried[-1][1] - np.log(NEAR)) / rate
        if not low < more < high:
            more = (low + min(high, 4 * low or high)) / 2
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


def check_reach(posed: Posed, least: Tracked | None) -> None:
    """Raise `SolveError`, with remedies, where patches surely need `OUT_OF_REACH` times their limits.

    By the voltages that zeros of the robot require, and that of `least`, the motion of least voltage.
    """
    asked, bounds, limit = posed.asked, posed.bounds, posed.asked.units.max()
    share = 0.0 if least is None else least.surely
    if bounds is not None:
        share = float((bounds.voltages / limit).max(initial=share))
    if not asked.is_limited or share <= OUT_OF_REACH:
        return
    servo, rate = asked.driven, slowest(posed.linear)
    needed = f"at least {share:.3g} times the limits"
    if bounds is not None and len(bounds.voltages):
        rate = abs(float(bounds.zeros[0].real))
        needed += f"; the zero at {bounds.zeros[0].real:.4g} 1/s alone requires {bounds.voltages[0]:.4g} V"
    would = [f"{1e3 * np.log(share) / rate:.3g} ms more of pre_actuation and post_actuation"] if rate else []
    if bounds is not None and bounds.relief.any() and asked.gears is None:
        error = float(((bounds.voltages - limit) / bounds.relief)[bounds.relief > 0.0].max())
        if error > 0.0:
            would.append(f"a path_tolerance of more than {1e3 * (error + asked.allowed):.3g} mm")
    would += [
        f"the same path in {servo.end * share ** (1 / _lower_order(servo)):.3g} s instead of {servo.end:g} s",
        f"patches that bend the links {share:.3g} times as much per volt",
    ]
    raise SolveError(
        f"patches cannot carry the robot: they would need {needed}. Any of these comes near: {'; '.join(would)}"
    )


def check_motors(posed: Posed) -> None:
    """Raise `SolveError` where motors exceed their limits even where patches have `OUT_OF_REACH` times their limits.

    The least torque is sought only where torques along the path exceed the limits without patches.
    """
    limits, linear, servo = posed.asked.limits, posed.linear, posed.asked.driven
    peaks = np.abs(servo.quasi_static(linear.times, linear.shape)).max(axis=0)
    if (peaks <= limits.torque).all():
        return
    far = OUT_OF_REACH * limits.patches.range
    torque = np.where(np.isfinite(limits.torque), limits.torque, AMPLE * peaks.max())
    asked = replace(posed.asked, objective="least-torque", limits=Limits(replace(limits.patches, range=far), torque))
    least = track(asked, posed.coarse)
    if least.converged and least.share > WEAK:
        needed = [
            f"of {name} from {torque[k]:g} to more than {least.share * torque[k]:.3g}"
            for k, name in enumerate(motor_names(servo.model))
            if least.prices["torque"][k] > 0.0
        ]
        raise SolveError(
            "no motion follows the path within the motors' limits, not even with"
            f" {OUT_OF_REACH:g} times the voltages: raise moment_limit {' and '.join(needed)}, or slow the path down if"
            " torques at rest are within limits"
        )


def check_found(context: Context, posed: Posed, least: Tracked) -> None:
    """Raise `SolveError` if `least`, of least voltage, was not found: amplifiers too slow, or the path too fast."""
    if least.converged:
        return
    asked, limits = posed.asked, posed.asked.limits
    if limits.patches.has_rates:
        none = np.full_like(limits.patches.slew, np.inf)
        free = replace(asked, limits=replace(limits, patches=replace(limits.patches, slew=none, current=none)))
        if track(free, posed.breaks).converged:
            raise SolveError(
                "no motion follows the path within the largest current and slew rate of the"
                " amplifiers, whatever the voltages: slow the path down, or raise current or slew"
            )
    raise SolveError(
        "no motion of motors and patches was found: "
        + (causes(context, posed) or f"slow the path down, allow pre_actuation and post_actuation, or {raised(posed)}")
    )


def raised(posed: Posed) -> str:
    """Advice to raise limits: those of motors, by joint, and of patches, where they have any."""
    limits, joints = posed.asked.limits, motor_names(posed.asked.driven.model)
    names = [name for name, most in zip(joints, limits.torque, strict=True) if most < np.inf]
    keys = [f"moment_limit of {' and '.join(names)}"] if names else []
    keys += ["limit of patches"] if posed.asked.is_limited else []
    keys += ["current or slew of amplifiers"] if limits.patches.has_rates else []
    return f"raise {', '.join(keys)}" if keys else "take another path"


def causes(context: Context, posed: Posed) -> str:
    """Likely causes of no motion: friction, zeros at infinity, rough path ends, patches far from its point; else ""."""
    servo, linear = posed.asked.driven, posed.linear
    texts = [
        *servo.model.sticking,
        *singular_times(servo, linear),
        *rough_ends(servo.functions, servo.end),
        *_far_patches(context, linear),
    ]
    return "; ".join(texts)


def is_beyond(posed: Posed, least: Tracked) -> bool:
    """Whether the motion of least voltage is beyond the limits of patches."""
    return least.share > 1.0 + ENOUGH and posed.asked.is_limited


def needs_none(posed: Posed, least: Tracked) -> bool:
    """Whether motors alone stay within the path tolerance: the motion of least voltage has none."""
    return posed.asked.tolerance is not None and least.share < NONE


def warnings_of(context: Context, posed: Posed, intervals: int, least: Tracked) -> Iterator[str]:
    """Yield warnings: limits too small, with remedies; ends of the path and places of patches that cost voltage.

    `intervals`: number with which the analysis begins; `least`: the motion of least voltage.
    """
    servo, limits = posed.asked.driven, np.unique(np.abs(posed.asked.limits.patches.range))
    if is_beyond(posed, least):
        would = f"{least.share:.3g} times their limits"
        if len(limits) == 1:
            would = f"{least.share * limits[0]:.3g} V instead of {limits[0]:g} V"
        would = "; ".join([would, *_remedies(posed, intervals, least.share)])
        yield f"patches cannot do it within their limits. Any of these would do: {would}"
    if least.doubt > 3 * SETTLED:
        yield (
            f"the least voltage, {least.share * posed.asked.units.max():.3g} V, did not settle on finer meshes: it may"
            f" be {100 * least.doubt:.2g} % less. Fewer modes, or more intervals"
            if np.isfinite(least.doubt)
            else "the least voltage is that of the first intervals: finer ones had no solution. Fewer modes, or more"
            " intervals"
        )
    yield from rough_ends(servo.functions, servo.end)
    yield from _far_patches(context, posed.linear)


def price_of_tolerance(asked: Transition, least: Tracked) -> float | None:
    """Decrease of the least voltage, that of `least`, per path tolerance, V/m; None without one, or if too small."""
    if asked.tolerance is None:
        return None
    prices = float(least.prices["error"].sum() + least.prices["curving"].sum() / asked.tolerance.time**2)
    return None if least.share and prices * asked.allowed < SEEN else prices * float(asked.units.max())


def slowest(linear: Linearisation) -> float:
    """Size of the real part, 1/s, of the slowest zero where the path begins or ends; 0 if all are vibrations."""
    sizes = np.abs(linear.zeros.real[[0, -1]])[~linear.is_light[[0, -1]]]
    return float(sizes.min()) if sizes.size else 0.0


def _path_orders(targets: Sequence[TimeFunction], end: float) -> tuple[float, float]:
    """Power of time with which a path leaves its start and reaches its `end` (s): 2 where its acceleration jumps."""

    def order(t: float, step: float) -> float:
        once, twice = np.sqrt(sum(target.sample(t + step * np.array([1.0, 2.0]))[2] ** 2 for target in targets))
        return float(2.0 + np.log2(twice / once)) if once > 0 else np.inf

    return order(0.0, NEAR_END * end), order(end, -NEAR_END * end)


def _lower_order(servo: Servo) -> float:
    """The power of time with which a path leaves its start or reaches its end, the lower one that is known; else 4."""
    return min((order for order in _path_orders(servo.functions, servo.end) if order > 1), default=4.0)


def rough_ends(targets: Sequence[TimeFunction], end: float) -> Iterator[str]:
    """Yield a warning if the acceleration or jerk of a path (`targets`) jumps where it begins, or ends at `end`, s."""
    ends = dict(zip(("where it begins", "where it ends"), np.round(_path_orders(targets, end)), strict=True))
    for order, name, cost in (
        (2, "acceleration", "no voltage without jumps makes up for that"),
        (3, "jerk", "that takes several times the voltage"),
    ):
        if where := " and ".join(end for end, of in ends.items() if of == order):
            yield f"the path's {name} jumps {where}: {cost}. Smoother ends: 35*s**4 - 84*s**5 + 70*s**6 - 20*s**7"


def check_ends_for_gears(servo: Servo) -> float:
    """The lower of the powers of time with which the path begins and ends.

    Raises `InputError` where it is not smooth enough for motors behind compliant gears: torques of gears, which contain
    the path's acceleration, have to begin and end with rate 0.
    """
    for text in rough_ends(servo.functions, servo.end):
        raise InputError(
            "trajectory: expected jerk and acceleration without jumps for compliant gears, whose"
            " motors would need impulses",
            f"that {text}",
        )
    return min(_path_orders(servo.functions, servo.end))


def singular_times(servo: Servo, linear: Linearisation) -> Iterator[str]:
    """Yield when the determinant of the modal inertia with free motors changes its sign, and a remedy.

    The remedy names a rotor without which the sign stays, or else less mass; other modes may help.
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


def _far_patches(context: Context, linear: Linearisation) -> Iterator[str]:
    """A warning for each point of a path that is far from the last patch: voltages need not converge with modes.

    In the continuum the path must start flatter than exp(−t_ℓ/t), t_ℓ = ℓ² √(ρA/EI)/8 (`docs/theory.md`).
    """
    zeros = linear.zeros.real[[0, -1]]
    rate = float(zeros[(zeros > 0) & ~linear.is_light[[0, -1]]].min(initial=np.inf))
    model = (context.whole or context).model
    for name in dict.fromkeys(model.scene.path_points):
        body, _, point = name.partition(".")
        if (of_link := context.patches.get(body)) is None or not np.isfinite(rate):
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
