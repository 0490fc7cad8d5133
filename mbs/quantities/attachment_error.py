"""What the raised mass of attachment modes makes of a run: `model.raised_mass`."""

from __future__ import annotations

import numpy as np

from ..analysis.outcome import Outcome
from ..model.raised_mass import mass_factors


def mode_error(outcome: Outcome) -> float | None:
    """Estimated error of moments and deflections for too few modes, of their peaks; None where nothing is known.

    Attachment modes carry what the eigenmodes left out do statically. Their dynamics is wrong by the mass that was
    added, (μ − 1) p̈, that is by δp = (μ − 1) p̈/ω²: the largest √(δpᵀ K δp) of a link against the largest √(pᵀ K p).
    It knows of these masses alone: modes that are missing ring under jolts and bend under distributed inertia, which
    `run.modal_error` sees (measured there: 1.5e-5 said of 7e-3 in forces after a jolt). Not known of links without
    attachment modes, nor where masses are not raised.
    """
    ratios = []
    for body in outcome.assembly.model.links:
        if not body.n_modes:
            continue
        mu = mass_factors(body)
        if not body.attachment_modes or np.all(mu == 1.0):
            return None
        columns = outcome.coordinates(body.name)
        p, p_ddot = outcome.q[:, columns][:, 3:], outcome.a[:, columns][:, 3:]
        wrong = np.sqrt((((mu - 1.0) * p_ddot) ** 2 / body.stiffness).sum(axis=1).max(initial=0.0))
        whole = np.sqrt((p**2 * body.stiffness).sum(axis=1).max(initial=0.0))
        ratios.append(float(wrong / whole) if whole else 0.0)
    return max(ratios, default=None)
