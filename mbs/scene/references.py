"""What patches, actuation points and analyses refer to, with full keys."""

from __future__ import annotations

from collections.abc import Iterator

from ..fields.references import Reference
from .actuator_records import ActuationPoints, PztLayout
from .analysis_records import Analysis


def patch_references(layout: PztLayout) -> Iterator[Reference]:
    """The link, and the points of it whose deflections weigh."""
    key = f'pzt "{layout.body}"'
    yield Reference(f"{key}: body", layout.body)
    for point in layout.point_weights or ():
        yield Reference(f"{key}: point_weights", f"{layout.body}.{point}")


def point_references(points: ActuationPoints) -> Iterator[Reference]:
    """The body, and the places on it that are named."""
    key = f'actuation_points "{points.body}"'
    yield Reference(f"{key}: body", points.body)
    for place in (*points.axial, *points.transverse):
        if isinstance(place, str):
            yield Reference(key, f"{points.body}.{place}")


def analysis_references(analysis: Analysis) -> Iterator[Reference]:
    """Bodies, points and joints in the keys of an analysis."""
    key = f'analysis "{analysis.name}"'
    for body in analysis.modal or ():
        yield Reference(f"{key}: modal", body)
    for point in analysis.points or ():
        yield Reference(f"{key}: points", point, needs_marker=True)
    if analysis.placement is not None:
        yield Reference(f"{key}: placement.body", analysis.placement.body)
    for k, sensor in enumerate(analysis.sensor, 1):
        of_sensor = f"{key}: sensor no. {k}"
        if sensor.point is not None:
            yield Reference(of_sensor, sensor.point, needs_marker=True)
        yield from (Reference(of_sensor, body) for body in (sensor.pzt, sensor.modal) if body is not None)
        if sensor.joint is not None:
            yield Reference(f"{of_sensor}: joint", sensor.joint, "joint")
    for k, load in enumerate(analysis.disturbance, 1):
        if load.point is not None:
            yield Reference(f"{key}: disturbance no. {k}: point", load.point, needs_marker=True)
    for k, controller in enumerate(analysis.controller, 1):
        for body in getattr(controller, "bodies", ()):
            yield Reference(f"{key}: controller no. {k}: bodies", body)
        for joint in getattr(controller, "joints", ()):
            yield Reference(f"{key}: controller no. {k}", joint, "joint")
    if analysis.tip is not None:
        yield Reference(f"{key}: tip", analysis.tip, needs_marker=True)
