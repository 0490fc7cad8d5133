"""What an analysis in space may use that knows of patches."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from ..fe_models.modal_body import ModalBody
from ..mbs.analysis.outcome import Outcome
from ..mbs.analysis.spatial_run import SpatialContext
from ..mbs.model.divided_link import DividedLink
from ..mbs.model.spatial_body import SpatialBody
from ..mbs.model.spatial_model import SpatialModel
from .patches.spatial_patches import LinkPatches


@dataclass(frozen=True)
class WholeLinksInSpace:
    """Of a robot in space whose links are in pieces: see `WholeLinks`.

    Attributes:
        model: the robot with one body for each link.
        divided: the links in pieces by name.
        places: which point of which piece "BODY.POINT" of such a link is.
        told: a run of the pieces, as one of the links; `InputError` where their joints cannot say it.
    """

    model: SpatialModel
    divided: Mapping[str, DividedLink]
    places: Mapping[str, str]
    told: Callable[[Outcome], Outcome]


@dataclass(frozen=True)
class ActuatedSpatialContext(SpatialContext):
    """With the `patches` of links by body, the modal bodies of `links`, bodies `carrying` all their payloads.

    `whole` are the links of a robot in which some are in pieces: `model` has the pieces then.
    """

    patches: Mapping[str, LinkPatches] = field(default_factory=dict)
    links: Mapping[str, ModalBody] = field(default_factory=dict)
    carrying: Mapping[str, SpatialBody] = field(default_factory=dict)
    whole: WholeLinksInSpace | None = None
