"""Mode shapes in space: the surface of every link, coarse enough for a page, with its modes as 16-bit numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...common.arrays import Array, Integers
from ...fe_models.modal_body import ModalBody
from ..body_surface import AMPLITUDE, body_surface, drawn_mode
from ..coarse_surface import coarsened, triangles_of
from ..projection import UP, VIEWER
from .charts import encoded
from .modes import LinkModes

MAX_TRIANGLES = 8000  # of a link
MODES = 12  # of a link at most: each costs 6 bytes a point
FINEST = 32767  # a displacement of 1


def modes_3d(links: Sequence[LinkModes]) -> dict[str, Any]:
    """What the script of the page draws; links whose surface is not known are left out."""
    surfaces = [(link, body_surface(link.body)) for link in links]
    entries = [
        _entry(link, mesh.points, triangles_of(mesh.cells), mesh.mode_shapes)
        for link, mesh in surfaces
        if mesh.cells.shape[1] > 2
    ]
    return {"links": entries, "up": UP.tolist(), "viewer": VIEWER.tolist()}


def _entry(link: LinkModes, points: Array, triangles: Integers, shapes: Array) -> dict[str, Any]:
    """Points (p, 3) in m, triangles (t, 3), and modes (m, p, 3) of which the largest displacement is 1."""
    body, (kept, triangles) = link.body, coarsened(points, triangles, MAX_TRIANGLES)
    count = min(body.mode_count, MODES)
    # Scaled on all points, so that a mode does not depend on which of them are kept.
    modes = [drawn_mode(shapes[:, :, k], 1.0).displacement[kept] / AMPLITUDE for k in range(count)]
    return {
        "label": ", ".join(link.labels),
        "points": encoded(points[kept]),
        "triangles": encoded(triangles, "i4"),
        "modes": encoded(np.round(FINEST * np.array(modes)), "i2"),
        "names": [_name(body, k) for k in range(count)],
        "amplitude": AMPLITUDE * body.length / FINEST,
    }


def _name(body: ModalBody, k: int) -> str:
    return f"{k + 1}: {body.frequency[k]:.5g} Hz, {body.family[k]}"
