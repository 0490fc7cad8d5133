"""Links in pieces: what their pieces are, how far they bend, how many are enough, and the whole links' motion."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np

from ..common.errors import InputError
from ..mbs.model.divided_link import DividedLink, LinkInPieces, PieceOfLink, divided_link_of
from ..mbs.model.model import Model
from ..mbs.quantities.attachment_error import missed_by_pieces
from ..mbs.quantities.motion import modal_coordinates
from ..mbs.quantities.validity import (
    ENOUGH,
    IN_MOTION,
    Bending,
    Missing,
    enough_pieces,
    largest_displacement,
    link_bending,
    shape_from_chord,
)
from ..mbs.run.context import WholeLinks
from ..mbs.run.record import Run
from ..scene.pieces import bodies_in_pieces, places_on_pieces
from ..scene.scene import Scene
from .prepared import Prepared

MOST = 64  # pieces of a link


def links_in_pieces(prepared: Prepared) -> dict[str, LinkInPieces]:
    """The links in pieces of a scene, by name."""
    links, own = {}, prepared.solved_links
    for name, body in prepared.divided.items():
        whole = prepared.bodies[name].spatial
        links[name] = LinkInPieces(
            modal=prepared.links[name],
            names=body.names,
            starts=body.cut.starts,
            pieces=tuple(own[piece] for piece in body.names),
            places={label: body.point(label) for label in body.cut.places},
            points=whole.points,
            to_own=np.linalg.pinv(whole.modal_transform).T,
        )
    return links


def wanted_pieces(prepared: Prepared, runs: Sequence[Run]) -> dict[str, int]:
    """Return the number of pieces for bodies with `pieces = "auto"` after a solve; {} if they have enough.

    A run that failed bends links too far.
    """
    wanted, now, links = {}, {}, prepared.solved_links
    for body in prepared.scene.body:
        if body.pieces == "auto":
            names = prepared.divided[body.name].names if body.name in prepared.divided else (body.name,)
            worst = 0.0  # shortening, of the length
            for name, run in product(names, runs):
                shortening = shape_from_chord(links[name], modal_coordinates(run, name))[2].max(initial=0.0)
                worst = max(worst, float(shortening) / links[name].length)
            count = enough_pieces(worst, len(names)) if worst > ENOUGH else 1
            wanted[body.name], now[body.name] = max(min(MOST, count), len(names)), len(names)
    return {} if wanted == now else wanted


def bending_of_links(prepared: Prepared, run: Run) -> dict[str, Bending]:
    """Largest deflections in a run by flexible body; of links in pieces, those of the worst piece.

    In motion every link has the largest errors of any: links move each other.
    """
    divided = prepared.divided
    link_of = {piece: name for name, body in divided.items() for piece in body.names}
    worst: dict[str, Bending] = {}
    for piece, bent in link_bending(run, prepared.solved_links).items():
        name = link_of.get(piece, piece)
        if name not in worst or bent.missing.of_length > worst[name].missing.of_length:
            worst[name] = bent
    for name, body in divided.items():
        missing = _missing(prepared, run, name) if worst[name].is_stiffened else worst[name].missing
        worst[name] = replace(worst[name], pieces=len(body.names), missing=missing)
    if worst and not run.is_at_rest:
        most = Missing(*map(max, zip(*(of.missing for of in worst.values()), strict=True)))
        worst = {name: replace(of, missing=of.missing.grown_to(most)) for name, of in worst.items()}
    return {
        name: replace(bent, is_divisible=_is_divisible(prepared.scene, name)) if bent.is_beyond else bent
        for name, bent in worst.items()
    }


def _missing(prepared: Prepared, run: Run, name: str) -> Missing:
    """What the pieces of a link miss, which have geometric stiffening; in motion it makes the link vibrate besides."""
    link, own = prepared.links[name], prepared.solved_links
    pieces = {piece: own[piece] for piece in prepared.divided[name].names}
    of_length = float(np.linalg.norm(missed_by_pieces(run, pieces), axis=1).max(initial=0.0)) / link.length
    of_length *= 1.0 if run.is_at_rest else IN_MOTION
    whole = largest_displacement(link, modal_coordinates(run, name))
    return Missing(of_length, min(1.0, of_length / whole) if whole else 0.0)


def _is_divisible(scene: Scene, name: str) -> bool:
    try:
        return bool(bodies_in_pieces(scene, {name: 2}))
    except InputError:
        return False


def make_whole_links(prepared: Prepared) -> WholeLinks | None:
    """The robot with whole links, for analyses whose equations have pieces; None where no link is divided."""
    if prepared.whole is None:
        return None
    divided = {}
    for name, link in links_in_pieces(prepared).items():
        own = (prepared.parts[piece].spatial for piece in link.names)
        pieces = [PieceOfLink(*of) for of in zip(link.starts, link.pieces, own, strict=True)]
        divided[name] = divided_link_of(link.modal, prepared.bodies[name].spatial, pieces)
    places = places_on_pieces(prepared.divided)
    return WholeLinks(prepared.whole, divided, places, partial(_as_links, prepared.whole, divided))


def _as_links(whole: Model, divided: Mapping[str, DividedLink], run: Run) -> Run:
    """A run of the pieces in the coordinates of the robot with whole links: those of joints, and the nearest shapes.

    Its multipliers and what drives it stay behind.
    """
    tree = run.model.tree
    q = np.zeros((len(run.time), whole.tree.n_q))
    v, a = np.zeros((2, len(run.time), whole.tree.n_v))
    for node in whole.tree.nodes:
        if node.joint.freedoms:
            number = tree.carried.get(node.joint.name)
            same = number is not None and tree.nodes[number].backwards == node.backwards
            if number is None or not (same or len(node.joint.units) == 1):
                raise InputError(
                    f"{whole.scene.path}: {node.joint.label}: expected joints that have the same place in the tree with"
                    " subdivided links as with whole ones if these are controlled",
                    "another. List it before the others of its loop",
                )
            sign, other = 1.0 if same else -1.0, tree.nodes[number]
            for to, values, slices in zip((q, v, a), (run.q, run.v, run.a), ("q", "v", "v"), strict=True):
                to[:, getattr(node, slices)] = sign * values[:, getattr(other, slices)]
        link = divided.get(node.body.name)
        names = (node.body.name,) if link is None else link.bodies
        bodies = [tree.nodes[tree.index[name]] for name in names]
        T = np.eye(node.body.n_modes) if link is None else link.gathered
        for to, values, place in zip((q, v, a), (run.q, run.v, run.a), ("p_q", "p_v", "p_v"), strict=True):
            to[:, getattr(node, place)] = np.hstack([values[:, getattr(of, place)] for of in bodies]) @ T.T
    multipliers = np.zeros((len(run.time), len(whole.rows)))
    alone = replace(run, required=None, prescribed=None, twists={}, links={})
    return replace(alone, model=whole, q=q, v=v, a=a, multipliers=multipliers)
