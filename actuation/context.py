"""What an analysis may use that knows of patches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..fe_models.modal_body import ModalBody
from ..mbs.analysis.context import Context
from .patches.patches import PatchArray


@dataclass(frozen=True)
class ActuatedContext(Context):
    """With the `patches` and the modal bodies of `links`, both by body."""

    patches: Mapping[str, PatchArray] = field(default_factory=dict)
    links: Mapping[str, ModalBody] = field(default_factory=dict)
