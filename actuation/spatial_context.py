"""What an analysis in space may use that knows of patches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..fe_models.modal_body import ModalBody
from ..mbs.analysis.spatial_run import SpatialContext
from ..mbs.model.spatial_body import SpatialBody
from .patches.spatial_patches import LinkPatches


@dataclass(frozen=True)
class ActuatedSpatialContext(SpatialContext):
    """With the `patches` of links by body, the modal bodies of `links`, and bodies `carrying` all their payloads."""

    patches: Mapping[str, LinkPatches] = field(default_factory=dict)
    links: Mapping[str, ModalBody] = field(default_factory=dict)
    carrying: Mapping[str, SpatialBody] = field(default_factory=dict)
