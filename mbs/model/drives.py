"""Forces over time on a robot beside gravity, elasticity and constraints. SI units."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from ...common.arrays import Array
from .._core import ForceSource, TimeFunction


class Drive(NamedTuple):
    """Generalized force: `size`, a function of time, N or N·m, times `direction` (n_v,), SI units."""

    direction: Array
    size: TimeFunction


class PointDrive(NamedTuple):
    """Forces (N) and moments (N·m) over time on "BODY.POINT", by component ("x" … "mz"), global axes."""

    point: str
    components: Mapping[str, TimeFunction]


class Command(NamedTuple):
    """Generalized forces `direction` (n_v,), SI units, of a unit command: 1 N·m, N or V.

    For a motor that turns frames, not sections, `frame` has the index of the body and the sign of the torque on it.
    """

    direction: Array
    frame: tuple[int, float] | None = None


class Replayed(NamedTuple):
    """Inputs over time that an earlier analysis found, N, N·m or V, and the generalized forces of a unit of each."""

    source: ForceSource  # of all inputs, at any time
    commands: tuple[Command, ...]  # effect of a unit of each input; 0 of those at points
    # by "BODY.POINT" the index of the input of each component ("x" … "mz"), global axes
    at_points: Mapping[str, Mapping[str, int]] = MappingProxyType({})
    # by joint the indices of inputs along its coordinates, N·m or N on its second side
    moments: Mapping[str, Sequence[int]] = MappingProxyType({})
    # time to find inputs at one instant, in evaluations of the equations
    evaluations: float = 0.0
    breaks: Sequence[float] = ()  # (n,) s, at which inputs may jump
    integrator: str = ""  # of the earlier analysis, where this run repeats its motion; else empty


class Drives(NamedTuple):
    """All forces acting in a run in addition to the loads of the scene."""

    at_points: tuple[PointDrive, ...] = ()
    replayed: Replayed | None = None


NO_DRIVES = Drives()
