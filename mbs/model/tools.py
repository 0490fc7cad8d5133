"""Frames of tools: points of a body that stand beside a section, and turn with it, in axes of their own."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from ...common.arrays import Array
from ...common.rotations import about, of_rpy, skew
from ..fields.field_types import split_point
from ..scene.bodies import Tool
from .body import Body


def orientation(tool: Tool) -> Array:
    """(3, 3) its axes, columns, in those of the body."""
    return about(2, tool.angle) @ of_rpy(*tool.rpy)


def with_tool(body: Body, tool: Tool) -> Body:
    """The body with one more point, d from a section that bending turns by φ = Φ_r p: it moves by Φp + φ × d.

    With geometric stiffening also by ½ φ × (φ × d): see `Stiffening.with_tool`.
    """
    point = split_point(tool.point)[1]
    at, d = body.points[point], np.array(tool.at)
    translation = at.translation - skew(d) @ at.rotation
    placed = replace(at, position=at.position + d, translation=translation, triad=orientation(tool))
    stiffening = body.stiffening
    if stiffening is not None and point in stiffening.K_points:
        stiffening = stiffening.with_tool(tool.name, point, at.rotation, d)
    return replace(body, points=MappingProxyType({**body.points, tool.name: placed}), stiffening=stiffening)
