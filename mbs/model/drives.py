"""Forces of time that act on a robot beside gravity, elasticity and constraints. SI units."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from ...common.arrays import Array
from .._core import ForceSource, TimeFunction


class Drive(NamedTuple):
    """Force that is a function of time, N or N·m, and its generalized direction (n_v,)."""

    direction: Array
    size: TimeFunction


class PointDrive(NamedTuple):
    """Forces (N) and moments (N·m) of time on "BODY.POINT", by component ("x" … "mz"), global axes."""

    point: str
    components: Mapping[str, TimeFunction]


class Command(NamedTuple):
    """Effect of a unit command: generalized forces `direction` (n_v,).

    Of motors on frames, not on sections, `frame` has the number of the body that the joint carries, and the sign.
    """

    direction: Array
    frame: tuple[int, float] | None = None


class Replayed(NamedTuple):
    """Inputs that an earlier analysis found: numbers over time from `source`, generalized forces of a unit of each."""

    source: ForceSource  # of the numbers, at any time
    commands: tuple[Command, ...]  # what a unit of each does; of those at points nothing
    # by "BODY.POINT" the number of each component ("x" … "mz"), global axes
    at_points: Mapping[str, Mapping[str, int]] = MappingProxyType({})
    # by joint those that act along its coordinates, N·m or N on its second side
    moments: Mapping[str, Sequence[int]] = MappingProxyType({})
    # in the time of which the numbers at one time are found: those of a motion solved anew take longer
    evaluations: float = 0.0
    breaks: Sequence[float] = ()  # (n,) s, at which the numbers may jump
    integrator: str = ""  # of the earlier analysis, where this run repeats its motion; else empty


class Drives(NamedTuple):
    """All forces acting in a run in addition to the loads of the scene."""

    at_points: tuple[PointDrive, ...] = ()
    replayed: Replayed | None = None


NO_DRIVES = Drives()
