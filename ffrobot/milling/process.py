"""A milling process from its file, and what it makes of one pose of a robot: `ffrobot map --milling`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from ..common.arrays import Array, as_floats
from ..common.errors import InputError
from ..common.toml_files import load_toml
from ..common.validation import Record, validate
from ..mbs.fields.field_types import NotNegative, Positive, Quantity, Vector3
from ..mbs.linear.joint_conditions import FreeCoordinates
from .stability import Cutter, StabilityLimits, Tip, limit_depth, stability_limits

BELOW, ABOVE = 10.0, 1000.0  # the depth without lobes: where those of lobes are sought
ALONG = 1e-6  # of a direction, across the axis: none
MOST_SPEEDS = 1000
FEEDS = 12  # directions of feed within half a turn, beyond which forces are the same


def spread(given: object) -> object:
    """Evenly spaced numbers of a text "FIRST:LAST:COUNT"; anything else as it is."""
    if not isinstance(given, str):
        return tuple(given) if isinstance(given, list) else given
    try:
        first, last, count = given.split(":")
        if 1 <= int(count) <= MOST_SPEEDS:
            return tuple(np.linspace(float(first), float(last), int(count)).tolist())
    except ValueError:
        pass
    raise ValueError(f'expected a list, or "FIRST:LAST:COUNT" of at most {MOST_SPEEDS}, found "{given}"')


class Milling(Record):
    """A cutter, its cutting coefficients, and the engagement of its teeth."""

    teeth: Annotated[int, Field(ge=1, le=100)]
    """Number of teeth, straight and equally spaced."""
    tangential: Positive
    """Tangential cutting coefficient, N/m²."""
    radial: NotNegative
    """Radial cutting coefficient, N/m²."""
    entry: Quantity
    """Angle at which a tooth enters the cut, from the normal to the feed, rad: 0 of up milling."""
    exit: Quantity
    """Angle at which it leaves the cut, rad: π of down milling."""
    axis: Vector3 = (0.0, 0.0, 1.0)
    """Axis of the tool, from the cut into the spindle, in the axes of the point (without own ones: global axes)."""
    feed: Vector3 | None = None
    """Direction of the feed of the tool in global axes; its part across the axis counts. Default: the worst one."""
    highest: Positive = 1000.0
    """Highest natural frequency, Hz, of modes that vibrate; modes above it are rigid."""
    speeds: Annotated[tuple[Positive, ...], BeforeValidator(spread), Field(max_length=MOST_SPEEDS)] = ()
    """Spindle speeds, rev/min, at which the stable depth is computed: a list, or "FIRST:LAST:COUNT"."""
    method: Literal["averaged", "semi-discretization"] = "averaged"
    """Method at these speeds: with averaged cutting forces, or with the forces of each angle, which takes longer."""

    @model_validator(mode="after")
    def _turns(self) -> Self:
        if not 0.0 <= self.entry < self.exit <= np.pi + 1e-9:
            raise ValueError(f"expected 0 ≤ entry < exit ≤ π, found {self.entry:g} and {self.exit:g}")
        if not any(self.axis):
            raise ValueError("expected an axis with a direction, found zero")
        return self

    @property
    def cutter(self) -> Cutter:
        """Teeth, coefficients and angles."""
        return Cutter(self.teeth, self.tangential, self.radial, self.entry, self.exit)

    def feeds(self, axes: Array) -> Array:
        """Axes (n, 2, 3): unit vectors along the feed, and normal to it, so that the tool's axis is feed × normal.

        In global axes; `axes` (3, 3) has those of the point in rows. Raises `InputError` for a feed along the axis.
        """
        axis = np.array(self.axis) @ axes / np.linalg.norm(self.axis)
        given = np.eye(3)[np.abs(axis).argmin()] if self.feed is None else np.array(self.feed)
        x = given - axis * (axis @ given)
        if (size := np.linalg.norm(x)) <= ALONG * np.linalg.norm(given):
            raise InputError("milling: feed: expected a direction across the axis of the tool", "one along it")
        x /= size
        angles = np.arange(FEEDS) * np.pi / FEEDS if self.feed is None else np.zeros(1)
        y, c, s = np.cross(axis, x), np.cos(angles)[:, None], np.sin(angles)[:, None]
        return as_floats(np.stack([c * x + s * y, c * y - s * x], axis=1))


def read_milling(path: Path) -> Milling:
    """The process in the TOML file at `path`. Raises `InputError` for wrong keys."""
    return validate(Milling, load_toml(path, "milling file"), path)


def stable_depths(milling: Milling, free: FreeCoordinates, J: Array, axes: Array) -> dict[str, Array]:
    """Stable depths of a pose: with `free` coordinates and rows J (d, f) of the tip's translations along s.

    J is in global axes, `axes` (3, 3) has those of the tip in rows. `milling_depth` m: without chatter at any speed, of
    the worst feed; `milling_best_depth` m: of the best one, `milling_feed` (3,). With speeds also `milling_lobes` (S,)
    m there: averaged forces take the worst feed of each speed, semi-discretization that of `milling_depth`.
    """
    tip, feeds = _tip(free, J, milling.highest), milling.feeds(axes)
    omega, G = tip.response()
    limits = [stability_limits(milling.cutter.average, omega, across @ G @ across.T) for across in feeds]
    depths = np.array([one.least for one in limits])
    values = {
        "milling_depth": depths.min(),
        "milling_best_depth": depths.max(),
        "milling_feed": feeds[depths.argmax(), 0],
    }
    if milling.speeds:
        worst = tip._replace(J=feeds[depths.argmin()] @ tip.J)
        values["milling_lobes"] = _lobes(milling, limits, worst, float(depths.min()))
    return {name: np.asarray(value, dtype=float) for name, value in values.items()}


def _tip(free: FreeCoordinates, J: Array, highest: float) -> Tip:
    """The modes up to `highest` Hz of the free coordinates, with the tip's translations (3, m)."""
    values, V = np.linalg.eigh((free.K + free.K.T) / 2)
    V = V[:, values < (2 * np.pi * highest) ** 2]
    rows = np.zeros((3, V.shape[1]))
    rows[: len(J)] = J @ free.N @ V
    return Tip(V.T @ free.K @ V, V.T @ free.D @ V, rows)


def _lobes(milling: Milling, limits: Sequence[StabilityLimits], worst: Tip, least: float) -> Array:
    """Stable depths (S,), m, at the speeds, by the `limits` of all feeds, or of the `worst` one, from `least` m on."""
    speed = np.array(milling.speeds) * 2 * np.pi / 60
    if milling.method == "averaged" or not np.isfinite(least):
        return as_floats(np.min([one.lobes(milling.teeth, speed) for one in limits], axis=0))
    bounds = least / BELOW, least * ABOVE
    return np.array([limit_depth(worst, milling.cutter, float(each), bounds) for each in speed])
