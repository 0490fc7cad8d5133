"""The bodies of a scene: from links, modal body files or numbers, with their payloads."""

import hashlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from ..actuation.patches.records import by_body
from ..common.errors import InputError, did_you_mean, naming, of_file, quoted
from ..common.structs import struct
from ..fe_models.link_records.families import FAMILIES, Family
from ..fe_models.modal_body import ModalBody
from ..fe_models.modal_body_file import read_modal_body
from ..mbs.fields.field_types import split_point
from ..mbs.model.body import Body, from_modal_body, rigid_body, with_tool
from ..mbs.model.masses import turns_as_a_body, with_payload
from ..mbs.model.projection import projected
from ..mbs.scene.bodies import BodyKeys, Payload, Tool, tensor
from ..scene.scene import Scene

if TYPE_CHECKING:
    from ..actuation.patches.composite import PlacedLayout, StructureEffect


@struct
class LoadedBody:
    """A body of the scene."""

    _: KW_ONLY
    spatial: Body  # its equations in space, in which payloads with inertia on links are bodies of their own
    # the same with these payloads at small rotations: its modes are those of the loaded link
    carrying: Body
    structure: "StructureEffect | None" = None  # change of mass and stiffness by patches; None without any
    # its modal body and the file of that, None where it is rigid
    modal: ModalBody | None = None
    path: Path | None = None
    computed: bool = False  # whether stage 1 ran for it
    reused: str = ""  # "modes" or "mesh" that it took from an earlier run, or empty
    # families of motion (bending, torsion, axial) that the scene can require of a link
    motions: tuple[Family, ...] = FAMILIES

    @property
    def file_hash(self) -> str:
        """SHA-256 of the modal body file; empty where rigid."""
        return hashlib.sha256(self.path.read_bytes()).hexdigest() if self.path else ""

    @property
    def rigid_in(self) -> tuple[Family, ...]:
        """Families of motion of which a link's file has no modes; () of a rigid body."""
        return () if self.modal is None else tuple(one for one in self.motions if one not in self.modal.family)

    @property
    def without_coordinate(self) -> tuple[Family, ...]:
        """Families of motion of which a link's file has modes, but the equations have neither mode nor static shape."""
        if self.modal is None or self.spatial.reduction is None:
            return ()
        moving = self.spatial.modal_transform.any(axis=1)
        kept = {family for family, moves in zip(self.modal.family, moving, strict=True) if moves}
        return tuple(one for one in self.motions if one in self.modal.family and one not in kept)


def links_of(bodies: Mapping[str, LoadedBody]) -> dict[str, ModalBody]:
    """Modal bodies of flexible `bodies`, by name."""
    return {name: body.modal for name, body in bodies.items() if body.modal is not None}


P = TypeVar("P", Payload, Tool)


def _records_on(
    kind: str, records: Iterable[P], body: str, points: Collection[str], scene: Path
) -> Iterator[tuple[str, P]]:
    """Payloads or tools (`kind`) of a body with their points."""
    for record in records:
        name, point = split_point(record.point)
        if name != body:
            continue
        if point not in points:
            raise InputError(
                f'{scene}: {kind}: point: expected a point of "{name}" ({quoted(points)})',
                f'"{record.point}"{did_you_mean(point, points)}',
            )
        yield point, record


def load_bodies(scene: Scene, stage: Callable[[str], None]) -> dict[str, LoadedBody]:
    """Load bodies by name in the order of the scene, with payloads and patches; runs stage 1 for outdated links.

    Links have data for geometric stiffening where the scene, or their key `pieces`, may require it. `stage` is called
    with the name of each step. Raises `InputError` for wrong files, and payloads and patches that do not fit.
    """
    patches = dict(by_body(scene.pzt))
    with of_file(scene.path):
        loaded = {body.name: _loaded(scene, body, stage) for body in scene.body}
    for name, body in loaded.items():
        spatial = carrying = body.spatial
        for point, payload in _records_on("payload", scene.payload, name, spatial.points, scene.path):
            F = spatial.points[point].triad
            about = point, payload.mass, F @ np.array(payload.center), F @ tensor(payload.inertia) @ F.T
            carrying = with_payload(carrying, *about)
            if body.modal is None or not turns_as_a_body(scene, payload):
                spatial = with_payload(spatial, *about)
        body = replace(body, spatial=spatial, carrying=carrying)
        if any(layout.adds_mass or layout.adds_stiffness for layout in patches.get(name, ())):
            from ..actuation.patches.link_patches import link_patches, placed_patches

            assert body.modal is not None
            with naming(scene.path):
                link_patches(patches[name], body.modal, carrying)  # refuses patches that do not fit
                body = with_structure(body, placed_patches(patches[name], body.modal))
        if scene.is_planar:
            body = replace(body, spatial=projected(body.spatial), carrying=projected(body.carrying))
        loaded[name] = body
    return loaded


def _loaded(scene: Scene, body: BodyKeys, stage: Callable[[str], None]) -> LoadedBody:
    """Without payloads and patches, which in a planar scene are on modes that move in the plane."""
    path, computed, reused, modal = None, False, "", None
    if (rigid := body.rigid) is not None:
        points = {name: np.array(position) for name, position in rigid.points.items()}
        made = rigid_body(body.name, rigid.mass, np.array(rigid.center), tensor(rigid.inertia), points)
    elif body.modal is not None:
        modal, path = read_modal_body(body.modal), body.modal
    else:
        from ..fe_models.link import cached_modal_body

        assert body.link is not None
        outcome = cached_modal_body(body.link, stage)
        modal, path, computed, reused = outcome.body, outcome.path, outcome.computed, outcome.reused
    if modal is not None:
        stiffened = bool(scene.geometric_stiffening) or body.pieces is not None
        made = from_modal_body(body.name, modal, stiffened, is_planar=scene.is_planar)
    made = projected(made) if scene.is_planar else made
    for _, tool in _records_on("tool", scene.tool, made.name, made.points, scene.path):
        if tool.name in made.points:
            raise InputError(f'tool: name: expected one that no point of "{made.name}" has', f'"{tool.name}"')
        made = with_tool(made, tool)
    return LoadedBody(
        spatial=made,
        carrying=made,
        modal=modal,
        path=path,
        computed=computed,
        reused=reused,
        motions=("in-plane-bending",) if scene.is_planar else FAMILIES,  # stretch: see `omissions`
    )


def with_structure(body: LoadedBody, placed: "Sequence[PlacedLayout]") -> LoadedBody:
    """Add mass and stiffness of patches to a link or a piece of it, according to its layouts."""
    if body.modal is None or not any(one.layout.adds_mass or one.layout.adds_stiffness for one in placed):
        return body
    from ..actuation.patches.composite import patched_body, structure_effect_of

    spatial, carrying = (patched_body(of, body.modal, placed) for of in (body.spatial, body.carrying))
    effect = structure_effect_of(body.carrying, carrying)
    return replace(body, spatial=spatial, carrying=carrying, structure=effect)
