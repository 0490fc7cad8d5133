"""The posture that a robot starts from: Newton's method on the constraint equations from the guess of [initial]."""

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from ...common.arrays import Array, Booleans, Indices
from ...common.errors import InputError, quoted
from ...common.rotations import exponential, logarithm
from ...common.toml_files import toml_line
from ..model.known_motion import State, mass_matrices
from ..model.model import MET, Model
from ..model.nodes import Node
from ..model.system import MultibodySystem
from ..scene.bodies import ROUND_OFF, tensor
from ..scene.mechanism import MechanismKeys
from .posture import singular_ratios
from .reach import check_reach

LEAST = 1e-13  # of inertia, relative
SAME = 1e-8  # of the largest rate
AWAY = 0.1  # rad, sizes of the robot, and of the fastest rate: by more than links bend in equilibrium
TRIES = 60
REGULAR = 1e-3  # ratio of singular values of the rows: less is next to a singular posture


def undeformed_posture(model: Model) -> State:
    """The state with p = ṗ = 0 that meets all constraint equations at t = 0, next to guessed coordinates and rates.

    Raises `InputError` where none does.
    """
    tree = model.tree
    guess = _with_slides(model, tree.at_rest(_numbers(model, model.scene.initial.joints, "joints")))
    named, behind = _named(model, "joints"), _behind_known_motors(model)
    if behind.any():
        guess = _with_gears_as_asked(model, State(guess, np.zeros(tree.n_v))).q
    q = model.constraints.posture(guess, 0.0, named | behind) if (named | behind).any() else None
    q = model.constraints.posture(guess, 0.0) if q is None else q
    q = posture_from_elsewhere(model, guess) if q is None else q
    rates, named = _guessed_rates(model), _named(model, "joint_rates") | behind
    asked = _with_gears_as_asked(model, State(q, rates)).v if behind.any() else rates
    v = rates_on_rows(model, q, rates)
    if named.any():
        kept = rates_on_rows(model, q, rates_on_rows(model, q, asked, locked=named))
        v = kept if np.allclose(kept[named], asked[named], atol=SAME * np.abs(asked[named]).max()) else v
    start = State(q, v)
    return _twisted_gears(model, start, relaxed_gears(model, start))


def rates_on_rows(model: Model, q: Array, v: Array, locked: Booleans | None = None) -> Array:
    """Return v (n_v,) that meets constraints at q (n_q,), t = 0, SI, by least changes of joints not `locked` (n_v,)."""
    scales, now = model.joint_sizes if locked is None else np.where(locked, 0.0, model.joint_sizes), np.zeros(1)
    (C_v,) = model.constraints.natural_gradients(q[None], now, scales)
    (C_dot,) = model.constraints.rates(q[None], v[None], now)
    return v - scales * np.linalg.lstsq(C_v, C_dot / model.row_sizes, rcond=1e-10)[0]


def _with_gears_as_asked(model: Model, guess: State) -> State:
    """The guess with motors on their paths, and joints behind them as [initial] has them, else without a twist."""
    alone = replace(model, rows=tuple(row for row in model.rows if row.is_trajectory))
    q = alone.constraints.posture(guess.q, 0.0)
    at = guess if q is None else State(q, rates_on_rows(alone, q, guess.v))
    return _twisted_gears(model, guess, relaxed_gears(model, at))


def _behind_known_motors(model: Model) -> Booleans:
    """(n_v,) of joints behind compliant gears in robots with loops whose paths are those of motors alone."""
    behind, motors = np.zeros(model.tree.n_v, dtype=bool), {gear.motor.v.start for gear in model.tree.gears}
    known = {row.coordinate for row in model.rows if row.is_trajectory}
    if model.loop_rows.any() and known <= motors:
        for gear in model.tree.gears:
            behind[gear.joint.v] = gear.motor.v.start in known
    return behind


def _twisted_gears(model: Model, given: State, relaxed: State) -> State:
    """The relaxed state, with joints behind motors on a path where [initial] has them: their gears are twisted."""
    initial = model.scene.initial
    for gear in model.tree.gears:
        if gear.joint.joint.name in initial.named("joints"):
            relaxed.q[gear.joint.q] = given.q[gear.joint.q]
        if gear.joint.joint.name in initial.named("joint_rates"):
            relaxed.v[gear.joint.v] = given.v[gear.joint.v]
    return relaxed


