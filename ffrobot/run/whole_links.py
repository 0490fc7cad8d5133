"""What analyses have to know of whole links where the equations are those of their pieces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError
from ..mbs.model.divided_link import DividedLink, PieceOfLink, divided_link_of
from ..mbs.model.model import Model
from ..mbs.model.nodes import Node
from ..mbs.run.context import WholeLinks
from ..mbs.run.record import Run
from ..scene.pieces import places_on_pieces
from .pieces import links_in_pieces
from .prepared import Prepared


def make_whole_links(prepared: Prepared) -> WholeLinks | None:
    """The links of a scene in which some are in pieces; None where none is."""
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

    Its multipliers and what drives it stay behind. Raises `InputError` for joints that have no coordinates there.
    """
    tree = run.model.tree
    q = np.zeros((len(run.time), whole.tree.n_q))
    v, a = np.zeros((2, len(run.time), whole.tree.n_v))
    for node in whole.tree.nodes:
        if node.joint.freedoms:
            _take_joint(whole, node, run, (q, v, a))
        link = divided.get(node.body.name)
        names = (node.body.name,) if link is None else link.bodies
        bodies = [tree.nodes[tree.index[name]] for name in names]
        T = np.eye(node.body.n_modes) if link is None else link.gathered
        for to, values, place in zip((q, v, a), (run.q, run.v, run.a), ("p_q", "p_v", "p_v"), strict=True):
            to[:, getattr(node, place)] = np.hstack([values[:, getattr(of, place)] for of in bodies]) @ T.T
    multipliers = np.zeros((len(run.time), len(whole.rows)))
    alone = replace(run, required=None, prescribed=None, twists={}, links={})
    return replace(alone, model=whole, q=q, v=v, a=a, multipliers=multipliers)


def _take_joint(whole: Model, node: Node, run: Run, states: tuple[Array, Array, Array]) -> None:
    """Coordinates, rates and accelerations of the joint of `node`, from the tree of the pieces to that of the links."""
    tree = run.model.tree
    number = tree.carried.get(node.joint.name)
    same = number is not None and tree.nodes[number].backwards == node.backwards
    if number is None or not (same or len(node.joint.units) == 1):
        raise InputError(
            f"{whole.scene.path}: {node.joint.label}: expected joints that have the same place in the tree with"
            " subdivided links as with whole ones if these are controlled",
            "another. List it before the others of its loop",
        )
    sign, other = 1.0 if same else -1.0, tree.nodes[number]
    for to, values, slices in zip(states, (run.q, run.v, run.a), ("q", "v", "v"), strict=True):
        to[:, getattr(node, slices)] = sign * values[:, getattr(other, slices)]
