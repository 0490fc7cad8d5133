"""The bodies of a scene in space: from links, modal body files or numbers, with their payloads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..fe_models.link_records import FAMILIES
from ..fe_models.modal_body_file import read_modal_body
from ..mbs.model.spatial_body import SpatialBody, from_modal_body, rigid_body
from ..mbs.model.spatial_masses import with_payload
from ..mbs.scene.spatial.bodies import BodyInSpace, tensor
from ..scene.spatial import SpatialScene
from .loaded_body import Loaded, payloads_on


@dataclass(frozen=True, kw_only=True)
class LoadedSpatialBody(Loaded):
    """A body of the scene with its equations in space."""

    spatial: SpatialBody

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
        return LoadedSpatialBody(spatial=made)
    if body.modal is not None:
        modal = read_modal_body(body.modal)
        return LoadedSpatialBody(spatial=from_modal_body(body.name, modal), modal=modal, path=body.modal)
    from ..fe_models.link import cached_modal_body

    assert body.link is not None
    outcome = cached_modal_body(body.link, stage)
    return LoadedSpatialBody(
        spatial=from_modal_body(body.name, outcome.body),
        modal=outcome.body, path=outcome.path, computed=outcome.computed, reused=outcome.reused,
    )  # fmt: skip


def _with_payloads(scene: SpatialScene, body: LoadedSpatialBody) -> LoadedSpatialBody:
    spatial = body.spatial
    for point, payload in payloads_on(scene.payload, spatial.name, spatial.points, scene.path):
        spatial = with_payload(spatial, point, payload.mass, np.array(payload.center), tensor(payload.inertia))
    return replace(body, spatial=spatial)
