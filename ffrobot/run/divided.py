"""Links in pieces among the bodies of a scene: their modal coordinates, and their patches on the pieces."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..actuation.patches.patches import PatchArray, edges_on_piece, on_pieces, patch_edges
from ..actuation.patches.records import PztLayout
from ..actuation.patches.structure import with_patches
from ..mbs.model.divided_link import DividedLink, Piece, divided_link
from ..mbs.model.model import ModalLoad
from ..mbs.model.planar_body import PlanarBody
from ..scene.pieces import BodyInPieces
from ..scene.scene import Scene
from .bodies import LoadedBody

Bodies = Mapping[str, LoadedBody]


def pieces_of(body: BodyInPieces, parts: Bodies) -> list[Piece]:
    """The pieces of a link, from the root to the tip, among the bodies `parts`."""
    found = []
    for name, start in zip(body.names, body.cut.starts, strict=True):
        modal = parts[name].modal
        assert modal is not None
        found.append(Piece(start, modal, parts[name].planar))
    return found


def as_divided(link: LoadedBody, body: BodyInPieces, parts: Bodies) -> DividedLink:
    """The modal coordinates of a link in those of its pieces."""
    assert link.modal is not None
    return divided_link(link.modal, link.planar, pieces_of(body, parts))


def patched_pieces(layout: PztLayout, length: float, body: BodyInPieces, parts: Bodies) -> dict[str, LoadedBody]:
    """The pieces of a link (`length`, m) with mass and stiffness of its patches, as far as the layout says so."""
    if not (layout.adds_mass or layout.adds_stiffness):
        return {}
    found = {}
    for name, piece in zip(body.names, pieces_of(body, parts), strict=True):
        which, edges = edges_on_piece(layout, patch_edges(layout, length), piece.start, piece.modal.length)
        if which.size:
            found[name] = replace(parts[name], planar=with_patches(piece.planar, piece.modal, layout, edges))
    return found


def patches_on_pieces(
    path: Path, patches: Mapping[str, PatchArray], bodies: Bodies, divided: Mapping[str, BodyInPieces], parts: Bodies
) -> dict[str, PatchArray]:
    """The patches of the links in pieces, on these."""
    return {
        name: on_pieces(path, patches[name], as_divided(bodies[name], body, parts), pieces_of(body, parts))
        for name, body in divided.items()
        if name in patches
    }


def voltage_loads(
    scene: Scene, patches: Mapping[str, PatchArray], bodies: Mapping[str, PlanarBody]
) -> Iterator[ModalLoad]:
    """Given voltages of the scene as modal forces on the `bodies` that carry the patches."""
    for load in scene.load:
        if load.pzt is None:
            continue
        array = patches[load.pzt]
        ends = np.cumsum([bodies[name].n_modes for name in array.carriers])
        for k, function in enumerate(load.components.values()):
            for name, vector in zip(array.carriers, np.split(array.Phi_V[:, k], ends[:-1]), strict=True):
                yield ModalLoad(name, vector, function)
