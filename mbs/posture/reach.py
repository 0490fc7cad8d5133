"""What to say where the links do not reach a path: how far it is, how far they reach, and a guess that works."""

from collections.abc import Iterator, Sequence

import numpy as np

from ...common.arrays import Array, Booleans, Indices
from ...common.errors import InputError, quoted
from ...common.toml_files import toml_line
from ..fields.field_types import split_point
from ..model.model import MET, Model
from ..model.nodes import Node
from ..scene.mechanism import MechanismKeys
from ..scene.space import SPACES
from .posture import singular_ratios

TURNING = ("revolute", "universal", "spherical", "weld")
TRIES = 60
REACH_CHECKS = 1001
REGULAR = 1e-3  # ratio of singular values of the rows: less is next to a singular posture
BEYOND = 1e-6  # of the reach: less is round-off


def out_of_reach(model: Model, times: Array) -> str:
    """A message on the first path that leaves the reach of the links, at the first of `times` (T,), s; else ""."""
    return next((f'trajectory "{name}" {how}' for name, how in _beyond(model, times)), "")


def check_reach(model: Model, end: float) -> None:
    """Raise `InputError` for a path that leads beyond the reach of the undeformed links before `end` (s).

    Flexible links would stretch beyond all sense instead of failing.
    """
    for name, how in _beyond(model, np.linspace(0.0, end, REACH_CHECKS)):
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


def posture_from_elsewhere(model: Model, guess: Array) -> Array:
    """A posture (n_q,), rad and m, with undeformed links that meets all rows at t = 0; `guess` (n_q,) leads to none.

    Where a point follows a path and no joint has a guess, zero may be singular: the nearest to zero that works does.
    Raises `InputError` else, with what may help.
    """
    check_reach(model, 0.0)
    scene, constraints, times, (nodes, columns) = model.scene, model.constraints, np.zeros(1), turning_joints(model)
    works: Sequence[Array] = []  # random angles of joints that turn, in whole degrees; other joints stay there
    if columns.size and model.rows:
        postures = regular_postures(model, random_angles(guess, columns, TRIES))
        rounded = np.tile(guess, (len(postures), 1))
        rounded[:, columns] = np.radians(np.round(np.degrees(np.angle(np.exp(1j * postures[:, columns])))))
        works = [q for q in rounded if len(regular_postures(model, q[None]))]
    best = min(works, key=lambda q: float(np.abs(q[columns] - guess[columns]).sum()), default=None)
    follows = any(path.point is not None for path in scene.trajectory)  # a note then says from where
    if best is not None and follows and not scene.initial.named("joints"):
        q = constraints.posture(best, 0.0)
        if q is not None:
            return q
    owners, advice = quoted(dict.fromkeys(row.owner for row in model.rows)), turned_guesses(scene)
    near = constraints.postures(guess[None], times)[0]
    if np.abs(constraints.values(near, times)[0] / model.row_sizes).max() <= MET:
        for owner, is_so in constraints.turned_over(near, times).items():
            if is_so[0]:
                advice.append(f'next to it "{owner}" is turned over: axes that it aligns point against each other')
    if best is not None:
        advice.append(f"from [initial] {as_guess(nodes, best)} it works")
    raise InputError(
        f"{scene.path}: initial.joints: expected a guess near a posture with undeformed links that meets {owners} at"
        " t = 0",
        f"none by Newton's method ({'; '.join(advice) or 'out of reach, or on another branch?'})",
    )


def turning_joints(model: Model) -> tuple[list[Node], Indices]:
    """The joints of the tree that turn, and where their angles are in q."""
    tree, columns = model.tree, list[int]()
    turning = [node for node in tree.nodes if node.joint.name in tree.carried and "rad" in node.joint.units]
    for node in turning:
        are_angles = node.joint.state(np.array([float(unit == "rad") for unit in node.joint.units]))
        columns += (node.q.start + np.flatnonzero(are_angles)).tolist()
    return turning, np.array(columns, dtype=np.intp)


def random_angles(guess: Array, columns: Indices, count: int) -> Array:
    """`count` postures (…, n_q) like `guess` (n_q,), with reproducible random angles, rad, in `columns`."""
    starts = np.tile(guess, (count, 1))
    starts[:, columns] = np.random.default_rng(0).uniform(-np.pi, np.pi, (count, len(columns)))
    return starts


def regular_postures(model: Model, q: Array) -> Array:
    """Postures (…, n_q), rad and m, near q (T, n_q) that satisfy all rows at t = 0 and are regular."""
    postures, is_met = model.constraints.postures(q, np.zeros(len(q)))
    postures = postures[is_met]
    return postures[are_regular(model, postures, np.zeros(len(postures)))]


def are_regular(model: Model, q: Array, times: Array) -> Booleans:
    """(T,) whether joints can follow all rows at `times` (T,), s, in postures q (T, n_q), rad and m."""
    rank = min(len(model.rows), int(model.tree.joint_columns.sum()))
    return np.asarray(singular_ratios(model, q, times, rank) > REGULAR)


def as_guess(nodes: Sequence[Node], q: Array) -> str:
    """The coordinates of joints at q (n_q,), rad or m, as a line of [initial] has them: "joints = { … }"."""
    joints = {}
    for node in nodes:
        numbers = [
            f"{round(np.degrees(value), 4) + 0.0:.6g}*deg" if unit == "rad" else float(f"{value:.6g}")
            for value, unit in zip(node.coordinates(q).tolist(), node.joint.units, strict=True)
        ]
        joints[node.joint.name] = numbers[0] if len(numbers) == 1 else numbers
    return toml_line("joints", joints)


def turned_guesses(scene: MechanismKeys) -> list[str]:
    """Guesses of angles beyond a whole turn, which are degrees as a rule; a text each.

    A trajectory of the joint's own coordinate says in which turn it begins.
    """
    followed = {path.coordinate_of for path in scene.trajectory}
    units = {joint.name: joint.guess_units or joint.units for joint in scene.joint}
    guesses = ((name, np.atleast_1d(np.array(value, dtype=float))) for name, value in scene.initial.joints.items())
    return [
        f'initial.joints: {name} = {angle:g} rad is more than a turn (degrees are written "{angle:g}*deg")'
        for name, values in guesses
        if name not in followed
        for angle, unit in zip(values.tolist(), units.get(name, ()), strict=False)
        if unit == "rad" and abs(angle) > 2 * np.pi
    ]
