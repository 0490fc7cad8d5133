"""From modal bodies and results to grids: what ParaView is given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array, Indices, Integers
from ...common.errors import InputError
from ...common.plane import rotated
from ...fe_models.modal_body import ModalBody
from ...mbs.quantities.stress import surface_stress, von_mises
from ...results.file import Results
from ..body_surface import body_surface
from ..motion import MovingBody, moving_bodies
from ..outline import points_outline
from .vtkhdf import Grid


@dataclass(frozen=True)
class Piece:
    """What is drawn of one body: points (p, 3) in its frame, in m, moved by `shapes` (p, 3, n) times `modal` (T, n).

    Attributes:
        cells: (c, v) on the points.
        von_mises: (T, p) in Pa where the body's file has stresses of its surface.
    """

    motion: MovingBody
    points: Array
    shapes: Array
    modal: Array
    cells: Integers
    von_mises: Array | None = None


def modes_grid(body: ModalBody) -> Grid:
    """The surface of a link, undeformed, with every mode as a vector: displacement per unit of modal coordinate."""
    mesh = body_surface(body)
    modes = {mode_name(body, k): mesh.mode_shapes[None, :, :, k] for k in range(body.mode_count)}
    return Grid([mesh.cells], mesh.points[None], point_data=modes)


def mode_name(body: ModalBody, k: int) -> str:
    """Of mode k, from 0: its number, frequency and family."""
    return f"mode {k + 1:02d}, {body.frequency[k]:.5g} Hz, {body.family[k]}"


def results_grid(results: Results, analysis: str, frames: Indices, notes: list[str]) -> Grid:
    """The bodies of an analysis at the outputs `frames` (T,), where they were: r = R + A (x + Φ p).

    Point data, in global axes: `deflection` A Φ p, and `exaggeration`, by which points move when deflections are made
    larger by one while joints stay shut (`motion.carried`): r + (s − 1) exaggeration shows deformations s times as
    large. `von_mises` where modal stresses are known. Cell data: `body`, its number in the scene. `notes` are told what
    could not be drawn as it is.
    """
    motions, shift = moving_bodies(results, analysis, frames)
    pieces = [_piece(results, analysis, motion, frames, notes) for motion in motions]
    points, deflection, exaggeration = zip(*map(_placed, pieces, shift), strict=True)
    data = {"deflection": deflection, "exaggeration": exaggeration}
    if any(piece.von_mises is not None for piece in pieces):
        data["von_mises"] = tuple(
            np.full(moved.shape[:2], np.nan) if piece.von_mises is None else piece.von_mises
            for piece, moved in zip(pieces, deflection, strict=True)
        )
    numbers = [body["name"] for body in results.scene["body"]]
    first = np.cumsum([0, *(len(piece.points) for piece in pieces[:-1])])
    return Grid(
        cells=[piece.cells + start for piece, start in zip(pieces, first, strict=True)],
        points=np.concatenate(points, axis=1),
        time=results.time(analysis)[frames],
        point_data={name: np.concatenate(parts, axis=1) for name, parts in data.items()},
        cell_data={"body": np.repeat([numbers.index(p.motion.name) for p in pieces], [len(p.cells) for p in pieces])},
    )


def joint_places(results: Results, analysis: str, frames: Indices) -> tuple[Array, Array]:
    """Where revolute joints are at the outputs `frames` (T, j, 3) in m, and their exaggeration as of grids."""
    motions, shift = moving_bodies(results, analysis, frames)
    ends = {joint["between"][1] for joint in results.scene.get("joint", []) if joint["type"] == "revolute"}
    at: list[Array] = [np.zeros((len(frames), 0, 3))]
    exaggeration = at.copy()
    for motion, carried in zip(motions, shift, strict=True):
        here = [k for k, name in enumerate(motion.point_names) if name in ends]
        moved = motion.turned(motion.deflection[:, here])
        at.append(_in_space(motion.global_points[:, here]))
        exaggeration.append(_in_space(moved + carried[:, None]))
    return np.concatenate(at, axis=1), np.concatenate(exaggeration, axis=1)


def _placed(piece: Piece, shift: Array) -> tuple[Array, Array, Array]:
    """Where the points of a body are, their deflection and exaggeration (T, p, 3), in m and global axes."""
    moved = np.einsum("pin,tn->tpi", piece.shapes, piece.modal, optimize=True)
    angle, origin = piece.motion.orientation, _in_space(piece.motion.position[:, None])
    deflection = _turned(angle, moved)
    return origin + _turned(angle, piece.points + moved), deflection, deflection + _in_space(shift[:, None])


def _turned(angle: Array, vectors: Array) -> Array:
    """A(θ) times vectors (T, p, 3): a rotation about z."""
    return np.concatenate([rotated(angle[:, None], vectors[..., :2]), vectors[..., 2:]], axis=2)


def _in_space(vectors: Array) -> Array:
    """(…, 3) of (…, 2): z = 0."""
    return np.concatenate([vectors, np.zeros_like(vectors[..., :1])], axis=-1)


def _piece(results: Results, analysis: str, motion: MovingBody, frames: Indices, notes: list[str]) -> Piece:
    """A flexible body's surface; lines through the points of a rigid one, or of one whose modal body is not found."""
    if motion.modal is not None:
        try:
            body = results.modal_body(motion.name)
        except InputError as error:
            notes.append(f"{motion.name} is drawn through its points only: {error}")
        else:
            mesh, stress = body_surface(body), None
            if body.surface_stress is not None:
                recovery = results.stress_recovery(analysis, motion.name).at(frames)
                stress = von_mises(surface_stress(body, recovery))
            return Piece(motion, mesh.points, mesh.mode_shapes, motion.modal, mesh.cells, stress)
    names = [label.removeprefix(f"{motion.name}.") for label in motion.point_names]
    line = points_outline(names, motion.points, motion.deflection)
    k = len(line.at)
    cells = np.zeros((1, 1), dtype=np.int64) if k == 1 else np.stack([np.arange(k - 1), np.arange(1, k)], axis=1)
    shapes = np.moveaxis(_in_space(np.moveaxis(line.modes, 1, 2)), 2, 1)
    return Piece(motion, _in_space(line.at), shapes, line.p, cells)
