"""How far a path is from a joint on the ground, and how far the undeformed links reach from there."""

from collections.abc import Iterator

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ..fields.field_types import split_point
from ..model.model import Model
from ..scene.space import SPACES

TURNING = ("revolute", "universal", "spherical", "weld")
CHECKS = 1001  # times of a path
BEYOND = 1e-6  # of the reach: less is round-off


def out_of_reach(model: Model, times: Array) -> str:
    """A message on the first path beyond the reach of the links at one of `times` (T,), s; else ""."""
    return next((f'trajectory "{name}" {how}' for name, how in _beyond(model, times)), "")


def check_reach(model: Model, end: float) -> None:
    """Raise `InputError` for a path that leads beyond the reach of the undeformed links before `end` (s)."""
    for name, how in _beyond(model, np.linspace(0.0, end, CHECKS)):
        raise InputError(f'{model.scene.path}: trajectory "{name}": expected a target within reach', f"one that {how}")


def _beyond(model: Model, times: Array) -> Iterator[tuple[str, str]]:
    """Each path that leads beyond the reach of the links at some of `times` (T,): its name, and how far."""
    axes = SPACES[model.scene.space].translations
    for path in model.scene.trajectory:
        places = {axis: path.components[axis] for axis in "xyz" if path.point is not None and axis in path.components}
        chain = _chain(model, str(path.point)) if places else None
        if chain is None:
            continue
        joint, at, reach = chain
        away = [function.sample(times)[0] - at["xyz".index(axis)] for axis, function in places.items()]
        distance = np.sqrt(np.sum(np.square(away), axis=0))
        beyond = np.flatnonzero(distance > (1 + BEYOND) * reach)
        if beyond.size:
            first, along = distance[beyond[0]], "" if len(places) == len(axes) else f" along {' and '.join(places)}"
            unit = ': are these m? (mm are written "750*mm")' if first > 10 * reach else ""
            yield (
                path.name,
                f'is {first:.4g} m{along} from joint "{joint}" on the ground at t = {times[beyond[0]]:.6g} s, from'
                f" which the links reach {reach:.4g} m{unit}",
            )


def _chain(model: Model, point: str) -> tuple[str, Array, float] | None:
    """The joint on the ground behind which a point is, its place (3,), m, and the most that links reach from there.

    By the undeformed links that carry the point ("BODY.POINT"); None where a way between them is open.
    """
    tree, reach = model.tree, 0.0
    body, label = split_point(point)
    number = tree.index[body]
    while True:
        node = tree.nodes[number]
        if node.joint.type not in TURNING or not node.outer.point:
            return None
        reach += float(np.linalg.norm(node.body.points[label].position - node.body.points[node.outer.point].position))
        if node.inner.body < 0:
            return node.joint.name, np.array(node.inner.position), reach
        if not node.inner.point:
            return None
        number, label = node.inner.body, node.inner.point
