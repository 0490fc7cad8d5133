"""Attachment modes in time integration: more modal mass where they would vibrate faster than is of interest.

Attachment modes carry the static flexibility that the eigenmodes of a link leave out. As vibrations they mean little:
their frequencies lie where the model has no eigenmodes to be right with, and explicit steps would follow them. Above
`LIMIT` times the highest eigenmode their modal mass is raised by μ = (ω / limit)², which leaves stiffness, damping and
all static loads as they are. With p' = √μ p the modal mass is the identity again: everything linear in the modes is
divided by √μ, everything quadratic by μ, and the mass that was added is booked in S̄_22, so that m_ff = I holds there.

Inversion with motors only keeps the masses: no step of its collocation is held down by high frequencies, and its
zeros, which high modes move, stay those of the link. Forward runs behind it may raise them.

Statics, linear models and results keep p: motion goes to p' before an integration and comes back after it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from ...common.arrays import Array
from .model import Model
from .planar_body import PlanarBody, transformed
from .projection import PLANE
from .spatial_body import SpatialBody
from .spatial_body import transformed as transformed_in_space

LIMIT = 2.0  # times the frequency of the highest eigenmode: above it masses are raised


B = TypeVar("B", PlanarBody, SpatialBody)


def mass_factors(body: PlanarBody | SpatialBody) -> Array:
    """(n,) μ ≥ 1 of each modal coordinate; 1 where a body has no attachment modes."""
    mu = np.ones(body.n_modes)
    if body.attachment_modes and body.n_eigenmodes:
        highest = np.sort(body.stiffness)[body.n_eigenmodes - 1]
        mu = np.maximum(mu, body.stiffness / (LIMIT**2 * highest))
    return mu


def with_raised_mass(body: B) -> B:
    """The body, in 3D one of a planar scene, in p' = √μ p; the same object where no mass is raised."""
    mu = mass_factors(body)
    if np.all(mu == 1.0):
        return body
    T, stiffness, added = np.diag(1.0 / np.sqrt(mu)), body.stiffness / mu, np.diag(1.0 - 1.0 / mu)
    if isinstance(body, SpatialBody):
        raised = transformed_in_space(body, T, stiffness)
        return replace(raised, S_bar_kl=raised.S_bar_kl + np.multiply.outer(0.5 * PLANE, added))
    planar = transformed(body, T, stiffness)
    return replace(planar, m_xy=planar.m_xy + added)


def integrated(model: Model) -> Model:
    """What is integrated in place of `model`; the same object where no mass is raised."""
    bodies = tuple(with_raised_mass(body) for body in model.bodies)
    if all(one is other for one, other in zip(bodies, model.bodies, strict=True)):
        return model
    root = by_body(model)
    loads = tuple(replace(load, vector=load.vector / root[load.body]) for load in model.modal_loads)
    return replace(model, bodies=bodies, modal_loads=loads)


def raised_in_words(model: Model) -> str:
    """Which bodies have raised masses; empty where none has."""
    bodies = [body.name for body in model.bodies if np.any(mass_factors(body) > 1.0)]
    if not bodies:
        return ""
    return f"modes of {', '.join(bodies)} above {LIMIT:g} × the highest eigenmode have raised mass in time integration"


def by_body(model: Model) -> dict[str, Array]:
    """√μ (n,) of each body's modal coordinates."""
    return {body.name: np.sqrt(mass_factors(body)) for body in model.bodies}


def factors_of(model: Model, bodies: Sequence[str]) -> Array:
    """√μ of the modal coordinates of some bodies, side by side."""
    return np.concatenate([np.sqrt(mass_factors(model.body(name))) for name in bodies])


def coordinate_factors(model: Model) -> Array:
    """√μ of all coordinates (R, θ, p) of all bodies, side by side: q' = factors · q."""
    return np.concatenate([np.append(np.ones(3), root) for root in by_body(model).values()])


def modal_factors(model: Model) -> Array:
    """√μ of the modal coordinates of all bodies, side by side: p' = factors · p, F_p' = F_p / factors."""
    return np.concatenate(list(by_body(model).values()))