def check_turning(model: Model) -> None:
    """Raise `InputError` if a joint coordinate has no inertia.

    Point masses and rods have inertia about a joint only if its axis is away from them.
    """
    rigid = ((body.name, tensor(body.rigid.inertia)) for body in model.scene.body if body.rigid is not None)
    slim = [name for name, J in rigid if np.linalg.eigvalsh(J)[0] <= ROUND_OFF * np.abs(J).max()]
    if not slim:
        return
    natural = model.natural_sizes
    M = mass_matrices(MultibodySystem(model), undeformed_posture(model).q[None])[0] * np.outer(natural, natural)
    sizes, least = np.diag(M), LEAST * np.abs(np.trace(M))
    for node in model.tree.nodes:
        if (sizes[node.v] <= least).any():
            raise InputError(
                f"{model.scene.path}: {node.joint.label}: expected inertia about each of its axes",
                f"none: masses that it turns are on an axis, and {quoted(slim)} have a moment of inertia of 0"
                " (rigid.inertia)",
            )
    values = np.linalg.eigvalsh(M / np.sqrt(np.outer(sizes, sizes)))
    if values[0] < LEAST:
        raise InputError(
            f"{model.scene.path}: expected bodies that all joints together turn with some inertia",
            f"none about an axis: {quoted(slim)} have a moment of inertia of 0 (rigid.inertia)",
        )


def _named(model: Model, table: Literal["joints", "joint_rates"]) -> Booleans:
    """(n_v,) of joints with values in [initial], where loops alone constrain and others can close them; else none."""
    named = np.zeros(model.tree.n_v, dtype=bool)
    if model.rows and model.loop_rows.all():
        for node in model.tree.nodes:
            named[node.v] = node.joint.name in model.scene.initial.named(table)
    return named


def displaced_joints(model: Model, start: State, joints: Container[str] | None = None) -> Iterator[str]:
    """Yield a warning where loops do not close with all values of [initial], and joints begin away from these.

    `start` is the undeformed robot; where `joints` are given, only these count.
    """
    if not model.loop_rows.any():
        return
    initial, scales = model.scene.initial, model.joint_sizes
    vectors, given = (_numbers(model, getattr(initial, key), key) for key in ("joints", "joint_rates"))
    guess = State(model.tree.at_rest(vectors), _guessed_rates(model))
    fastest = float(np.abs(guess.v / np.where(scales > 0, scales, np.inf)).max(initial=0.0))
    q, v, nodes = start.q - guess.q, start.v - guess.v, (node for node in model.tree.nodes if node.joint.units)
    off = [(node.joint.name, q[node.q], v[node.v], scales[node.v]) for node in nodes]
    for one, at in zip(model.cut, model.along_cut.motions(start.q[None], start.v[None], np.zeros(1)), strict=True):
        name, size = one.joint.name, np.array(1.0 if one.row.kind == "turn" else model.size)
        off.append((name, at.coordinate - one.guess, at.rate - given.get(name, np.zeros(3))[one.number], size))
    places = model.tree.places(start.q[None], start.v[None])
    for joint in (joint for joint in model.scene.joint if not joint.locates):
        a, b = (places.at(side) for side in model.tree.sides(joint))
        value, rate = (of.get(joint.name, np.zeros(3)) for of in (vectors, given))
        left = logarithm(exponential(-value) @ a.F[0].T @ b.F[0])
        off.append((joint.name, left, b.F[0].T @ (b.omega - a.omega)[0] - rate, np.ones(3)))
    values, rates = initial.named("joints"), initial.named("joint_rates")
    moved = dict.fromkeys(
        name
        for name, ways, changes, sizes in off
        if joints is None or name in joints
        for names, way, most in ((values, ways, sizes), (rates, changes, fastest * sizes))
        if name in names and np.any(np.abs(way) > AWAY * most)
    )
    if moved:
        yield (
            f"joints {quoted(moved)} start away from the values in [initial], with which no posture and rates close the"
            " loops: give values of as many joints as can move independently, and the others follow"
        )


def _with_slides(model: Model, q: Array) -> Array:
    """The guess q (n_q,), in planar scenes with slides that these do not guess where the guessed angles close loops.

    They enter the rows of loops linearly.
    """
    guesses, is_loop = model.scene.initial.joints, model.loop_rows
    slides = [node for node in model.tree.nodes if node.joint.type == "prismatic" and node.joint.name not in guesses]
    if not (slides and model.scene.is_planar and is_loop.any()):
        return q
    values, gradients = model.constraints.values(q[None], np.zeros(1))
    dv, along = np.zeros(model.tree.n_v), [node.v.start for node in slides]
    dv[along] = np.linalg.lstsq(gradients[0, is_loop][:, along], -values[0, is_loop], rcond=1e-10)[0]
    return model.tree.integrate(q, dv)


def relaxed_gears(model: Model, state: State) -> State:
    """`state` with compliant gears untwisted: twist and its rate 0.

    Motors move to their joints; where a trajectory prescribes the motor, its joint moves to it.
    """
    q, v = state.q.copy(), state.v.copy()
    locked = {row.coordinate for row in model.rows if row.kind == "coordinate"}
    for gear in model.tree.gears:
        way, rate = gear.twist(q, v)
        if gear.motor.v.start in locked:
            q[gear.joint.q.start] += gear.sign * way
            v[gear.joint.v.start] += gear.sign * rate
        else:
            q[gear.motor.q.start] -= way
            v[gear.motor.v.start] -= rate
    return State(q, v)


