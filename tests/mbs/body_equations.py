"""Forces, energies and momentum of trees in 3D by the equations of each body (Kane): an oracle of the core.

Each body by its own equations of (R, θ, p) (Shabana, Dynamics of Multibody Systems, ch. 5), put together by the
Jacobians of its frame. SI units, global axes, states (T, …).
"""

from typing import NamedTuple

import numpy as np
from affine_fields import affine_motions, first_moment
from tree_accelerations import Accelerated

from ffrobot.common.arrays import Array
from ffrobot.mbs.model.cut import measured
from ffrobot.mbs.model.gears import gear_forces, resistance, rotor
from ffrobot.mbs.model.tree import Section
from ffrobot.mbs.quantities.energy import Energies, Momentum


def accelerated(motion) -> Accelerated:
    """A motion with what accelerations are read off."""
    return Accelerated(motion.model.tree, motion.q, motion.v, motion.a, motion.frames)


def required_forces(model, state, times):
    """M v̇ − Q (T, n_v) along v: what gravity, elasticity, friction and given loads leave for others to supply."""
    gravity = np.array(model.scene.gravity)
    found = resistance(model, state.q, state.v, state.frames) + rotor_forces(state)
    found -= given_forces(model, state.q, state.frames, times)
    found -= gear_forces(model.tree, state.q, state.v)
    for node, frame, of_frame in zip(model.tree.nodes, state.frames, state.of_frames(), strict=True):
        needed = body_forces(node, state, of_frame, gravity)
        found += np.einsum("tij,ti->tj", frame.L[:, :3], needed.force)
        found += np.einsum("tij,ti->tj", frame.L[:, 3:], needed.moment)
        found[:, node.p_v] += needed.modal
    return found


class BodyForces(NamedTuple):
    """Force (T, 3), moment about the frame's origin (T, 3) and modal forces (T, n), beside gravity and elasticity."""

    force: Array
    moment: Array
    modal: Array


class Inertia(NamedTuple):
    """Of a bent body, in its axes: s (T, 3) kg·m, J (T, 3, 3) kg·m², ∂J/∂p (T, 3, 3, n), h (T, 3, n)."""

    s: Array
    J: Array
    slope: Array
    h: Array


def body_forces(node, state: Accelerated, of_frame, gravity: Array) -> BodyForces:
    """By which the body moves as it does under `gravity` (3,).

    m R̈ + A (ω̇ × s + ω × (ω × s) + 2 ω × S̄ṗ + S̄p̈) − m g; s × Aᵀ(R̈ − g) + J ω̇ + h p̈ + J̇ ω + ω × (J ω + h ṗ);
    p̈ + S̄ᵀAᵀ(R̈ − g) + hᵀω̇ − ½ ω_i ω_j ∂J_ij/∂p − 2 ω_a H_a ṗ + K p + D ṗ. But for m R̈, all in axes of the body.
    With geometric stiffening, less what affine fields have of this, and with what they have to second order.
    """
    body, frame = node.body, state.frames[state.tree.index[node.body.name]]
    A, omega = frame.F, state.velocity(frame)[1]
    p, p_dot, p_2dot = state.q[:, node.p_q], state.v[:, node.p_v], state.a[:, node.p_v]
    w, w_dot, pull = (np.einsum("tji,tj->ti", A, x) for x in (omega, of_frame.Omega, of_frame.r - gravity))
    s, J, slope, h = bent_inertia(node.body, p)
    Hp_dot = np.einsum("amn,tn->tam", node.body.spin_slope, p_dot)
    own = np.cross(w_dot, s) + np.cross(w, np.cross(w, s) + 2 * p_dot @ body.S_bar.T)
    force = body.mass * pull + own + p_2dot @ body.S_bar.T
    J_dot = np.einsum("tijn,tn->tij", slope, p_dot)
    turning = np.einsum("tij,tj->ti", J, w) + np.einsum("tin,tn->ti", h, p_dot)
    moment = np.cross(s, pull) + np.einsum("tij,tj->ti", J, w_dot) + np.einsum("tin,tn->ti", h, p_2dot)
    moment = moment + np.einsum("tij,tj->ti", J_dot, w) + np.cross(w, turning)
    modal = p_2dot + pull @ body.S_bar + np.einsum("tin,ti->tn", h, w_dot) + body.stiffness * p
    modal = modal + p_dot @ body.damping.T - 0.5 * np.einsum("ti,tj,tijn->tn", w, w, slope)
    modal = modal - 2 * np.einsum("ta,tan->tn", w, Hp_dot)
    if body.stiffening is not None:
        for sign, motion in zip((1.0, -1.0), affine_motions(body, p), strict=True):
            along, about, on_modes = motion.forces(motion.accelerations(pull, w_dot, w, p_dot, p_2dot))
            force, moment, modal = force + sign * along, moment + sign * about, modal + sign * on_modes
    return BodyForces(np.einsum("tij,tj->ti", A, force), np.einsum("tij,tj->ti", A, moment), modal)


