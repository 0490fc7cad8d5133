"""What an analysis may use when it runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, field
from typing import Protocol, TypeVar

from ...common.arrays import Array
from ...common.structs import struct
from .. import _core
from ..model.amplifiers import Amplifiers
from ..model.divided_link import DividedLink
from ..model.known_motion import State
from ..model.model import Model
from .drive import Progress
from .record import Run

Point = TypeVar("Point", str, str | None)


class PatchedLink(Protocol):
    """All k patches of one link, by the bodies that may carry them, of n modes: the link itself, or its pieces."""

    @property
    def per_volt(self) -> Mapping[str, Array]:
        """(n, k) modal forces per volt."""

    @property
    def amplifiers(self) -> Amplifiers:
        """Of its patches."""

    @property
    def edges(self) -> Array:
        """(k, 2) where patches begin and end, m from the root of the link."""

    @property
    def slowness(self) -> float:
        """√(ρA/EI) of the link, s/m²."""

    @property
    def to_reached(self) -> Mapping[str, Array]:
        """(m, n) modal forces as `allocation` takes them, by those on the modes of the file."""

    def allocation(self, *, limited: bool) -> _core.Allocation:
        """From modal forces to voltages, with the limits of the patches or without."""


class ActuationPoints(Protocol):
    """Points of one body for components of force."""

    def of_core(self) -> tuple[Array, Array, Array, Array]:
        """What `_core.point_reader` takes of their body: directions and positions (3, c), Φ (3 c, n), scale (6 + n)."""


ForcesAtPoints = Callable[[Run], Mapping[str, Array]]
"""By "BODY.POINT" what a run's driving forces are there: (T, 3) N, global axes."""


def no_points(run: Run) -> Mapping[str, Array]:
    """None."""
    return {}


@struct
class WholeLinks:
    """Of a model in which links are in pieces: the robot with the whole links, as scenes and controllers name it."""

    model: Model  # the robot with one body for each link
    divided: Mapping[str, DividedLink]  # the links in pieces by name
    places: Mapping[str, str]  # which point of which piece "BODY.POINT" of such a link is
    # an outcome of the pieces as one of the links; `InputError` where their joints lack coordinates
    as_links: Callable[[Run], Run]


@struct
class Context:
    """What the run of an analysis starts from."""

    _: KW_ONLY
    progress: Progress  # see `drive.Progress`
    model: Model  # the robot, with the constraint equations of all joints that close loops and of all trajectories
    outcomes: Mapping[str, Run]  # of the analyses before, by name
    is_replayed: bool = False  # whether a later analysis takes its actuation
    earlier: Run | None = None  # an earlier run of the same analysis, to go on with; None from the start
    patches: Mapping[str, PatchedLink] = field(default_factory=dict)  # of links by body
    points: Mapping[str, ActuationPoints] = field(default_factory=dict)  # actuation points by body
    at_points: ForcesAtPoints = no_points  # what driving forces are there
    start: State | None = None  # of a replay, in place of where the run that it replays starts
    whole: WholeLinks | None = None  # the links, where `model` has pieces of some


def place_of(whole: WholeLinks | None, point: Point) -> Point:
    """Where a point of the scene is in the model, of whose links some are in pieces where there are `whole` ones."""
    return point if whole is None or point is None else whole.places.get(point, point)
