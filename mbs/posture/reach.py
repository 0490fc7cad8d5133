"""What to say where the links do not reach a path: how far it is, how far they reach, and a guess that works."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Booleans, Indices, as_floats
from ...common.errors import InputError, quoted
from ...common.toml_files import toml_line
from ..fields.field_types import split_point
from ..model.constraints import MET
from ..model.model import Model
from ..model.nodes import Node
from ..scene.mechanism import MechanismKeys
from ..scene.space import SPACES
from ..scene.trajectories import Trajectory

TURNING = ("revolute", "universal", "spherical", "weld")
TRIES = 60
REACH_CHECKS = 1001
REGULAR = 1e-3  # ratio of singular values of the rows: less is next to a singular posture
BEYOND = 1e-6  # of the reach: less is round-off


class _Chain(NamedTuple):
    """The joint on the ground behind which a point is, its place (3,), m, and the most that links reach from there."""

    joint: str
    at: Array
    reach: float


def out_of_reach(model: Model, times: Array) -> str:
    """Return a message on the first path that leaves the reach of the links, at the first of `times` (T,); else ""."""
    return next((f'trajectory "{name}" {how}' for name, how in _all_beyond(model, times)), "")


def _all_beyond(model: Model, times: Array) -> Iterator[tuple[str, str]]:
    """Each path that leads beyond the reach of the links at some of `times` (T,): its name, and how far."""
    beyond = ((path.name, _beyond(model, path, times)) for path in model.scene.trajectory)
    yield from ((name, how) for name, how in beyond if how)


def check_reach(model: Model, end: float) -> None:
    """Raise `InputError` for a path that leads beyond the reach of the undeformed links before `end` (s).

    Flexible links would stretch beyond all sense instead of failing.
    """
    for name, how in _all_beyond(model, as_floats(np.linspace(0.0, end, REACH_CHECKS))):
        raise InputError(f'{model.scene.path}: trajectory "{name}": expected a target within reach', f"one that {how}")


def _beyond(model: Model, path: Trajectory, times: Array) -> str:
    places = {axis: path.components[axis] for axis in "xyz" if path.point is not None and axis in path.components}
    chain = _chain(model, str(path.point)) if places else None
    if chain is None:
        return ""
    away = [function.sample(times)[0] - chain.at["xyz".index(axis)] for axis, function in places.items()]
    distance = np.sqrt(np.sum(np.square(away), axis=0))
    beyond = np.flatnonzero(distance > (1 + BEYOND) * chain.reach)
    if not beyond.size:
        return ""
    axes = SPACES[model.scene.space].translations
    first, along = distance[beyond[0]], "" if len(places) == len(axes) else f" along {' and '.join(places)}"
    unit = ': are these m? (mm are written "750*mm")' if first > 10 * chain.reach else ""
    return (
        f'is {first:.4g} m{along} from joint "{chain.joint}" on the ground at t ='
        f" {times[beyond[0]]:.6g} s, from which the links reach {chain.reach:.4g} m{unit}"
    )


def _chain(model: Model, point: str) -> _Chain | None:
    """Of a point ("BODY.POINT"), by the undeformed links that carry it; None where a way between them is open."""
    tree, reach = model.tree, 0.0
    body, label = split_point(point)
    number = tree.index[body]
    while True:
        node = tree.nodes[number]
        if node.joint.type not in TURNING or not node.outer.point:
            return None
        reach += float(np.linalg.norm(node.body.points[label].position - node.body.points[node.outer.point].position))
        if node.inner.body < 0:
            return _Chain(node.joint.name, np.array(node.inner.position), reach)
        if not node.inner.point:
            return None
        number, label = node.inner.body, node.inner.point


def posture_from_elsewhere(model: Model, guess: Array) -> Array:
    """Return a posture (n_q,) with undeformed links that meets all rows at t = 0, where `guess` (n_q,) leads to none.

    Where a point follows a path and no joint has a guess, zero may be singular: the nearest to zero that works does.
    Raises `InputError` else, with what may help.
    """
    check_reach(model, 0.0)
    works, scene = working_start(model, guess), model.scene
    follows = any(path.point is not None for path in scene.trajectory)  # a note then says from where
    if works is not None and follows and not scene.initial.named("joints"):
        q = model.constraints.posture(works, 0.0)
        if q is not None:
            return q
    owners, advice = quoted(dict.fromkeys(row.owner for row in model.rows)), turned_guesses(scene)
    advice += _turned_over(model, guess)
    if works is not None:
        advice.append(f"from [initial] {as_guess(turning_joints(model)[0], works)} it works")
    raise InputError(
        f"{scene.path}: initial.joints: expected a guess near a posture with undeformed links that meets {owners} at"
        " t = 0",
        f"none by Newton's method ({'; '.join(advice) or 'out of reach, or on another branch?'})",
    )


def _turned_over(model: Model, guess: Array) -> Iterator[str]:
    """What is turned by π in the posture next to the guess that would meet all rows but for that."""
    times = np.zeros(1)
    q = model.constraints.postures(guess[None], times)[0]
    if np.abs(model.constraints.values(q, times)[0] / model.row_sizes).max() <= MET:
        for owner, is_so in model.constraints.turned_over(q, times).items():
            if is_so[0]:
                yield f'next to it "{owner}" is turned over: axes that it aligns point against each other'


def working_start(model: Model, guess: Array) -> Array | None:
    """Return q (n_q,) in whole degrees from which a regular posture satisfies all rows at t = 0; None if not found.

    Of random coordinates of joints that turn, those nearest to `guess` (n_q,); others stay there.
    """
    columns = turning_joints(model)[1]
    if not columns.size or not model.rows:
        return None
    postures = regular_postures(model, random_angles(guess, columns, TRIES))
    rounded = np.tile(guess, (len(postures), 1))
    rounded[:, columns] = np.radians(np.round(np.degrees(np.angle(np.exp(1j * postures[:, columns])))))
    works = [q for q in rounded if len(regular_postures(model, q[None]))]
    return min(works, key=lambda q: float(np.abs(q[columns] - guess[columns]).sum()), default=None)


def turning_joints(model: Model) -> tuple[list[Node], Indices]:
    """The joints of the tree that turn, and where their angles are in q."""
    tree = model.tree
    turning = [node for node in tree.nodes if node.joint.name in tree.carried and "rad" in node.joint.units]
    return turning, np.array([node.q.start + k for node in turning for k in _angles(node)], dtype=np.intp)


def random_angles(guess: Array, columns: Indices, count: int) -> Array:
    """Return `count` postures (…, n_q) like `guess` (n_q,), with reproducible random angles, rad, in `columns`."""
    starts = np.tile(guess, (count, 1))
    starts[:, columns] = np.random.default_rng(0).uniform(-np.pi, np.pi, (count, len(columns)))
    return starts


def _angles(node: Node) -> list[int]:
    """Which of the joint's entries in q are angles."""
    of_state = node.joint.state(np.array([1.0 if unit == "rad" else 0.0 for unit in node.joint.units]))
    return [int(k) for k in np.flatnonzero(of_state)]