def given_forces(model, q: Array, frames, times: Array) -> Array:
    """Generalized forces (T, n_v) of all given loads at q (T, n_q) and `times` (T,)."""
    tree, found = model.tree, cut_loads(model.tree, model.cut, q, frames, times)
    for direction, size in model.modal_loads:
        found += size.sample(times)[0][:, None] * direction
    for load in model.scene.load:
        values = {name: function.sample(times)[0] for name, function in load.components.items()}
        if load.point is not None:
            L = tree.motion(tree.section(load.point, np.eye(3)), q, frames).L
            none = np.zeros(len(times))
            wrench = np.stack([values.get(name, none) for name in ("x", "y", "z", "mx", "my", "mz")], axis=1)
            found += np.einsum("tij,ti->tj", L, wrench)
        elif load.joint in tree.carried:
            found += np.stack([*values.values()], axis=1) @ model.along(load.joint)
    return found


def along_cut(one, times):
    """The sum of loads (T,) along the coordinate of a cut joint, N·m or N."""
    return sum((load.sample(times)[0] for load in one.loads), np.zeros(len(times)))


def cut_loads(tree, cut, q, frames, times) -> Array:
    """Generalized forces (T, n_v) of given loads along cut joints at `times` (T,)."""
    loaded, found = [one for one in cut if one.loads], np.zeros((len(q), tree.n_v))
    if loaded:
        _, gradients = measured(tree, loaded, q, frames)
        for k, one in enumerate(loaded):
            found += along_cut(one, times)[:, None] * gradients[:, k]
    return found


def bent_inertia(body, p: Array) -> Inertia:
    """Of the body bent by p (T, n)."""
    S = body.S_bar_kl
    G = np.einsum("ij,kkmn->ijmn", np.eye(3), S) - 0.5 * (S + S.transpose(1, 0, 2, 3))
    Gp = np.einsum("ijmn,tn->tijm", G, p)
    J = body.inertia + np.einsum("ijn,tn->tij", body.inertia_slope, p) + np.einsum("tijm,tm->tij", Gp, p)
    h = body.spin + np.einsum("amn,tm->tan", body.spin_slope, p)
    return Inertia(body.first_moment + p @ body.S_bar.T, J, body.inertia_slope + 2 * Gp, h)


class RotorMotion(NamedTuple):
    """Of a rotor with inertia J on the first side of a joint, behind a gear of ratio N, over states (T, …).

    Attributes:
        first, second: the joint's sides, the first of which carries it.
        ratio: N.
        inertia: J in kg·m².
        axis: z (T, 3) of both, global axes.
        spin: u = z·(N Ω_second − (N − 1) Ω_first), rad/s, (T,).
        torque: J u̇ (T,), N·m.
        gyroscopic: J u Ω_first × z (T, 3), N·m: with J u̇ z the rate of its angular momentum.
    """

    first: Section
    second: Section
    ratio: float
    inertia: float
    axis: Array
    spin: Array
    torque: Array
    gyroscopic: Array


def rotor_mass(node) -> float:
    """J N² in kg of the rotor in a prismatic joint, 0 without one; that the side it sits on turns is left out."""
    inertia, ratio = rotor(node)
    return inertia * ratio**2 if node.joint.type == "prismatic" else 0.0


def rotors(state: Accelerated):
    """Of all rotors of a tree in revolute joints."""
    of_frames = None
    for node in state.tree.nodes:
        inertia, ratio = rotor(node)
        if not inertia or node.joint.type == "prismatic":
            continue
        of_frames = state.of_frames() if of_frames is None else of_frames
        first, second = (node.outer, node.inner) if node.backwards else (node.inner, node.outer)
        at = [state.tree.motion(section, state.q, state.frames) for section in (first, second)]
        Omega, Omega_dot = (
            [state.velocity(motion)[1] for motion in at],
            [state.of_section(section, of_frames).Omega for section in (first, second)],
        )
        z = at[0].F[:, :, 2]
        spin, rate = (np.sum(z * (ratio * x[1] - (ratio - 1) * x[0]), axis=1) for x in (Omega, Omega_dot))
        turning = inertia * spin[:, None] * np.cross(Omega[0], z)
        yield RotorMotion(first, second, ratio, inertia, z, spin, inertia * rate, turning)


