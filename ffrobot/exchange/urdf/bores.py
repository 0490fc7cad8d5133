"""Bores of a part around the joints of its link: where the axis of a joint runs through one, that is its interface."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...common.arrays import Array
from ...common.tables import shown
from ...mesh.checks import METRES
from ...mesh.inspection import PartFace, inspect_part

PARALLEL = 1e-4  # 1 − cosine between the axes of a bore and of its joint
CONCENTRIC = 0.05  # of the radius: how far the joint may be from the axis of the bore
CENTERED = 1e-6  # of the length: how far the center of the bore is from the joint without a remark


@dataclass(frozen=True, eq=False)
class Axis:
    """A joint of the link: its `name`, `point` (3,) m and `direction` (3,) in axes of the link file."""

    name: str
    point: Array
    direction: Array


def bores_at(
    geometry: Mapping[str, Any], part: Path, joints: Mapping[str, Axis], length: float
) -> Iterator[tuple[dict[str, Any], str]]:
    """A table `interface` and a remark for each of `joints`, by the interface's name, that a bore of `part` is around.

    `geometry` says how the part stands in the link's axes. Of several bores the one nearest to the joint is taken.

    Raises:
        InputError: the part cannot be read.
    """
    unit = geometry.get("unit", "m")
    found = inspect_part(part, unit)
    x, y = (np.array(geometry.get(key, default), dtype=float) for key, default in _AXES.items())
    z = np.cross(x, y) / np.linalg.norm(np.cross(x, y))
    x /= np.linalg.norm(x)
    C = np.stack([x, np.cross(z, x), z])
    origin = METRES[unit] * np.array(geometry.get("origin", (0.0, 0.0, 0.0)))
    bores = [(face, C @ (face.center - origin), C @ face.direction) for face in found.faces if face.kind == "bore"]
    for interface, joint in joints.items():
        axis = joint.direction / np.linalg.norm(joint.direction)
        around = [bore for bore in bores if _is_around(*bore, joint.point, axis)]
        if not around:
            continue
        face, center, direction = min(around, key=lambda bore: abs(float((bore[1] - joint.point) @ axis)))
        off = abs(float((center - joint.point) @ axis))
        more = f", whose center is {1000 * off:.4g} mm along the axis from the joint" if off > CENTERED * length else ""
        yield (
            {"name": interface, "position": center.tolist(), "normal": direction.tolist()},
            f'joint "{shown(joint.name)}" is in a bore of radius {1000 * (face.radius or 0.0):.4g} mm{more}',
        )


_AXES = {"x_axis": (1.0, 0.0, 0.0), "y_axis": (0.0, 1.0, 0.0)}


def _is_around(face: PartFace, center: Array, direction: Array, point: Array, axis: Array) -> bool:
    off = point - center
    across = float(np.linalg.norm(off - (off @ direction) * direction))
    return 1 - abs(float(direction @ axis)) < PARALLEL and across < CONCENTRIC * (face.radius or 0.0)
