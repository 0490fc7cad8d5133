"""Frequencies of beams that differ a little, by the mode of one of them held: for derivatives.

With K x = λ M x and x held, the derivative of Rayleigh's quotient xᵀK(θ)x / xᵀM(θ)x at that beam is that of the
eigenvalue, xᵀ(∂K/∂θ − λ ∂M/∂θ)x / xᵀMx: no mode but the one is needed, as long as its eigenvalue is simple (Fox and
Kapoor, AIAA Journal 6, 1968).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...common.arrays import Array
from ..link_records import BeamLink, Family
from .eigen import lowest_modes
from .link import loaded_models

GAP = 1e-3  # between neighbouring ω², relative: closer ones may turn into each other


def fixed_mode_frequencies(links: Sequence[BeamLink], family: Family, number: int) -> Array | None:
    """(n,) Hz of `links` by the mode `number`, from 1, of `family` of the first one.

    None where its frequency is not simple, or the links differ in their meshes.
    """
    model = loaded_models(links[0], [family])[0][family]
    count = min(number + 1, model.K.shape[0])
    omega2, X = lowest_modes(model.K, model.M, model.strain, count)
    if np.any(np.diff(omega2)[max(0, number - 2) :] < GAP * omega2[number - 1]):
        return None
    x, found = X[:, number - 1], []
    for link in links:
        model = loaded_models(link, [family])[0][family]
        if model.K.shape[0] != x.size:
            return None
        strain = model.strain @ x  # of which the quotient is free of rounding errors of K
        found.append(float(np.sqrt((strain @ strain) / (x @ (model.M @ x)))) / (2 * np.pi))
    return np.array(found)
