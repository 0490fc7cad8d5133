"""A link in pieces as the one link: what modal coordinates of the link are in those of its pieces, and back. SI units.

A link that bends as its modes say bends every piece, seen from the chord of that piece. Of the shapes of a piece those
coordinates are taken that leave the least strain energy of the difference; since a piece has the static shapes of
moments at its ends, the rotations of its ends are then those of the link (what is orthogonal in energy to a load's
static shape does no work with that load), and so are turns of sections from cut to cut along the whole link.
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
    """The n modal coordinates of a link and the N of its pieces, side by side from the root to the tip."""

    bodies: tuple[str, ...]  # names of the pieces
    # (N, n) p of the pieces where the link bends in its modes. Its transpose makes modal forces on the link of those on
    # the pieces: virtual work
    spread: Array
    # (n, N) p of the link that are nearest to those of the pieces, in strain energy; the smallest where the link has
    # more modes than its pieces
    gathered: Array


@struct
class LinkInPieces:
    """A link in pieces, to read the motion of the pieces as that of the link."""

    modal: ModalBody  # its modal body
    names: tuple[str, ...]  # of the pieces, from the root to the tip
    starts: Sequence[float]  # where each begins, m from the root
    pieces: tuple[ModalBody, ...]  # their modal bodies
    places: Mapping[str, str]  # of its points by label, as "PIECE.POINT"
    points: Mapping[str, BodyPoint]  # the same in the whole link
    to_own: Array  # (n_file, n) modal coordinates of the whole link in the equations, by those of its file


class PieceOfLink(NamedTuple):
    """A piece of a link in space: where it begins, m from the root of the link, its modal body, and its equations."""

    start: float
    modal: ModalBody
    spatial: Body


def divided_link_of(link: ModalBody, spatial: Body, pieces: Sequence[PieceOfLink]) -> DividedLink:
    """Return the relation between a link and its pieces, in the coordinates of the pieces' equations."""
    of_file = [_shape_in_piece(link, piece.start, piece.modal) for piece in pieces]
    own = [np.linalg.pinv(piece.spatial.modal_transform) @ p for piece, p in zip(pieces, of_file, strict=True)]
    spread = np.vstack(own) @ spatial.modal_transform
    root = np.sqrt(np.concatenate([piece.spatial.stiffness for piece in pieces]))
    names = tuple(piece.spatial.name for piece in pieces)
    return DividedLink(names, spread, np.linalg.pinv(root[:, None] * spread) * root)


def spread_of(link: ModalBody, pieces: Sequence[tuple[float, ModalBody]]) -> Array:
    """Return the matrix (N, n), without unit, from modes of a link in 3D to modes of its pieces, both of the files.

    Pieces are given by where they begin, m from the root, from the root to the tip. Planes of bending, twist and
    stretch do not couple, so that their rigidities are of no account.
    """
    return np.vstack([_shape_in_piece(link, start, piece) for start, piece in pieces])


def _shape_in_piece(link: ModalBody, start: float, piece: ModalBody) -> Array:
    x = np.linspace(0.0, piece.length, INTERVALS + 1)
    of_link = _changes(link, np.minimum(start + x, link.length))
    return np.asarray(np.linalg.lstsq(_changes(piece, x), of_link, rcond=None)[0])


def _changes(modal: ModalBody, x: Array) -> Array:
    """(4 · intervals, n) changes of section rotation about all axes, and of axial displacement, between places x."""
    places = [modal.interpolate(at) for at in x]
    rows = np.array([[*at.rotation, at.translation[0]] for at in places])  # (places, 4, n)
    return np.diff(rows, axis=0).reshape(4 * (len(x) - 1), -1)
