"""Forces, energies and momentum of trees in 3D, and what is left of constraint equations: an oracle of the core.

Bodies as `oracle_3d` has them, where a tree has them, by Kane's equations. SI units, global axes, states (T, …).
"""

from typing import NamedTuple

import numpy as np
import tree_oracle
from oracle_3d import body_mass_matrix, energies_of_body, forces_on_body
from tree_oracle import row_values, target_rates

from ffrobot.common.arrays import Array
from ffrobot.mbs.model.gears import resistance
from ffrobot.mbs.model.nodes import rotor
from ffrobot.mbs.quantities.motion import constraint_rows
from ffrobot.mbs.quantities.supply import Energies, Momentum, behind_gears


class Accelerated(NamedTuple):
    """States q (T, n_q), v and a (T, n_v) of a tree, with the motion of its frames."""

    tree: object
    q: Array
    v: Array
    a: Array
    frames: object


def accelerated(motion) -> Accelerated:
    return Accelerated(motion.model.tree, motion.q, motion.v, motion.a, tree_oracle.frames(motion.model.tree, motion.q))


class Rotor(NamedTuple):
    """Of a revolute joint: inertia J in kg·m², the triad along whose z it spins, and its spin by v (T, n_v)."""

    inertia: float
    at: tree_oracle.Motion
    by_v: Array


def rotors(tree, q):
    """Those in revolute joints; a rotor on a, behind a gear of ratio N, spins by N Ω_b − (N − 1) Ω_a."""
    frames = tree_oracle.frames(tree, q)
    for node in tree.nodes:
        inertia, N = rotor(node)
        if inertia and node.joint.type != "prismatic":
            sides = (node.outer, node.inner) if node.backwards else (node.inner, node.outer)
            a, b = (tree_oracle.motion(tree, section, q, frames) for section in sides)
            yield Rotor(inertia, a, by_rates(a.F[:, :, 2], N * b.L[:, 3:] - (N - 1) * a.L[:, 3:]))


def by_rates(vectors, L):
    """Work (T, n_v) of vectors (T, 3) on what L (T, 3, n_v) says."""
    return np.einsum("ti,tij->tj", vectors, L)


def rotor_forces(tree, q, v, a):
    """Forces along v (T, n_v) that these rotors take besides: J spin along z of a, which turns with Ω_a."""

    def spins(q, _):
        return np.array([np.sum(of.by_v * v, axis=1) for of in rotors(tree, q)])

    found = np.zeros_like(v)
    for of, spin, slope in zip(rotors(tree, q), spins(q, 0.0), tree_oracle.rate(spins, tree, q, v), strict=True):
        turning = np.cross(np.einsum("tij,tj->ti", of.at.L[:, 3:], v), of.at.F[:, :, 2])
        acceleration = np.sum(of.by_v * a, axis=1) + slope
        found += of.inertia * (acceleration[:, None] * of.by_v + by_rates(spin[:, None] * turning, of.at.L[:, 3:]))
    return found


def maps(tree, q):
    """Of each body B (T, 6 + n, n_v): by v of the tree, (Ṙ, ω̄, ṗ)."""
    found = []
    for node, frame in zip(tree.nodes, tree_oracle.frames(tree, q), strict=True):
        of_modes = np.zeros((len(q), node.body.n_modes, tree.n_v))
        of_modes[:, :, node.p_v] = np.eye(node.body.n_modes)
        found.append(np.concatenate([frame.L[:, :3], frame.F.swapaxes(1, 2) @ frame.L[:, 3:], of_modes], axis=1))
    return found


def rates(tree, q, v):
    """B v (T, 6 + n) of each body."""
    return [np.einsum("tij,tj->ti", B, v) for B in maps(tree, q)]


def accelerations_of_bodies(state):
    """(R̈, ω̄̇, p̈) (T, 6 + n) of each body: B v̇ + Ḃ v."""
    tree, sizes = state.tree, [6 + node.body.n_modes for node in state.tree.nodes]
    slopes = tree_oracle.rate(lambda q, _: np.hstack(rates(tree, q, state.v)), tree, state.q, state.v)
    of_each = np.split(slopes, np.cumsum(sizes)[:-1], axis=1)
    return [x + slope for x, slope in zip(rates(tree, state.q, state.a), of_each, strict=True)]


