"""What too few eigenmodes make of a run, as attachment modes tell it."""

from __future__ import annotations

import numpy as np

from ..analysis.outcome import Outcome


def mode_error(outcome: Outcome) -> float | None:
    """Estimated error of moments and deflections for too few modes, of their peaks; None where nothing is known.

    Attachment modes carry what the eigenmodes left out do statically. What these do besides, by their inertia, is at
    most as if they vibrated at the frequency ω_k of the highest eigenmode kept: δp = (1/ω_k² − 1/ω²) p̈. The estimate
    is the largest √(δpᵀ K δp) of a link against the largest √(pᵀ K p). It is 0.3 to 3.5 times the error of the worst
    moment of two-link arms with two to six modes, for errors of 2e-7 to 1e-3 (tests/mbs/test_mode_error.py). Modes that
    ring after a jolt and are not there have no part in it: `run.modal_error` sees those, for the price of a solve.
    Nothing is known of links without attachment modes.
    """
    ratios = []
    for body in outcome.assembly.model.links:
        if not body.n_modes:
            continue
        if not body.attachment_modes or not body.n_eigenmodes:
            return None
        highest = np.sort(body.stiffness)[body.n_eigenmodes - 1]
        late = np.maximum(1.0 / highest - 1.0 / body.stiffness, 0.0)
        columns = outcome.coordinates(body.name)
        p, p_ddot = outcome.q[:, columns][:, 3:], outcome.a[:, columns][:, 3:]
        wrong = np.sqrt(((late * p_ddot) ** 2 * body.stiffness).sum(axis=1).max(initial=0.0))
        whole = np.sqrt((p**2 * body.stiffness).sum(axis=1).max(initial=0.0))
        ratios.append(float(wrong / whole) if whole else 0.0)
    return max(ratios, default=None)
