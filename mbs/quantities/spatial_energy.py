"""Energies and momentum of a motion in space, over the output times (T, …), SI units, global axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ..model.spatial_bending import affine_motions, first_moment
from ..model.spatial_inverse import bent_inertia
from ..model.spatial_transmission import gear_energy, resistance, rotor_mass, rotors
from .spatial_motion import SpatialMotion


@dataclass(frozen=True)
class Energies:
    """Kinetic, strain and gravitational energy (T,) J, and the power (T,) W that modes, gears, friction dissipate."""

    kinetic: Array
    strain: Array
    gravitational: Array
    dissipated_power: Array


@dataclass(frozen=True)
class Momentum:
    """Linear (T, 3) kg·m/s, and angular about the global origin (T, 3) kg·m²/s."""

    linear: Array
    angular: Array


def energies(motion: SpatialMotion) -> Energies:
    """Of all bodies: ½ (m Ṙ² + ωᵀJω + ṗᵀṗ) + Ṙ·(ω × s + S̄ṗ) + ω·hṗ, in axes of the body; ½ pᵀKp; −g·(mR + As).

    Gears that give store ½ k δ² beside, and their motors turn as they have to. With geometric stiffening, less what
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
    for rotor in rotors(motion.accelerated):
        kinetic += 0.5 * rotor.inertia * rotor.spin**2
    return Energies(kinetic, strain, gravitational, dissipated)


def momentum(motion: SpatialMotion) -> Momentum:
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
    for rotor in rotors(motion.accelerated):
        angular += rotor.inertia * rotor.spin[:, None] * rotor.axis
    return Momentum(linear, angular)


def _body_velocities(motion: SpatialMotion, A: Array, L: Array) -> tuple[Array, Array]:
    """Ṙ and ω (T, 3) in axes of the body."""
    both = np.einsum("tij,tj->ti", L, motion.v)
    return np.einsum("tji,tj->ti", A, both[:, :3]), np.einsum("tji,tj->ti", A, both[:, 3:])
