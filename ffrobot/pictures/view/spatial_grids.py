"""From results of scenes in space to grids: what ParaView is given."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Indices
from ...results.file import Results
from ..spatial.motion import spatial_motions
from ..spatial.shapes import surface_shape
from .vtkhdf import Grid


def spatial_results_grid(results: Results, analysis: str, frames: Indices, notes: list[str]) -> Grid:
    """The bodies of an analysis in space at the outputs `frames` (T,): r = R + A (x + Φ p), m, global axes.

    Data as in the plane (`grids.results_grid`): `deflection` A Φ p; `exaggeration`, of which s − 1 times shows
    deformations s times as large while joints stay shut; `body`, its number in the scene.
    """
    bodies, shift = spatial_motions(results, analysis, frames)
    shapes = [surface_shape(results, body, notes) for body in bodies]
    deflections = [shape.deflection(body) for shape, body in zip(shapes, bodies, strict=True)]
    points = [shape.placed(body, carried, 1.0) for shape, body, carried in zip(shapes, bodies, shift, strict=True)]
    exaggerations = [deflection + carried[:, None] for deflection, carried in zip(deflections, shift, strict=True)]
    first = np.cumsum([0, *(len(shape.points) for shape in shapes[:-1])])
    numbers = [body["name"] for body in results.scene["body"]]
    return Grid(
        cells=[shape.cells + start for shape, start in zip(shapes, first, strict=True)],
        points=np.concatenate(points, axis=1),
        time=results.time(analysis)[frames],
        point_data={
            "deflection": np.concatenate(deflections, axis=1),
            "exaggeration": np.concatenate(exaggerations, axis=1),
        },
        cell_data={
            "body": np.concatenate(
                [np.full(len(shape.cells), numbers.index(b.name)) for shape, b in zip(shapes, bodies, strict=True)]
            )
        },
    )
