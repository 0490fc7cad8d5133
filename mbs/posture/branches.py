"""The postures in which a robot can start: that of the scene, and others in which the links reach the same places.

Names of these have a word for a joint each, which is right or wrong in any posture:

    up, down           the joint is above or below the line between the joints (or the tool) next to it
    right, left        a positive turn raises the end of the arm along the axis of the joint before, or lowers it
    noflip, flip       a positive turn, of less than π, leads the axis of the joint before to that of the joint after
                       (but for their inclination), or a negative one: the arm is singular in between
    positive, negative the sign of the coordinate within ±π

Right and left are those of C. S. G. Lee and M. Ziegler, Geometric approach in solving inverse kinematics of PUMA
robots, IEEE Transactions on Aerospace and Electronic Systems 20 (1984) 695–706.
"""

from collections.abc import Mapping
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError
from ...common.toml_files import toml_line
from ..model.model import Model
from ..model.nodes import Node, Section
from ..scene.mechanism import Word
from ..scene.space import SPACES
from .posture import mobility
from .start import as_guess, random_angles, regular_postures, turning_joints, undeformed_posture

TRIES = 600  # random postures from which Newton looks for others
SAME = 1e-6  # rad: angles that differ by less


class StartPosture(NamedTuple):
    """Posture `q` (n_q,), rad and m, in which a robot can start, with the guess that selects it.

    `guess` is the line for the scene's table [initial], `guesses` its coordinates by joint, rad and m; `away`, rad, is
    the largest angle to the scene's start; `branch` has words such as "up" by joint (see `branch_names`).
    """

    q: Array
    guess: str
    guesses: dict[str, tuple[float, ...]]
    away: float
    branch: dict[str, Word]


def start_postures(model: Model) -> list[StartPosture]:
    """Return the start posture of the scene, then all others found, nearest first.

    Others are sought where constraint equations determine every joint at t = 0; their angles are within ±π. Of
    postures on one branch only the nearest, which `chosen_start` takes, keeps its `branch`; the others have {}.
    Raises `InputError` where the scene has no start.
    """
    start = undeformed_posture(model).q
    columns = turning_joints(model)[1]
    starts = [_posture(model, start, start)]
    state = mobility(model, start)
    if not columns.size or not model.rows or state.followed < state.freedom:
        return starts
    others = regular_postures(model, random_angles(start, columns, TRIES))
    for q in others:
        if all(_turn(q, one.q, columns) > SAME for one in starts):
            q[columns] = np.angle(np.exp(1j * q[columns]))
            starts.append(_posture(model, q, start))
    starts.sort(key=lambda one: one.away)
    names = [one.branch for one in starts]
    return [one if one.branch not in names[:k] else one._replace(branch={}) for k, one in enumerate(starts)]


def _posture(model: Model, q: Array, start: Array) -> StartPosture:
    nodes, columns = turning_joints(model)
    guesses = {node.joint.name: tuple(node.coordinates(q).tolist()) for node in nodes}
    away = _turn(q, start, columns) if columns.size else 0.0
    return StartPosture(q, as_guess(nodes, q), guesses, away, branch_names(model, q))


def chosen_start(model: Model) -> StartPosture | None:
    """The start posture on the scene's `initial.branch` nearest to the guess; None without this key.

    Raises `InputError` if no start is on it.
    """
    wanted = model.scene.initial.branch
    if not wanted:
        return None
    starts, tree = start_postures(model), model.tree
    if cut := [joint for joint in wanted if joint not in tree.carried]:
        raise InputError(
            f"{model.scene.path}: initial.branch: expected joints of the tree", f'"{cut[0]}", which is cut'
        )
    for one in starts:
        if all(is_so(model, one.q, tree.nodes[tree.carried[joint]], word) for joint, word in wanted.items()):
            return one
    raise InputError(
        f"{model.scene.path}: initial.branch: expected one of the {len(starts)} postures that were found",
        f"{in_words(wanted)}, which none of them is: see ffrobot pose without this key",
    )


def _turn(q: Array, other: Array, columns: Indices) -> float:
    """The largest difference of angles without whole turns, rad."""
    return float(np.abs(np.angle(np.exp(1j * (q[columns] - other[columns])))).max())


NEAR = 1e-9  # of the size of the robot: joints at one place
MEETING = 1e-6  # of the size of the robot: axes that miss each other by less meet, and rad: that are parallel


def branch_names(model: Model, q: Array) -> dict[str, Word]:
    """The branch at q (n_q,), rad and m: "right" or "left" shoulder, "up" or "down" elbow, "flip" or "noflip" wrist.

    By joint of the tool's arm. The wrist is the fifth of six turning joints. An arm whose first axis is not parallel to
    the next two has a shoulder and an elbow, one whose first two are parallel an elbow.
    """
    joints = _turning(model)
    axes = _lines(model, q, joints)[1]
    parallel = [float(np.linalg.norm(np.cross(a, b))) < MEETING for a, b in pairwise(axes)]
    words: dict[str, Word] = {}
    if len(joints) >= 3 and parallel[:2] == [False, True]:
        words[joints[1].joint.name] = "right" if _raises(model, q, joints[1]) else "left"
        words[joints[2].joint.name] = "up" if _above(model, q, joints[2]) else "down"
    elif len(joints) >= 2 and parallel[0]:
        words[joints[1].joint.name] = "up" if _above(model, q, joints[1]) else "down"
    if len(joints) == 6:
        words[joints[4].joint.name] = "flip" if _flips(model, q, joints[4]) else "noflip"
    return words


