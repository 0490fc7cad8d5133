"""Links in pieces: what their pieces are, how far they bend, and how many are enough."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..common.arrays import as_floats
from ..common.errors import InputError
from ..mbs.model.divided_link import LinkInPieces
from ..mbs.quantities.attachment_error import PieceInMotion, missed_by_pieces
from ..mbs.quantities.motion import modal_coordinates, node_of, section_motion
from ..mbs.quantities.second_order import IN_MOTION, Missing, largest_displacement
from ..mbs.quantities.validity import ENOUGH, Bending, enough_pieces, link_bending, shape_from_chord
from ..mbs.run.record import Run
from ..scene.pieces import BodyInPieces, bodies_in_pieces
from ..scene.scene import Scene
from .prepared import Prepared

MOST = 64


def links_in_pieces(prepared: Prepared) -> dict[str, LinkInPieces]:
    """The links in pieces of a scene, by name."""
    links = {}
    for name, body in prepared.divided.items():
        modal, whole = prepared.bodies[name].modal, prepared.bodies[name].spatial
        pieces = (prepared.parts[piece].modal for piece in body.names)
        assert modal is not None
        links[name] = LinkInPieces(
            modal=modal,
            names=body.names,
            starts=body.cut.starts,
            pieces=tuple(piece for piece in pieces if piece is not None),
            places={label: body.point(label) for label in body.cut.places},
            points=whole.points,
            to_own=as_floats(np.linalg.pinv(whole.modal_transform).T),
        )
    return links


def wanted_pieces(prepared: Prepared, runs: Sequence[Run]) -> dict[str, int]:
    """Return the number of pieces for bodies with `pieces = "auto"` after a solve; empty if they have it.

    What a piece loses of its length goes down with the square of their number. A run that failed has bent links
    farther than they are.
    """
    wanted, now = {}, {}
    for body in prepared.scene.body:
        if body.pieces == "auto":
            names = prepared.divided[body.name].names if body.name in prepared.divided else (body.name,)
            worst = max((_shortening(prepared, runs, name) for name in names), default=0.0)
            count = enough_pieces(worst, len(names)) if worst > ENOUGH else 1
            wanted[body.name], now[body.name] = max(min(MOST, count), len(names)), len(names)
    return {} if wanted == now else wanted


def bending_of_links(prepared: Prepared, run: Run) -> dict[str, Bending]:
    """Return deflections of flexible bodies (of links in pieces, the worst piece) and whether they can be divided."""
    bodies = prepared.parts or prepared.bodies
    links = {name: body.modal for name, body in bodies.items() if body.modal is not None}
    worst = worst_of_pieces(link_bending(run, links), prepared.divided)
    for name in prepared.divided:
        if worst[name].is_stiffened:
            worst[name] = replace(worst[name], missing=_missing(prepared, run, name))
    if not run.is_at_rest:
        worst = shared_in_motion(worst)
    return {
        name: replace(bent, is_divisible=is_divisible(prepared.scene, name)) if bent.is_beyond else bent
        for name, bent in worst.items()
    }


def _missing(prepared: Prepared, run: Run, name: str) -> Missing:
    """What the pieces of a link miss, which have geometric stiffening; in motion it makes the link vibrate besides."""
    link, pieces = prepared.bodies[name].modal, []
    assert link is not None
    for piece in prepared.divided[name].names:
        modal, node = prepared.parts[piece].modal, node_of(run, piece)
        assert modal is not None
        ends = (section_motion(run, f"{piece}.{end}") for end in ("root", "tip"))
        pieces.append(PieceInMotion(modal, node.body, run.q[:, node.p_q], *ends))
    of_length = float(np.linalg.norm(missed_by_pieces(pieces), axis=1).max(initial=0.0)) / link.length
    of_length *= 1.0 if run.is_at_rest else IN_MOTION
    whole = largest_displacement(link, modal_coordinates(run, name))
    return Missing(of_length, min(1.0, of_length / whole) if whole else 0.0)


def _shortening(prepared: Prepared, runs: Sequence[Run], name: str) -> float:
    """The largest of a body of the equations over all analyses, of its length."""
    modal = (prepared.parts or prepared.bodies)[name].modal
    assert modal is not None
    shortenings = [shape_from_chord(modal, modal_coordinates(run, name))[2].max(initial=0.0) for run in runs]
    return float(max(shortenings, default=0.0)) / modal.length


def worst_of_pieces(bending: Mapping[str, Bending], divided: Mapping[str, BodyInPieces]) -> dict[str, Bending]:
    """Return deflections of links; for a divided link those of its worst piece."""
    link_of = {piece: name for name, body in divided.items() for piece in body.names}
    worst: dict[str, Bending] = {}
    for piece, bent in bending.items():
        name = link_of.get(piece, piece)
        if name not in worst or bent.missing.of_length > worst[name].missing.of_length:
            worst[name] = bent
    return {
        name: replace(bent, pieces=len(divided[name].names)) if name in divided else bent
        for name, bent in worst.items()
    }


def shared_in_motion(bending: Mapping[str, Bending]) -> dict[str, Bending]:
    """Return deflections with the largest errors for all links: errors of one link move and load all others."""
    missing = [of.missing for of in bending.values()] or [Missing(0.0, 0.0)]
    worst = Missing(*(max(errors) for errors in zip(*missing, strict=True)))
    return {name: replace(of, missing=of.missing.grown_to(worst)) for name, of in bending.items()}


def is_divisible(scene: Scene, name: str) -> bool:
    """Whether the scene lets a body be divided into pieces."""
    try:
        return bool(bodies_in_pieces(scene, {name: 2}))
    except InputError:
        return False
