"""From results of scenes in space to grids: what ParaView is given."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...common.arrays import Array, Indices, as_rows
from ...common.errors import InputError
from ...mbs.quantities.stress import surface_stress, von_mises
from ...results.file import Results
from ..drawn_3d.joints import Marker, ground_places, joint_markers, tool_marker
from ..drawn_3d.shapes import surface_shape
from ..motion import moving_bodies
from ..path_targets import targets
from .vtkhdf import Grid


def results_grid_3d(results: Results, analysis: str, frames: Indices, notes: list[str]) -> Grid:
    """The bodies of an analysis in space at the outputs `frames` (T,): r = R + A (x + Φ p), m, global axes.

    Data as in the plane (`grids.results_grid`): `deflection` A Φ p; `exaggeration`, of which s − 1 times shows
    deformations s times as large while joints stay shut; `von_mises`, Pa, where stresses of a surface are known;
    `body`, its number in the scene.
    """
    bodies, shift = moving_bodies(results, analysis, frames)
    shapes = [surface_shape(results, body, notes) for body in bodies]
    deflections = [shape.deflection(body) for shape, body in zip(shapes, bodies, strict=True)]
    points = [shape.placed(body, carried, 1.0) for shape, body, carried in zip(shapes, bodies, shift, strict=True)]
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
        cell_data={
            "body": np.concatenate(
                [np.full(len(shape.cells), numbers.index(b.name)) for shape, b in zip(shapes, bodies, strict=True)]
            )
        },
    )


def _von_mises(results: Results, analysis: str, body: str, frames: Indices) -> Array | None:
    """(T, p) Pa on the surface of a body; None where it is not known."""
    if not results.has(f"{analysis}/stress/{body}/surface"):
        return None
    try:
        link = results.modal_body(body)
    except InputError:  # told where its surface is drawn
        return None
    return von_mises(surface_stress(link, results.stress_recovery(analysis, body).at(frames)))


def marks_3d(results: Results, analysis: str, frames: Indices, scale: float) -> dict[str, Any]:
    """What a picture of a scene in space (`pictures.Picture`) shows besides bodies, at the outputs `frames`."""
    bodies, shift = moving_bodies(results, analysis, frames)
    joints = joint_markers(results.scene, bodies, shift)
    points = dict.fromkeys(target.point for target in targets(results, analysis))
    tools = [tool_marker(point, bodies, shift) for point in points]
    outputs = range(len(frames))

    def directed(marker: Marker, k: int) -> list[list[float]]:
        """Its place, and its directions."""
        return as_rows(np.stack([marker.exaggerated(scale)[k], *marker.directions[k]]))

    return {
        "in_space": True,
        "joints": [[directed(joint, k)[0] for joint in joints] for k in outputs],
        "axes": [
            [[at, axis] for at, *axes in (directed(joint, k) for joint in joints) for axis in axes] for k in outputs
        ],
        "tools": [[directed(tool, k) for tool in tools] for k in outputs],
        "ground": as_rows(ground_places([results.scene])),
    }
