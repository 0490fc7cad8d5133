"""Context of analyses of robots with patches."""

from collections.abc import Mapping
from dataclasses import KW_ONLY, field
from typing import TYPE_CHECKING

from ..common.structs import struct
from ..fe_models.modal_body import ModalBody
from ..mbs.model.body import Body
from ..mbs.run.context import Context

if TYPE_CHECKING:
    from .patches.link_patches import LinkPatches


@struct
class ActuatedContext(Context):
    """Context with `patches`, modal bodies of `links`, and equations of links `carrying` payloads, each by link."""

    _: KW_ONLY
    patches: "Mapping[str, LinkPatches]" = field(default_factory=dict)
    links: Mapping[str, ModalBody] = field(default_factory=dict)
    carrying: Mapping[str, Body] = field(default_factory=dict)