def required_by_bodies(state, gravity):
    """M v̇ − Q (T, 6 + n) of each body by itself."""
    found, moving = [], rates(state.tree, state.q, state.v)
    of_all = zip(state.tree.nodes, state.frames, moving, accelerations_of_bodies(state), strict=True)
    for node, frame, *of_body in of_all:
        states = zip(frame.F, state.q[:, node.p_q], *of_body, strict=True)
        found.append([
            body_mass_matrix(node.body, A, p) @ a - forces_on_body(node.body, A, p, v, gravity) for A, p, v, a in states
        ])  # fmt: skip
    return [np.array(one) for one in found]


def gear_forces(tree, q, v):
    """Of compliant gears (T, n_v): k(δ) + c δ̇ on the second side of the joint, the opposite on the motor."""
    found = np.zeros_like(v)
    for gear in tree.gears:
        way, rate = gear.twist(q, v)
        moment = gear.spring.moment(way) + gear.damping * rate
        found[:, gear.motor.v.start] -= moment
        found[:, gear.joint.v.start] += gear.sign * moment
    return found


def required_forces(model, state, times):
    """M v̇ − Q (T, n_v) along v: what gravity, elasticity, friction and given loads leave for others to supply."""
    tree, q, v = state.tree, state.q, state.v
    found = resistance(model, q, v) - given_forces(model, q, state.frames, times)
    found += rotor_forces(tree, q, v, state.a) - gear_forces(tree, q, v)
    for B, needed in zip(maps(tree, q), required_by_bodies(state, np.array(model.scene.gravity)), strict=True):
        found += np.einsum("tij,ti->tj", B, needed)
    for node in tree.nodes:
        found[:, node.v] += rotor_mass(node) * state.a[:, node.v]
    return found


def body_forces(state: Accelerated, gravity) -> list[Array]:
    """By which each body moves as it does, beside gravity and elasticity.

    (T, 6 + n): force, moment about the frame's origin, in global axes, and modal forces.
    """
    found = required_by_bodies(state, np.array(gravity))
    for own, frame in zip(found, state.frames, strict=True):
        own[:, 3:6] = np.einsum("tij,tj->ti", frame.F, own[:, 3:6])
    return found


def given_forces(model, q: Array, frames, times: Array) -> Array:
    """Generalized forces (T, n_v) of all given loads at q (T, n_q) and `times` (T,)."""
    tree, found = model.tree, cut_loads(model, q, times)
    for direction, size in model.modal_loads:
        found += size.sample(times)[0][:, None] * direction
    for load in model.scene.load:
        values = {name: function.sample(times)[0] for name, function in load.components.items()}
        if load.point is not None:
            L = tree_oracle.motion(tree, tree.section(load.point, np.eye(3)), q, frames).L
            none = np.zeros(len(times))
            wrench = np.stack([values.get(name, none) for name in ("x", "y", "z", "mx", "my", "mz")], axis=1)
            found += np.einsum("tij,ti->tj", L, wrench)
        elif load.joint in tree.carried:
            found += np.stack([*values.values()], axis=1) @ model.along(load.joint)
    return found


def along_cut(one, times):
    """The sum of loads (T,) along the coordinate of a cut joint, N·m or N."""
    return sum((load.sample(times)[0] for load in one.loads), np.zeros(len(times)))


def cut_loads(model, q, times) -> Array:
    """Generalized forces (T, n_v) of given loads along cut joints at `times` (T,)."""
    found = np.zeros((len(q), model.tree.n_v))
    if model.cut:
        gradients = tree_oracle.cut_coordinates(model, q)[1]
        for k, one in enumerate(model.cut):
            found += along_cut(one, times)[:, None] * gradients[:, k]
    return found


def rotor_mass(node) -> float:
    """J N² in kg of the rotor in a prismatic joint, 0 without one; that the side it sits on turns is left out."""
    inertia, ratio = rotor(node)
    return inertia * ratio**2 if node.joint.type == "prismatic" else 0.0


def gear_energy(tree, q: Array, v: Array) -> tuple[Array, Array]:
    """½ k δ² (T,) J of all compliant gears, and c δ̇² (T,) W that they dissipate."""
    strain, dissipated = np.zeros((2, len(q)))
    for gear in tree.gears:
        way, rate = gear.twist(q, v)
        (k,) = gear.spring.slopes
        strain += 0.5 * k * way**2
        dissipated += gear.damping * rate**2
    return strain, dissipated