def in_words(branch: Mapping[str, Word]) -> str:
    """The line of [initial] for a branch: `branch = { elbow = "up" }`."""
    return toml_line("branch", branch)


def is_so(model: Model, q: Array, node: Node, word: Word) -> bool:
    """Whether `word`, such as "up" or "flip", describes the joint of `node` in the posture q (n_q,), rad and m."""
    if word in ("positive", "negative"):
        return (_angle(q, node) >= 0.0) == (word == "positive")
    tell = _above if word in ("up", "down") else _raises if word in ("right", "left") else _flips
    return tell(model, q, node) == (word in ("up", "right", "flip"))


def _angle(q: Array, node: Node) -> float:
    """The first coordinate of a joint as the scene counts it, within ±π."""
    return float(np.angle(np.exp(1j * node.coordinates(q)[0])))


def _turning(model: Model) -> list[Node]:
    """Joints with one angle from the ground to the body of the tool: that of the last path of a point, or the last.

    Without those that a path of their own prescribes, as one does of a gripper.
    """
    tree, chain, point = model.tree, list[Node](), model.scene.tool_point
    prescribed = {path.coordinate_of for path in model.scene.trajectory}
    number = len(tree.nodes) - 1 if point is None else tree.index[point.partition(".")[0]]
    while number >= 0:
        node = tree.nodes[number]
        chain += [node] if node.joint.units == ("rad",) and node.joint.name not in prescribed else []
        number = node.inner.body
    return chain[::-1]


def _lines(model: Model, q: Array, joints: list[Node]) -> tuple[Array, Array]:
    """Places (k, 3) of joints and directions (k, 3) of their positive turns, global axes."""
    places = model.tree.places(q[None])
    poses = [places.at(node.inner) for node in joints]
    axes = [node.sign * pose.F[0, :, 2] for node, pose in zip(joints, poses, strict=True)]
    return np.reshape([pose.r[0] for pose in poses], (-1, 3)), np.reshape(axes, (-1, 3))


def _raises(model: Model, q: Array, node: Node) -> bool:
    """Whether a positive turn of a joint moves the end of the arm along the axis of the turning joint before it."""
    joints = _turning(model)
    k = joints.index(node) if node in joints else 0
    if k == 0:
        return False
    places, axes = _lines(model, q, joints)
    end, point = places[-1], model.scene.tool_point
    if len(places) > k + 2:
        end = places[k + 2]
    elif point is not None:
        end = model.tree.places(q[None]).at(model.tree.section(point)).r[0]
    if len(places) == 6:  # of a spherical wrist where its axes meet
        P = np.eye(3) - np.einsum("ki,kj->kij", axes[3:], axes[3:])
        meeting = np.linalg.lstsq(P.reshape(9, 3), np.einsum("kij,kj->ki", P, places[3:]).ravel(), rcond=None)[0]
        if np.abs(np.einsum("kij,kj->ki", P, meeting - places[3:])).max() < MEETING * model.size:
            end = meeting
    return bool(axes[k - 1] @ np.cross(axes[k], end - places[k]) > 0.0)


def _flips(model: Model, q: Array, node: Node) -> bool:
    """Whether the axis after a joint is on the negative side of the axis before it, about its own."""
    joints = _turning(model)
    k = joints.index(node) if node in joints else 0
    if not 0 < k < len(joints) - 1:
        return _angle(q, node) < 0.0
    axes = _lines(model, q, joints)[1]
    return bool(axes[k] @ np.cross(axes[k - 1], axes[k + 1]) < 0.0)


def _above(model: Model, q: Array, node: Node) -> bool:
    """Whether a joint is above the line from the joint before to the one after it, or to the tool, against gravity."""
    tree, places, near = model.tree, model.tree.places(q[None]), NEAR * model.size

    def place(section: Section) -> Array:
        return places.at(section).r[0]

    own, before, after = place(node.inner), node, node
    while before.inner.body >= 0 and np.allclose(place(before.inner), own, atol=near):
        before = tree.nodes[before.inner.body]
    start, end = place(before.inner), own
    while np.allclose(end, own, atol=near):
        number = tree.index[after.body.name]
        outer = next((other for other in tree.nodes if other.inner.body == number), None)
        if outer is None:
            cut = (side for joint in tree.loops for side in joint.between if side.partition(".")[0] == after.body.name)
            point = next(cut, model.scene.tool_point)
            end = end if point is None else place(tree.section(point))
            break
        after, end = outer, place(outer.inner)
    chord, offset, down = end - start, own - start, np.zeros(3)
    down[: len(model.scene.gravity)] = model.scene.gravity
    if not down.any():
        down[1 if SPACES[model.scene.space].is_plane else 2] = -1.0
    across = offset - chord * (offset @ chord) / max(float(chord @ chord), near**2)
    return bool(across @ down < 0.0)
