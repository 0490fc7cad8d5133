"""What an analysis may use when it runs. SI units."""

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, field, replace
from typing import Protocol, TypeVar

import numpy as np

from ...common.arrays import Array
from ...common.structs import struct
from .. import _core
from ..model.amplifiers import Amplifiers, joined
from ..model.divided_link import DividedLink
from ..model.known_motion import State
from ..model.model import Model
from ..posture.path_start import PathStart
from .drive import Progress
from .record import Run

Point = TypeVar("Point", str, str | None)


class PatchedLink(Protocol):
    """A link with k patches, for their voltages: the bodies that carry them are the link itself, or its pieces."""

    @property
    def per_volt(self) -> Mapping[str, Array]:
        """Modal forces on n modes per volt (n, k), N/(√kg·V), by body."""

    @property
    def amplifiers(self) -> Amplifiers:
        """Amplifiers of its patches, their capacitances on a link without loads."""

    @property
    def edges(self) -> Array:
        """Begin and end of patches, x (k, 2) in m."""

    @property
    def slowness(self) -> float:
        """√(ρA/EI) of the link, s/m²."""

    @property
    def to_reached(self) -> Mapping[str, Array]:
        """Matrices (m, n), no unit, by body, from forces on n modes of the file to those on m that patches reach."""

    def allocation(self, *, limited: bool) -> _core.Allocation:
        """The map from m modal forces to k voltages, with limits of the patches or without."""


def strain_directions(model: Model, patches: Mapping[str, PatchedLink]) -> Array:
    """Matrix (k, n_v) from v (n_v,), SI units, to the currents Φ_Vᵀ ṗ, A, of all k patches."""
    rows = [model.modal_directions(of_link.per_volt) for of_link in patches.values()]
    return np.concatenate([np.zeros((0, model.tree.n_v)), *rows])


def amplifiers_on(model: Model, patches: Mapping[str, PatchedLink]) -> Amplifiers:
    """The amplifiers of all patches, their capacitances where modes of the model stand still."""
    of, Phi_V = joined(of.amplifiers for of in patches.values()), strain_directions(model, patches)
    return replace(of, capacitance=of.capacitance - model.compliance(Phi_V, Phi_V))


class PointsOfBody(Protocol):
    """Points of one body for c components of force along its axes."""

    def of_core(self) -> tuple[Array, Array, Array, Array]:
        """Directions (3, c), positions (3, c), m, mode shapes (3 c, n), 1/√kg, factors to N (6 + n,)."""


ForcesAtPoints = Callable[[Run], Mapping[str, Array]]
"""By "BODY.POINT" what a run's driving forces are there: (T, 3) N, global axes."""


@struct
class WholeLinks:
    """The robot with whole links, as scenes and controllers name it, where the model has links in pieces."""

    model: Model  # the robot with one body for each link
    divided: Mapping[str, DividedLink]  # the links in pieces by name
    places: Mapping[str, str]  # from "LINK.POINT" of such a link to "PIECE.POINT" of the model
    # turns a run of the model into one of the links; `InputError` where joints have other places in the trees
    as_links: Callable[[Run], Run]


@struct
class Context:
    """Data from which the run of an analysis starts."""

    _: KW_ONLY
    progress: Progress  # called with the time reached, s; False stops the run
    model: Model  # the robot, with the constraint equations of all joints that close loops and of all trajectories
    outcomes: Mapping[str, Run]  # of the analyses before, by name
    path: PathStart | None = None  # of analyses that start on a path
    is_replayed: bool = False  # whether a later analysis applies the forces that are found
    earlier: Run | None = None  # a run of the same analysis that goes on; None from the start
    patches: Mapping[str, PatchedLink] = field(default_factory=dict)  # by link
    points: Mapping[str, PointsOfBody] = field(default_factory=dict)  # actuation points by body
    at_points: ForcesAtPoints = lambda _: {}  # driving forces at these
    start: State | None = None  # of a replay, in place of the start of the replayed run
    whole: WholeLinks | None = None  # whole links, where `model` has pieces of some


def place_of(whole: WholeLinks | None, point: Point) -> Point:
    """The model's "BODY.POINT" for that of the scene; they differ on links in pieces."""
    return point if whole is None or point is None else whole.places.get(point, point)
