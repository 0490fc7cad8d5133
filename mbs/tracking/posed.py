"""A tracking problem as posed for a scene, and what is said of it: whether patches can do it, why not, and warnings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np

from ...common.arrays import Array
from ...common.errors import SolveError
from ...common.structs import struct
from ..inversion.servo import Servo
from ..inversion.zero_dynamics import Linearisation
from ..run.context import Context
from .advice import (
    Bounds,
    bounds_of_zeros,
    check_within_reach,
    enough_path_time,
    enough_time,
    enough_tolerance,
    far_patches,
    rough_ends,
    singular_times,
)
from .gear_motion import motor_names
from .intervals import OUT_OF_REACH, SETTLED
from .problem import track
from .transition import Limits, Tracked, Transition

ENOUGH = 1e-6  # of the limits: least voltages beyond them by less are within
WEAK = 1.05  # times the limits of motors: least torques on few intervals that finer ones do not bring within them
AMPLE = 1e3  # times the largest torque along the path: as good as no limit
NONE = 1e-4  # of the limits: voltages that motors alone do without


@struct
class Posed:
    """What is asked for, on which breaks (s), `coarse` ones for a least voltage; time before and after the path (s)."""

    servo: Servo
    linear: Linearisation
    around: tuple[float, float]
    asked: Transition
    breaks: Array
    coarse: Array

    @cached_property
    def bounds(self) -> Bounds | None:
        """What each zero requires, V; None where motors alone have no bounded motion."""
        try:
            return bounds_of_zeros(self.servo, self.asked, self.linear, self.around, self.asked.units)
        except SolveError:
            return None


def check_motors(posed: Posed) -> None:
    """Raise `SolveError` where motors need more than their limits, with patches of `OUT_OF_REACH` times theirs.

    Their least torque is looked for where torques along the path exceed the limits without patches.
    """
    limits, linear = posed.asked.limits, posed.linear
    peaks = np.abs(posed.servo.quasi_static(linear.times, linear.shape)).max(axis=0)
    if (peaks <= limits.torque).all():
        return
    far = OUT_OF_REACH * limits.patches.range
    torque = np.where(np.isfinite(limits.torque), limits.torque, AMPLE * peaks.max())
    asked = replace(posed.asked, objective="least-torque", limits=Limits(replace(limits.patches, range=far), torque))
    least = track(asked, posed.coarse)
    if least.converged and least.share > WEAK:
        needed = [
            f"of {name} from {torque[k]:g} to more than {least.share * torque[k]:.3g}"
            for k, name in enumerate(motor_names(posed.servo.model))
            if least.prices["torque"][k] > 0.0
        ]
        raise SolveError(
            f"{posed.servo.where}: no motion follows the path within the motors' limits, not even with"
            f" {OUT_OF_REACH:g} times the voltages: raise moment_limit {' and '.join(needed)}, or slow the path down if"
            " torques at rest are within limits"
        )


def check_found(context: Context, posed: Posed, least: Tracked) -> None:
    """Raise `SolveError` where there is no least voltage: amplifiers are too slow, or the path is too fast."""
    if least.converged:
        return
    asked, limits = posed.asked, posed.asked.limits
    if limits.patches.has_rates:
        none = np.full_like(limits.patches.slew, np.inf)
        free = replace(asked, limits=replace(limits, patches=replace(limits.patches, slew=none, current=none)))
        if track(free, posed.breaks).converged:
            raise SolveError(
                f"{posed.servo.where}: no motion follows the path within the largest current and slew rate of the"
                " amplifiers, whatever the voltages: slow the path down, or raise current or slew"
            )
    raise SolveError(
        f"{posed.servo.where}: no motion of motors and patches was found: "
        + (causes(context, posed) or f"slow the path down, allow pre_actuation and post_actuation, or {raised(posed)}")
    )


def raised(posed: Posed) -> str:
    """Advice to raise the limits that there are: of motors, by their joints, and of patches."""
    limits = posed.asked.limits
    names = [name for name, most in zip(motor_names(posed.servo.model), limits.torque, strict=True) if most < np.inf]
    keys = [f"moment_limit of {' and '.join(names)}"] if names else []
    keys += ["limit of patches"] if posed.asked.is_limited else []
    keys += ["current or slew of amplifiers"] if limits.patches.has_rates else []
    return f"raise {', '.join(keys)}" if keys else "take another path"


def causes(context: Context, posed: Posed) -> str:
    """Why there may be no motion: zeros at infinity, ends of the path, patches far from its point; may be empty."""
    zeros = posed.linear.zeros[[0, -1]]
    return "; ".join(
        [
            *singular_times(posed.servo, posed.linear),
            *rough_ends(posed.servo.functions, posed.servo.end),
            *far_patches(context, zeros),
        ]
    )


def is_beyond(posed: Posed, least: Tracked) -> bool:
    """Whether the least voltage is beyond the limits of patches."""
    return least.share > 1.0 + ENOUGH and posed.asked.is_limited


def needs_none(posed: Posed, least: Tracked) -> bool:
    """Whether motors alone stay within the path tolerance, so that no voltage is needed."""
    return posed.asked.tolerance is not None and least.share < NONE


def check_reach(posed: Posed, least: Tracked | None) -> None:
    """Raise `SolveError` where a zero, or the least voltage, surely needs far more than the limits."""
    shares = [] if posed.bounds is None else (posed.bounds.voltages / posed.asked.units.max()).tolist()
    shares += [] if least is None else [least.surely]
    if posed.asked.is_limited:
        check_within_reach(posed.asked, posed.linear, posed.bounds, max(shares, default=0.0))


def warnings_of(context: Context, posed: Posed, intervals: int, least: Tracked) -> Iterator[str]:
    """Warnings: what would do where limits are too small, ends of the path and places of patches that cost voltage."""
    if is_beyond(posed, least):
        given = posed.servo, posed.asked, intervals, posed.around, least.share
        limits = np.unique(posed.asked.units)
        would = [
            f"{least.share * limits[0]:.3g} V instead of {limits[0]:g} V"
            if len(limits) == 1
            else f"{least.share:.3g} times their limits"
        ]
        if np.isfinite(more := enough_time(*given)):
            would.append(f"{1e3 * more:.3g} ms more of pre_actuation and post_actuation")
        if np.isfinite(longer := enough_path_time(*given)):
            would.append(f"the same path in {longer:.3g} s")
        relief = 0.0 if posed.bounds is None else float(posed.bounds.relief.max(initial=0.0)) / limits.max()
        if np.isfinite(wider := enough_tolerance(*given, relief)):
            would.append(f"{1e3 * wider:.3g} mm of path_tolerance")
        yield f"patches cannot do it within their limits. Any of these would do: {'; '.join(would)}"
    if least.doubt > 3 * SETTLED:
        yield (
            f"the least voltage, {least.share * posed.asked.units.max():.3g} V, did not settle on finer meshes: it may"
            f" be {100 * least.doubt:.2g} % less. Fewer modes, or more intervals"
            if np.isfinite(least.doubt)
            else "the least voltage is that of the first intervals: finer ones had no solution. Fewer modes, or more"
            " intervals"
        )
    yield from rough_ends(posed.servo.functions, posed.servo.end)
    yield from far_patches(context, posed.linear.zeros[[0, -1]])
