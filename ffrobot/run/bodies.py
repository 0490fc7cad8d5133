"""The bodies of a scene: from links, modal body files or numbers, with payloads and patches that are part of them."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from ..actuation.patches.patches import patch_array
from ..actuation.patches.structure import StructureEffect, structure_effect, with_patches
from ..common.errors import InputError
from ..common.validation import did_you_mean, quoted
from ..fe_models.modal_body import ModalBody
from ..fe_models.modal_body_file import read_modal_body
from ..mbs.fields.field_types import split_point
from ..mbs.model.masses import with_payload
from ..mbs.model.planar_body import PlanarBody, from_modal_body, from_rigid_body
from ..scene.scene import Scene


@dataclass(frozen=True)
class LoadedBody:
    """A body of the scene: its modal body and file (None where rigid) and its planar equations."""

    planar: PlanarBody
    modal: ModalBody | None
    path: Path | None
    computed: bool = False
    reused: str = ""

    @property
    def file_hash(self) -> str:
        """SHA-256 of the modal body file; empty where rigid."""
        return hashlib.sha256(self.path.read_bytes()).hexdigest() if self.path else ""


def load_bodies(scene: Scene, stage: Callable[[str], None]) -> list[LoadedBody]:
    """In the order of the scene, with their payloads; stage 1 runs where links are out of date, and tells `stage`."""
    loaded = []
    for body in scene.body:
        if body.rigid is not None:
            loaded.append(LoadedBody(from_rigid_body(body.name, body.rigid), None, None))
        elif body.modal is not None:
            modal = read_modal_body(body.modal)
            loaded.append(LoadedBody(from_modal_body(body.name, modal), modal, body.modal))
        else:
            from ..fe_models.link import cached_modal_body

            assert body.link is not None
            outcome = cached_modal_body(body.link, stage)
            planar = from_modal_body(body.name, outcome.body)
            loaded.append(LoadedBody(planar, outcome.body, outcome.path, outcome.computed, outcome.reused))
    return [_with_payloads(scene, body) for body in loaded]


def _with_payloads(scene: Scene, body: LoadedBody) -> LoadedBody:
    planar = body.planar
    for payload in scene.payload:
        name, point = split_point(payload.point)
        if name != planar.name:
            continue
        if point not in planar.points:
            raise InputError(
                f'{scene.path}: payload: point: expected a point of "{name}" ({quoted(planar.points)}), found'
                f' "{payload.point}"{did_you_mean(point, planar.points)}'
            )
        planar = with_payload(planar, point, payload.mass, payload.inertia)
    return replace(body, planar=planar)


def add_patches(scene: Scene, bodies: dict[str, LoadedBody]) -> dict[str, StructureEffect]:
    """Adds mass and stiffness of patches to their links where the scene asks for it."""
    effects = {}
    for layout in scene.pzt:
        bare = bodies[layout.body]
        if (layout.adds_mass or layout.adds_stiffness) and bare.modal is not None:
            patch_array(scene.path, layout, bare.modal, bare.planar)  # refuses patches that do not fit
            bodies[layout.body] = replace(bare, planar=with_patches(bare.planar, bare.modal, layout))
            effects[layout.body] = structure_effect(bare.planar, bodies[layout.body].planar)
    return effects
