"""What an analysis may use that knows of patches."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

from ..fe_models.modal_body import ModalBody
from ..mbs.analysis.context import Context, PlanarContext
from ..mbs.analysis.planar_outcome import PlanarOutcome
from ..mbs.model.divided_link import DividedLink
from ..mbs.model.model import Model
from ..mbs.model.spatial_body import SpatialBody
from .patches.patches import PatchArray
from .patches.spatial_patches import LinkPatches


@dataclass(frozen=True)
class PlanarWholeLinks:
    """Of a model in which links are in pieces: the robot with the whole links, as scenes and controllers name it.

    Attributes:
        model: with one body for each link; `patches` of these.
        divided: the links in pieces by name.
        places: which point of which piece "BODY.POINT" of such a link is.
        told: an outcome of the pieces, as one of the links.
    """

    model: Model
    patches: Mapping[str, PatchArray]
    divided: Mapping[str, DividedLink]
    places: Mapping[str, str]
    told: Callable[[PlanarOutcome], PlanarOutcome]


Point = TypeVar("Point", str, str | None)


class _Places(Protocol):
    @property
    def places(self) -> Mapping[str, str]:
        """Of points of links in pieces."""


def place_of(whole: _Places | None, point: Point) -> Point:
    """Where a point of the scene is in the model, of whose links some are in pieces where there are `whole` ones."""
    return point if whole is None or point is None else whole.places.get(point, point)


@dataclass(frozen=True, kw_only=True)
class ActuatedContext(Context):
    """With the `patches` of links by body, the modal bodies of `links`, bodies `carrying` all their payloads."""

    patches: Mapping[str, LinkPatches] = field(default_factory=dict)
    links: Mapping[str, ModalBody] = field(default_factory=dict)
    carrying: Mapping[str, SpatialBody] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class PlanarActuatedContext(PlanarContext):
    """With the `patches` on bodies of the model by link, the modal bodies of `links`, and `whole` links if divided."""

    patches: Mapping[str, PatchArray] = field(default_factory=dict)
    links: Mapping[str, ModalBody] = field(default_factory=dict)
    whole: PlanarWholeLinks | None = None
