"""The bodies of a scene: from links, modal body files or numbers, with payloads and patches that are part of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from ..actuation.patches.patches import patch_array
from ..actuation.patches.structure import StructureEffect, structure_effect, with_patches
from ..fe_models.link_records import Family
from ..fe_models.modal_body_file import read_modal_body
from ..mbs.model.masses import with_payload
from ..mbs.model.planar_body import PlanarBody, from_modal_body, from_rigid_body
from ..scene.scene import Scene
from .loaded_body import IN_PLANE, Loaded, payloads_on


@dataclass(frozen=True, kw_only=True)
class LoadedBody(Loaded):
    """A body of the scene with its planar equations."""

    planar: PlanarBody
    motions: tuple[Family, ...] = IN_PLANE


def load_bodies(scene: Scene, stage: Callable[[str], None]) -> list[LoadedBody]:
    """In the order of the scene, with their payloads; stage 1 runs where links are out of date, and tells `stage`."""
    loaded = []
    for body in scene.body:
        if body.rigid is not None:
            loaded.append(LoadedBody(planar=from_rigid_body(body.name, body.rigid)))
        elif body.modal is not None:
            modal = read_modal_body(body.modal)
            loaded.append(LoadedBody(planar=from_modal_body(body.name, modal), modal=modal, path=body.modal))
        else:
            from ..fe_models.link import cached_modal_body

            assert body.link is not None
            outcome = cached_modal_body(body.link, stage)
            loaded.append(
                LoadedBody(
                    planar=from_modal_body(body.name, outcome.body),
                    modal=outcome.body,
                    path=outcome.path,
                    computed=outcome.computed,
                    reused=outcome.reused,
                )
            )
    return [_with_payloads(scene, body) for body in loaded]


def _with_payloads(scene: Scene, body: LoadedBody) -> LoadedBody:
    planar = body.planar
    for point, payload in payloads_on(scene.payload, planar.name, planar.points, scene.path):
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
