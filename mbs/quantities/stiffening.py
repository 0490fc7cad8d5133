"""What the loads of a run do to the stiffness of links, and how far they bend them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...common.arrays import Array
from ...common.plane import rotated
from ..analysis.planar_outcome import PlanarOutcome
from ..model.geometric_stiffening import GeometricStiffening
from ..model.planar_body import PlanarBody
from .stiffness_change import LoadedPoint, ModalLoads

NOTABLE = 0.01  # relative change of a link's stiffness from which on the summary warns, and "auto" switches it on


def loads_on_modes(
    outcome: PlanarOutcome, stiffening: Mapping[str, GeometricStiffening | None]
) -> dict[str, ModalLoads]:
    """By body, of a run, whether geometric stiffening was on or not.

    `stiffening` by the names of bodies; those without have no entry. Loads are those of θ̇², of the frame's acceleration
    less gravity, of θ̈, and of the constraints.
    """
    assembly, gravity = outcome.assembly, np.array(outcome.assembly.model.scene.gravity)
    wrenches = assembly.constraint_wrenches(outcome.q, outcome.lambda_)
    found: dict[str, ModalLoads] = {}
    for body in assembly.model.bodies:
        known = stiffening.get(body.name)
        if known is None or not body.n_modes:
            continue
        columns = outcome.coordinates(body.name)
        q, v, a = outcome.q[:, columns], outcome.v[:, columns], outcome.a[:, columns]
        pull = rotated(-q[:, 2], gravity - a[:, :2])
        sizes, K = [v[:, 2] ** 2, -a[:, 2], *pull.T], [known.K_omega, known.K_h, *known.K_s]
        for point, wrench in wrenches.get(body.name, {}).items():
            if point in known.K_points:
                sizes += [*rotated(-q[:, 2], wrench[:, :2]).T, wrench[:, 2]]
                K += [*known.K_points[point]]
        points = tuple(LoadedPoint(body.points[name].translation, of[:2]) for name, of in known.K_points.items())
        found[body.name] = ModalLoads(np.stack(sizes, axis=1), np.stack(K), body.stiffness, points)
    return found


def shortenings(outcome: PlanarOutcome, stiffening: Mapping[str, GeometricStiffening | None]) -> dict[str, Array]:
    """By body, b(t) = ½|pᵀβp| (T,): what bending takes off the length of a link, relative to it.

    `stiffening` by the names of bodies, whether it was on in the run or not; bodies without it are left out. The error
    of a tip, relative to the length of its link, was 0.1 to 0.6 b in motions from b = 1e-4 to 4e-2 with stiffening on.
    """
    bodies = [(body, stiffening.get(body.name)) for body in outcome.assembly.model.bodies]
    return {
        body.name: shortening(body, known, outcome.q[:, outcome.coordinates(body.name)][:, 3:])
        for body, known in bodies
        if known is not None and body.n_modes
    }


def shortening(body: PlanarBody, stiffening: GeometricStiffening, p: Array) -> Array:
    """B (T,) of modal coordinates p (T, n).

    −½pᵀα_k p + … are the coefficients of the affine fields nearest to the second-order displacement −½pᵀGp
    (mbs/core/body/affine_inertia.h); b is the size of that of (x, y) and its turn.
    """
    m, s, J = body.mass, complex(*body.first_moment), body.inertia
    K = np.array(
        [stiffening.K_s[0] + 1j * stiffening.K_s[1], stiffening.K_omega + stiffening.rotary + 1j * stiffening.K_h]
    )
    beta = (m * K[1] - s.conjugate() * K[0]) / (m * J - abs(s) ** 2)
    return np.asarray(0.5 * np.abs(np.einsum("ti,ij,tj->t", p, beta, p)))
