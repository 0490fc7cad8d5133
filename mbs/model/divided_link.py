"""Subdivided links: modal coordinates of the link by those of its pieces, and back. SI units.

A link that bends in its modes bends every piece, relative to the chord of the piece. The coordinates of a piece
minimize the strain energy of the difference. Since a piece has the static shapes of moments at its ends, its ends then
rotate as those of the link: what is orthogonal in energy to a load's static shape does no work with that load.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.structs import struct
from ...fe_models.modal_body import ModalBody
from .body import Body, BodyPoint

INTERVALS = 32  # of a piece, over which strains are taken as constant


@struct
class DividedLink:
    """Relation, no unit, of n modal coordinates of a link to N of its pieces, side by side from root to tip."""

    bodies: tuple[str, ...]  # names of the pieces
    # (N, n) p of the pieces by p of the link. Its transpose makes modal forces on the link from those on the pieces
    spread: Array
    # (n, N) p of the link nearest in strain energy to those of the pieces; the smallest where the link has more modes
    gathered: Array


@struct
class LinkInPieces:
    """A subdivided link, to read the motion of its pieces as that of the link."""

    modal: ModalBody  # modal body of the link
    names: tuple[str, ...]  # of the pieces, from the root to the tip
    starts: Sequence[float]  # where each piece begins, m from the root
    pieces: tuple[ModalBody, ...]  # modal bodies of the pieces
    places: Mapping[str, str]  # "PIECE.POINT" of each point of the link by label
    points: Mapping[str, BodyPoint]  # these points in the whole link
    to_own: Array  # (n_file, n), no unit: p (T, n_file) of the file times it are p (T, n) of the link's equations


class PieceOfLink(NamedTuple):
    """A piece of a link: `start`, m from the root of the link, its modal body, and its equations (`spatial`)."""

    start: float
    modal: ModalBody
    spatial: Body


def divided_link_of(link: ModalBody, spatial: Body, pieces: Sequence[PieceOfLink]) -> DividedLink:
    """The relation of a link and its pieces in coordinates of their equations (`spatial`: the link's)."""
    of_file = [_shape_in_piece(link, piece.start, piece.modal) for piece in pieces]
    own = [np.linalg.pinv(piece.spatial.modal_transform) @ p for piece, p in zip(pieces, of_file, strict=True)]
    spread = np.vstack(own) @ spatial.modal_transform
    root = np.sqrt(np.concatenate([piece.spatial.stiffness for piece in pieces]))
    names = tuple(piece.spatial.name for piece in pieces)
    return DividedLink(names, spread, np.linalg.pinv(root[:, None] * spread) * root)


def spread_of(link: ModalBody, pieces: Sequence[tuple[float, ModalBody]]) -> Array:
    """The matrix (N, n), no unit, from modes of a link to modes of its pieces, both of the files.

    `pieces`: begin, m from the root, and modal body of each from root to tip. Bending planes, twist and stretch do not
    couple, so that their rigidities do not matter.
    """
    return np.vstack([_shape_in_piece(link, start, piece) for start, piece in pieces])


def _shape_in_piece(link: ModalBody, start: float, piece: ModalBody) -> Array:
    x = np.linspace(0.0, piece.length, INTERVALS + 1)
    of_link = _changes(link, link.begin + start + x)
    return np.linalg.lstsq(_changes(piece, x), of_link, rcond=None)[0]


def _changes(modal: ModalBody, x: Array) -> Array:
    """(4 · intervals, n) changes of section rotation about all axes, and of axial displacement, between places x."""
    places = [modal.interpolate(at) for at in x]
    rows = np.array([[*at.rotation, at.translation[0]] for at in places])  # (places, 4, n)
    return np.diff(rows, axis=0).reshape(4 * (len(x) - 1), -1)