def energies(motion) -> Energies:
    """Of all bodies and rotors; compliant gears store ½ k δ², and their motors turn as they have to."""
    motion = behind_gears(motion)
    tree, state, g = motion.model.tree, accelerated(motion), np.array(motion.model.scene.gravity)
    found = np.zeros((3, len(motion.time)))
    for node, frame, v in zip(tree.nodes, state.frames, rates(tree, state.q, state.v), strict=True):
        states = zip(frame.r, frame.F, state.q[:, node.p_q], v, strict=True)
        found += np.transpose([energies_of_body(node.body, *one, g) for one in states])
    kinetic, strain, gravitational = found
    of_gears, dissipated = gear_energy(tree, motion.q, motion.v)
    dissipated += np.sum(motion.v * resistance(motion.model, motion.q, motion.v), axis=1)
    for of in rotors(tree, motion.q):
        kinetic += 0.5 * of.inertia * np.sum(of.by_v * motion.v, axis=1) ** 2
    for node in tree.nodes:
        p_dot = motion.v[:, node.p_v]
        dissipated += np.einsum("ti,ij,tj->t", p_dot, node.body.damping, p_dot)
        kinetic += 0.5 * rotor_mass(node) * np.sum(motion.v[:, node.v] ** 2, axis=1)
    return Energies(kinetic, strain + of_gears, gravitational, dissipated)


def momentum(motion) -> Momentum:
    """Of all bodies and rotors, about the global origin."""
    motion = behind_gears(motion)
    tree, state, (linear, angular) = motion.model.tree, accelerated(motion), np.zeros((2, len(motion.time), 3))
    for of in rotors(tree, motion.q):
        angular += of.inertia * np.sum(of.by_v * motion.v, axis=1)[:, None] * of.at.F[:, :, 2]
    for node, frame, v in zip(tree.nodes, state.frames, rates(tree, state.q, state.v), strict=True):
        states = zip(frame.F, state.q[:, node.p_q], v, strict=True)
        own = np.array([body_mass_matrix(node.body, A, p) @ of_body for A, p, of_body in states])
        linear += own[:, :3]
        angular += np.einsum("tij,tj->ti", frame.F, own[:, 3:6]) + np.cross(frame.r, own[:, :3])
    return Momentum(linear, angular)


def residuals(motion):
    """M v̇ − Q + C_vᵀλ, and C̈ less what targets ask for, the largest, both relative to their largest terms."""
    state, at = accelerated(motion), motion.time
    needed, at_rest = (required_forces(motion.model, state._replace(a=a), at) for a in (state.a, 0 * state.a))
    of_rows = np.einsum("tji,tj->ti", constraint_rows(motion)[1], motion.multipliers)
    forces = max(np.abs(x).max(initial=0.0) for x in (needed - at_rest, at_rest, of_rows))
    accelerations = max(np.abs(state.a).max(), np.abs(state.v).max() ** 2, 1.0)
    left = row_accelerations(motion.model, state, at)
    return np.abs(needed + of_rows).max() / forces, np.abs(left).max(initial=0.0) / accelerations


def row_accelerations(model, state, times):
    """C̈ (T, rows) at `times` (T,), less what their targets ask for: 0 where the motion keeps to the constraints."""

    def rates(q, t):
        C_v = row_values(model, q, times + t)[1]
        return np.einsum("tij,tj->ti", C_v, state.v) - target_rates(model, q, times + t)

    slopes = tree_oracle.rate(rates, state.tree, state.q, state.v)
    return np.einsum("tij,tj->ti", row_values(model, state.q, times)[1], state.a) + slopes


class Motor(NamedTuple):
    """Along `sign` v[coordinate]; on frames in place of sections where it `turns_frames`."""

    coordinate: int
    sign: float
    turns_frames: bool


def unmet(model, found, motors):
    """Forces (T, n_v) that motors and loops leave of `found.required`, by its τ and multipliers of loops."""
    C_v, frames = row_values(model, found.q, np.zeros(len(found.q)))[1], tree_oracle.frames(model.tree, found.q)
    left = found.required + np.einsum("tij,ti->tj", C_v[:, model.loop_rows], found.loops)
    for k, motor in enumerate(motors):
        left[:, motor.coordinate] -= motor.sign * found.tau[:, k]
        if motor.turns_frames:
            node = next(node for node in model.tree.nodes if node.v.start == motor.coordinate)
            axis = tree_oracle.motion(model.tree, node.inner, found.q, frames).F[:, :, 2]
            for section, side in ((node.outer, 1.0), (node.inner, -1.0)):
                if section.body >= 0:
                    turned = tree_oracle.motion(model.tree, section, found.q, frames).L - frames[section.body].L
                    left += np.einsum("ti,tij->tj", side * motor.sign * found.tau[:, k, None] * axis, turned[:, 3:])
    return left
