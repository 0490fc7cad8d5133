"""The bodies of a scene in space: from links, modal body files or numbers, with their payloads."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..common.errors import InputError
from ..common.validation import did_you_mean, quoted
from ..fe_models.link_records import FAMILIES
from ..fe_models.modal_body import ModalBody
from ..fe_models.modal_body_file import read_modal_body
from ..mbs.fields.field_types import split_point
from ..mbs.model.spatial_body import SpatialBody, from_modal_body, rigid_body
from ..mbs.model.spatial_masses import with_payload
from ..mbs.scene.spatial.bodies import BodyInSpace, tensor
from ..scene.spatial import SpatialScene


@dataclass(frozen=True)
class LoadedSpatialBody:
    """A body of the scene: its modal body and file (None where rigid) and its equations in space."""

    spatial: SpatialBody
    modal: ModalBody | None
    path: Path | None
    computed: bool = False
    reused: str = ""

    @property
    def file_hash(self) -> str:
        """SHA-256 of the modal body file; empty where rigid."""
        return hashlib.sha256(self.path.read_bytes()).hexdigest() if self.path else ""

    @property
    def rigid_in(self) -> tuple[str, ...]:
        """Families in which a link does not move; none of a rigid body."""
        if self.modal is None:
            return ()
        return tuple(family for family in FAMILIES if family not in self.modal.family)


def load_spatial_bodies(scene: SpatialScene, stage: Callable[[str], None]) -> list[LoadedSpatialBody]:
    """In the order of the scene, with their payloads; stage 1 runs where links are out of date, and tells `stage`."""
    return [_with_payloads(scene, _loaded(body, stage)) for body in scene.body]


def _loaded(body: BodyInSpace, stage: Callable[[str], None]) -> LoadedSpatialBody:
    if body.rigid is not None:
        rigid = body.rigid
        points = {name: np.array(position) for name, position in rigid.points.items()}
        made = rigid_body(body.name, rigid.mass, np.array(rigid.center), tensor(rigid.inertia), points)
        return LoadedSpatialBody(made, None, None)
    if body.modal is not None:
        modal = read_modal_body(body.modal)
        return LoadedSpatialBody(from_modal_body(body.name, modal), modal, body.modal)
    from ..fe_models.link import cached_modal_body

    assert body.link is not None
    outcome = cached_modal_body(body.link, stage)
    spatial = from_modal_body(body.name, outcome.body)
    return LoadedSpatialBody(spatial, outcome.body, outcome.path, outcome.computed, outcome.reused)


def _with_payloads(scene: SpatialScene, body: LoadedSpatialBody) -> LoadedSpatialBody:
    spatial = body.spatial
    for payload in scene.payload:
        name, point = split_point(payload.point)
        if name != spatial.name:
            continue
        if point not in spatial.points:
            raise InputError(
                f'{scene.path}: payload: point: expected a point of "{name}" ({quoted(spatial.points)}), found'
                f' "{payload.point}"{did_you_mean(point, spatial.points)}'
            )
        spatial = with_payload(spatial, point, payload.mass, np.array(payload.center), tensor(payload.inertia))
    return replace(body, spatial=spatial)
