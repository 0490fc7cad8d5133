"""From modal bodies and results to grids: what ParaView is given."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError
from ...fe_models.modal_body import ModalBody
from ...mbs.quantities.stress import surface_stress, von_mises
from ...results.file import Results
from ..body_surface import body_surface
from ..motion import moving_bodies
from ..shapes import surface_shape
from .vtkhdf import Grid


def modes_grid(body: ModalBody) -> Grid:
    """The surface of a link, undeformed, with every mode as a vector: displacement per unit of modal coordinate."""
    mesh = body_surface(body)
    modes = {mode_name(body, k): mesh.mode_shapes[None, :, :, k] for k in range(body.mode_count)}
    return Grid([mesh.cells], mesh.points[None], point_data=modes)


def mode_name(body: ModalBody, k: int) -> str:
    """Of mode k, from 0: its number, frequency and family."""
    return f"mode {k + 1:02d}, {body.frequency[k]:.5g} Hz, {body.family[k]}"


def results_grid(results: Results, analysis: str, frames: Indices, notes: list[str]) -> Grid:
    """The bodies of an analysis at the outputs `frames` (T,), where they were: r = R + A (x + Φ p), m, global axes.

    Point data: `deflection` A Φ p, and `exaggeration`, by which points move when deflections are made larger by one
    while joints stay shut: r + (s − 1) exaggeration shows deformations s times as large. `von_mises`, Pa, where
    stresses of a surface are known. Cell data: `body`, its number in the scene. `notes` say what could not be drawn as
    it is.
    """
    bodies, shift = moving_bodies(results, analysis, frames)
    shapes = [surface_shape(results, body, notes) for body in bodies]
    deflections = [shape.deflection(body) for shape, body in zip(shapes, bodies, strict=True)]
    points = [shape.placed(body) for shape, body in zip(shapes, bodies, strict=True)]
    exaggerations = [deflection + carried[:, None] for deflection, carried in zip(deflections, shift, strict=True)]
    data = {"deflection": deflections, "exaggeration": exaggerations}
    stresses = [_von_mises(results, analysis, body.name, frames) for body in bodies]
    if any(stress is not None for stress in stresses):
        data["von_mises"] = [
            np.full(deflection.shape[:2], np.nan) if stress is None else stress
            for stress, deflection in zip(stresses, deflections, strict=True)
        ]
    first = np.cumsum([0, *(len(shape.points) for shape in shapes[:-1])])
    numbers = [body["name"] for body in results.scene["body"]]
    return Grid(
        cells=[shape.cells + start for shape, start in zip(shapes, first, strict=True)],
        points=np.concatenate(points, axis=1),
        time=results.time(analysis)[frames],
        point_data={name: np.concatenate(parts, axis=1) for name, parts in data.items()},
        cell_data={"body": np.repeat([numbers.index(b.name) for b in bodies], [len(s.cells) for s in shapes])},
    )


def _von_mises(results: Results, analysis: str, body: str, frames: Indices) -> Array | None:
    """(T, p) Pa on the surface of a body; None where it is not known."""
    if not results.has(f"{analysis}/stress/{body}/surface"):
        return None
    try:
        link = results.modal_body(body)
    except InputError:  # a note where its surface is drawn
        return None
    return von_mises(surface_stress(link, results.stress_recovery(analysis, body).at(frames)))