def _numbers(model: Model, table: Mapping[str, object], key: str) -> dict[str, Array]:
    """The lists of numbers of a table by joint. Raises `InputError` for a wrong number of them."""
    joints = {joint.name: joint for joint in (*(node.joint for node in model.tree.nodes), *model.scene.joint)}
    lists = {}
    for name, value in table.items():
        joint = joints[name]
        wanted, numbers = len(joint.guess_units or joint.units), np.atleast_1d(np.array(value, dtype=float))
        if len(numbers) != wanted:
            raise InputError(
                f"{model.scene.path}: initial.{key}.{name}: expected {wanted} numbers of a {joint.type} joint",
                len(numbers),
            )
        lists[name] = numbers
    return lists


def _guessed_rates(model: Model) -> Array:
    v = np.zeros(model.tree.n_v)
    for name, rates in _numbers(model, model.scene.initial.joint_rates, "joint_rates").items():
        number = model.tree.carried.get(name)
        if number is None:
            continue  # where a loop is cut the other joints' rates say all
        node = model.tree.nodes[number]
        if node.backwards and len(node.joint.units) != 1:
            raise InputError(
                f"{model.scene.path}: initial.joint_rates.{name}: expected the side nearer to the ground first in"
                f" between of a {node.joint.type} joint with rates",
                "it second",
            )
        v[node.v] = -rates if node.backwards else node.joint.velocity(rates)
    return v


def posture_from_elsewhere(model: Model, guess: Array) -> Array:
    """A posture (n_q,), rad and m, with undeformed links that meets all constraint equations at t = 0.

    For a `guess` (n_q,), SI, that leads to none: where a point follows a path and [initial] names no joint, the nearest
    of random guesses that leads to one takes its place. Else raises `InputError` with advice.
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
    if best is not None and scene.path_points and not scene.initial.named("joints"):  # a note then says from where
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
    """The k joints of the tree with angles, and the numbers (k,) of these in q."""
    tree, columns = model.tree, list[int]()
    turning = [node for node in tree.nodes if node.joint.name in tree.carried and "rad" in node.joint.units]
    for node in turning:
        are_angles = node.joint.state(np.array([float(unit == "rad") for unit in node.joint.units]))
        columns += (node.q.start + np.flatnonzero(are_angles)).tolist()
    return turning, np.array(columns, dtype=np.intp)


def random_angles(guess: Array, columns: Indices, count: int) -> Array:
    """Postures (`count`, n_q) like `guess` (n_q,), SI units, with reproducible random angles in `columns`."""
    starts = np.tile(guess, (count, 1))
    starts[:, columns] = np.random.default_rng(0).uniform(-np.pi, np.pi, (count, len(columns)))
    return starts


def regular_postures(model: Model, q: Array) -> Array:
    """Regular postures (…, n_q) near q (T, n_q), rad and m, that satisfy all constraint equations at t = 0."""
    postures, is_met = model.constraints.postures(q, np.zeros(len(q)))
    postures = postures[is_met]
    return postures[are_regular(model, postures, np.zeros(len(postures)))]


def are_regular(model: Model, q: Array, times: Array) -> Booleans:
    """(T,) whether postures q (T, n_q), rad and m, are far from singular ones at `times` (T,), s."""
    rank = min(len(model.rows), int(model.tree.joint_columns.sum()))
    return singular_ratios(model, q, times, rank) > REGULAR


def as_guess(nodes: Sequence[Node], q: Array) -> str:
    """The line of [initial] with the coordinates of `nodes` at q (n_q,), rad and m: "joints = { … }"."""
    joints = {}
    for node in nodes:
        numbers = [
            f"{round(np.degrees(value), 4) + 0.0:.6g}*deg" if unit == "rad" else float(f"{value:.6g}")
            for value, unit in zip(node.coordinates(q).tolist(), node.joint.units, strict=True)
        ]
        joints[node.joint.name] = numbers[0] if len(numbers) == 1 else numbers
    return toml_line("joints", joints)


def turned_guesses(scene: MechanismKeys) -> list[str]:
    """A message on each guessed angle of the scene beyond a whole turn: most are degrees.

    Joints whose own coordinate has a trajectory, which says the turn, are left out.
    """
    followed = {path.coordinate_of for path in scene.trajectory}
    units = {joint.name: joint.guess_units or joint.units for joint in scene.joint}
    guesses = ((name, np.atleast_1d(np.array(value, dtype=float))) for name, value in scene.initial.joints.items())
    return [
        f'initial: {name} = {angle:g} rad is more than a turn (degrees are written "{angle:g}*deg")'
        for name, values in guesses
        if name not in followed
        for angle, unit in zip(values.tolist(), units.get(name, ()), strict=False)
        if unit == "rad" and abs(angle) > 2 * np.pi
    ]