def regular_postures(model: Model, q: Array) -> Array:
    """Return postures (…, n_q) near q (T, n_q) that satisfy all rows at t = 0 and are regular."""
    postures, is_met = model.constraints.postures(q, np.zeros(len(q)))
    postures = postures[is_met]
    return postures[are_regular(model, postures, np.zeros(len(postures)))]


def are_regular(model: Model, q: Array, times: Array) -> Booleans:
    """Return (T,) whether joints can follow all rows at `times` (T,), s, in postures q (T, n_q)."""
    rank = min(len(model.rows), int(model.tree.joint_columns.sum()))
    return np.asarray(model.constraints.ratios(q, times, rank) > REGULAR)


def as_guess(nodes: Sequence[Node], q: Array) -> str:
    """The coordinates of joints at q (n_q,) as a line of [initial] has them: "joints = { … }"."""
    return toml_line("joints", {node.joint.name: _written(node, q) for node in nodes})


def _written(node: Node, q: Array) -> object:
    numbers = [
        f"{round(np.degrees(value), 4) + 0.0:.6g}*deg" if unit == "rad" else float(f"{value:.6g}")
        for value, unit in zip(node.coordinates(q).tolist(), node.joint.units, strict=True)
    ]
    return numbers[0] if len(numbers) == 1 else numbers


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
