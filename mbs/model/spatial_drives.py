"""Forces of time that act on a robot in space beside gravity, elasticity and constraints. SI units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from ...common.arrays import Array
from .._core import TimeFunction


class Drive(NamedTuple):
    """A force of time on what it drives, by direction: generalized (n_v,)."""

    direction: Array
    size: TimeFunction


class PointDrive(NamedTuple):
    """Forces and moments of time on "BODY.POINT", by component ("x" … "mz"), global axes."""

    point: str
    components: Mapping[str, TimeFunction]


class FrameDrive(NamedTuple):
    """`sign` times the moment of a motor along the joint that carries body no. `body`: on frames, not on sections."""

    body: int
    sign: float
    size: TimeFunction


class Command(NamedTuple):
    """What a unit of a held command does: generalized forces `direction` (n_v,).

    Of motors on frames `frame` is as in `FrameDrive`: the number of the body that the joint carries, and the sign.
    """

    direction: Array
    frame: tuple[int, float] | None = None


class Drives(NamedTuple):
    """All that acts in a run beside the loads of the scene."""

    along: tuple[Drive, ...] = ()
    at_points: tuple[PointDrive, ...] = ()
    on_frames: tuple[FrameDrive, ...] = ()


NO_DRIVES = Drives()
