"""Forces, energies and momentum of trees in 3D, an oracle of the core: `oracle_3d` where a tree has its bodies.

SI units, global axes, states (T, …).
"""

from typing import NamedTuple

import numpy as np
import tree_oracle
from oracle_3d import Mechanism
from rotations import quaternion

from ffrobot.common.arrays import Array
from ffrobot.mbs.model.gears import resistance
from ffrobot.mbs.model.nodes import rotor
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


class Absolute(NamedTuple):
    """One state of a tree in the coordinates of its bodies, with B (N, n_v): v = B v of the tree."""

    q: Array
    v: Array
    B: Array


def mechanism_of(tree, gravity) -> Mechanism:
    return Mechanism([node.body for node in tree.nodes], gravity)


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


def of_bodies(mechanism, tree, q):
    """B (T, N, n_v): by v of the tree, (Ṙ, ω̄, ṗ) of all bodies."""
    B = np.zeros((len(q), mechanism.n_v, tree.n_v))
    for node, frame in zip(tree.nodes, tree_oracle.frames(tree, q), strict=True):
        own = B[:, mechanism.columns(node.body.name)]
        own[:, :3], own[:, 3:6] = frame.L[:, :3], np.swapaxes(frame.F, 1, 2) @ frame.L[:, 3:]
        own[:, 6:, node.p_v] = np.eye(node.body.n_modes)
    return B


def absolute_states(mechanism, state):
    """`Absolute` of each of the states."""
    for k, B in enumerate(of_bodies(mechanism, state.tree, state.q)):
        q = np.zeros(mechanism.n_q)
        for node, frame in zip(state.tree.nodes, state.frames, strict=True):
            R, e, p = mechanism.parts(q, node.body.name)
            R[:], e[:], p[:] = frame.r[k], quaternion(frame.F[k]), state.q[k, node.p_q]
        yield Absolute(q, B @ state.v[k], B)


def absolute_accelerations(mechanism, state) -> Array:
    """V̇ (T, N) of all bodies: B v̇ + Ḃ v."""

    def velocities(q, _):
        return np.einsum("tij,tj->ti", of_bodies(mechanism, state.tree, q), state.v)

    B = of_bodies(mechanism, state.tree, state.q)
    return np.einsum("tij,tj->ti", B, state.a) + tree_oracle.rate(velocities, state.tree, state.q, state.v)


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
    mechanism = mechanism_of(state.tree, model.scene.gravity)
    accelerations = absolute_accelerations(mechanism, state)
    found = resistance(model, state.q, state.v) - given_forces(model, state.q, state.frames, times)
    found += rotor_forces(state.tree, state.q, state.v, state.a) - gear_forces(model.tree, state.q, state.v)
    for k, (at, a) in enumerate(zip(absolute_states(mechanism, state), accelerations, strict=True)):
        found[k] += at.B.T @ (mechanism.mass_matrix(at.q) @ a - mechanism.forces(at.q, at.v))
    for node in state.tree.nodes:
        found[:, node.v] += rotor_mass(node) * state.a[:, node.v]
    return found


class BodyForces(NamedTuple):
    """Force (T, 3), moment about the frame's origin (T, 3) and modal forces (T, n), beside gravity and elasticity."""

    force: Array
    moment: Array
    modal: Array


def body_forces(state: Accelerated, gravity) -> list[BodyForces]:
    """By which each body moves as it does."""
    mechanism = mechanism_of(state.tree, gravity)
    accelerations = absolute_accelerations(mechanism, state)
    needed = np.array([
        mechanism.mass_matrix(at.q) @ a - mechanism.forces(at.q, at.v)
        for at, a in zip(absolute_states(mechanism, state), accelerations, strict=True)
    ])  # fmt: skip
    parts = [needed[:, mechanism.columns(node.body.name)] for node in state.tree.nodes]
    return [
        BodyForces(own[:, :3], np.einsum("tij,tj->ti", frame.F, own[:, 3:6]), own[:, 6:])
        for own, frame in zip(parts, state.frames, strict=True)
    ]


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
    tree, model = motion.model.tree, motion.model
    mechanism = mechanism_of(tree, model.scene.gravity)
    found = [mechanism.energies(at.q, at.v) for at in absolute_states(mechanism, accelerated(motion))]
    kinetic, strain, gravitational = np.array(found).T
    of_gears, dissipated = gear_energy(tree, motion.q, motion.v)
    dissipated += np.sum(motion.v * resistance(model, motion.q, motion.v), axis=1)
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
    mechanism = mechanism_of(tree, np.zeros(3))
    for k, at in enumerate(absolute_states(mechanism, state)):
        of_all = mechanism.mass_matrix(at.q) @ at.v
        for node, frame in zip(tree.nodes, state.frames, strict=True):
            along, about, _ = mechanism.rates(of_all, node.body.name)
            linear[k] += along
            angular[k] += frame.F[k] @ about + np.cross(frame.r[k], along)
    return Momentum(linear, angular)