def rotor_forces(state: Accelerated) -> Array:
    """Generalized forces (T, n_v) that the motion of all rotors takes."""
    found = np.zeros_like(state.v)
    for node in state.tree.nodes:
        if mass := rotor_mass(node):
            found[:, node.v] += mass * state.a[:, node.v]
    for one in rotors(state):
        on_second = one.ratio * one.torque[:, None] * one.axis
        on_first = one.gyroscopic - (one.ratio - 1) * one.torque[:, None] * one.axis
        for section, moment in ((one.first, on_first), (one.second, on_second)):
            L = state.tree.motion(section, state.q, state.frames).L
            found += np.einsum("tij,ti->tj", L[:, 3:], moment)
    return found


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
    """Of all bodies: ½ (m Ṙ² + ωᵀJω + ṗᵀṗ) + Ṙ·(ω × s + S̄ṗ) + ω·hṗ, in axes of the body; ½ pᵀKp; −g·(mR + As).

    Compliant gears store ½ k δ², and their motors turn as they have to. With geometric stiffening, less what
    affine fields have of the kinetic energy, and with what they have to second order.
    """
    motion = motion.behind_gears
    count, gravity = len(motion.time), np.array(motion.model.scene.gravity)
    kinetic, strain, gravitational, dissipated = np.zeros((4, count))
    for node, frame in zip(motion.model.tree.nodes, motion.frames, strict=True):
        body, p, p_dot = node.body, motion.q[:, node.p_q], motion.v[:, node.p_v]
        u, omega = _body_velocities(motion, frame.F, frame.L)
        s, J, _, h = bent_inertia(body, p)
        spin = np.einsum("tij,tj->ti", J, omega) + 2 * np.einsum("tin,tn->ti", h, p_dot)
        kinetic += 0.5 * np.sum(omega * spin, axis=1) + 0.5 * np.sum(p_dot * p_dot, axis=1)
        kinetic += np.sum(u * (0.5 * body.mass * u + np.cross(omega, s) + p_dot @ body.S_bar.T), axis=1)
        if body.stiffening is not None:
            bent, linear = (np.square(m.velocities(u, omega, p_dot)).sum(axis=(1, 2)) for m in affine_motions(body, p))
            kinetic += 0.5 * (bent - linear)
            s = first_moment(body, p)[0]
        strain += 0.5 * np.square(p) @ body.stiffness
        gravitational -= (body.mass * frame.r + np.einsum("tij,tj->ti", frame.F, s)) @ gravity
        dissipated += np.einsum("ti,ij,tj->t", p_dot, body.damping, p_dot)
    of_gears = gear_energy(motion.model.tree, motion.q, motion.v)
    strain, dissipated = strain + of_gears[0], dissipated + of_gears[1]
    dissipated += np.sum(motion.v * resistance(motion.model, motion.q, motion.v, motion.frames), axis=1)
    for node in motion.model.tree.nodes:
        kinetic += 0.5 * rotor_mass(node) * np.sum(motion.v[:, node.v] ** 2, axis=1)
    for one in rotors(accelerated(motion)):
        kinetic += 0.5 * one.inertia * one.spin**2
    return Energies(kinetic, strain, gravitational, dissipated)


def momentum(motion) -> Momentum:
    """Of all bodies: A (m Ṙ + ω × s + S̄ṗ), and R × that + A (s × Ṙ + Jω + hṗ), in axes of the body."""
    motion = motion.behind_gears
    linear, angular = np.zeros((2, len(motion.time), 3))
    for node, frame in zip(motion.model.tree.nodes, motion.frames, strict=True):
        body, p, p_dot = node.body, motion.q[:, node.p_q], motion.v[:, node.p_v]
        u, omega = _body_velocities(motion, frame.F, frame.L)
        s, J, _, h = bent_inertia(body, p)
        own = body.mass * u + np.cross(omega, s) + p_dot @ body.S_bar.T
        spin = np.cross(s, u) + np.einsum("tij,tj->ti", J, omega) + np.einsum("tin,tn->ti", h, p_dot)
        if body.stiffening is not None:
            for sign, affine in zip((1.0, -1.0), affine_motions(body, p), strict=True):
                along, about, _ = affine.forces(affine.velocities(u, omega, p_dot))
                own, spin = own + sign * along, spin + sign * about
        own, spin = (np.einsum("tij,tj->ti", frame.F, x) for x in (own, spin))
        linear += own
        angular += spin + np.cross(frame.r, own)
    for one in rotors(accelerated(motion)):
        angular += one.inertia * one.spin[:, None] * one.axis
    return Momentum(linear, angular)


def _body_velocities(motion, A: Array, L: Array) -> tuple[Array, Array]:
    """Ṙ and ω (T, 3) in axes of the body."""
    both = np.einsum("tij,tj->ti", L, motion.v)
    return np.einsum("tji,tj->ti", A, both[:, :3]), np.einsum("tji,tj->ti", A, both[:, 3:])
