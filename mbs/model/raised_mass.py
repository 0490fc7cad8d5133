"""Modal mass of attachment modes, raised where they would vibrate faster than the modes of a link know of.

Attachment modes carry the static flexibility that the eigenmodes leave out. As vibrations they mean little: they stand
for all eigenmodes above the highest one kept, at ω_k, by one frequency ω far above it, which explicit steps have to
follow. Above `LIMIT` ω_k their modal mass is raised by μ = (ω / LIMIT ω_k)². That leaves all static loads as they are,
and changes their motion by (1/(LIMIT ω_k)² − 1/ω²) p̈, 1/LIMIT² of what the eigenmodes between may change at most
(`quantities.attachment_error`). In p' = √μ p the modal mass is the identity again.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...common.arrays import Array, as_floats
from .body import Body, transformed

LIMIT = 3.0  # times the frequency of the highest eigenmode; errors of torques are those of own masses, with 2 they grow


def mass_factors(body: Body) -> Array:
    """(n,) μ ≥ 1 of each modal coordinate; 1 where a body has no attachment modes."""
    if not (body.attachment_modes and body.n_eigenmodes):
        return np.ones(body.n_modes)
    highest = np.sort(body.stiffness)[body.n_eigenmodes - 1]
    return as_floats(np.maximum(1.0, body.stiffness / (LIMIT**2 * highest)))


def with_raised_mass(body: Body) -> Body:
    """The body in p' = √μ p, and the same object where no mass is raised.

    S̄_kl and S_s of p' are those that p had: all mass that moves in a mode is raised alike, and m_ff is the identity.
    """
    mu = mass_factors(body)
    if np.all(mu == 1.0):
        return body
    root = np.sqrt(mu)
    raised = transformed(body, np.diag(1.0 / root), body.stiffness / mu)
    of_whole = body.reduction and replace(body.reduction, T=body.reduction.T / root, lift=body.reduction.lift * root)
    return replace(raised, S_bar_kl=body.S_bar_kl, S_spin=body.S_spin, reduction=of_whole, mass_factors=mu)
