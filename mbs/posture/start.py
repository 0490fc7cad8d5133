"""The posture that a robot starts from: the guess of joint coordinates, then Newton on the rows."""

from collections.abc import Container, Iterator, Mapping
from dataclasses import replace
from typing import Literal

import numpy as np

from ...common.arrays import Array, Booleans
from ...common.errors import InputError, quoted
from ..model.known_motion import State, mass_matrices
from ..model.model import Model
from ..scene.bodies import ROUND_OFF, tensor
from .reach import posture_from_elsewhere

LEAST = 1e-13  # of inertia, relative
SAME = 1e-8  # of the largest rate
AWAY = 0.1  # rad, sizes of the robot, and of the fastest rate: by more than links bend in equilibrium


def undeformed_posture(model: Model) -> State:
    """The state with p = ṗ = 0 that meets all rows at t = 0, next to the guessed coordinates and rates.

    Raises `InputError` where none does: see `posture_from_elsewhere`.
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
    """Return v (n_v,) moved onto Ċ = 0 at q (n_q,) and t = 0 by the least change of joints not `locked` (n_v,)."""
    scales, now = model.joint_sizes if locked is None else np.where(locked, 0.0, model.joint_sizes), np.zeros(1)
    (C_v,), (C_dot,) = model.constraints.values(q[None], now)[1], model.constraints.rates(q[None], v[None], now)
    sizes = model.row_sizes
    moved: Array = v - scales * np.linalg.lstsq(C_v * scales / sizes[:, None], C_dot / sizes, rcond=1e-10)[0]
    return moved


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
    M = mass_matrices(model, undeformed_posture(model).q[None])[0] * np.outer(natural, natural)
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
    """A warning where loops cannot be closed with all values of [initial], and joints, or any of `joints`, move.

    `start` is the undeformed robot.
    """
    if not model.loop_rows.any():
        return
    initial, scales = model.scene.initial, model.joint_sizes
    guess, moved = State(model.tree.at_rest(_numbers(model, initial.joints, "joints")), _guessed_rates(model)), []
    fastest = float(np.abs(guess.v / np.where(scales > 0, scales, np.inf)).max(initial=0.0))
    for node in (node for node in model.tree.nodes if node.joint.units):
        if joints is not None and node.joint.name not in joints:
            continue
        ways, rates = np.abs(start.q - guess.q)[node.q], np.abs(start.v - guess.v)[node.v]
        name, most = node.joint.name, AWAY * scales[node.v]
        is_elsewhere = name in initial.named("joints") and np.any(ways > most)
        if is_elsewhere or (name in initial.named("joint_rates") and np.any(rates > fastest * most)):
            moved.append(name)
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
    """The state with motors where their gears are not strained; joints where motors follow a trajectory."""
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
