"""What interfaces that turn have of a solid's geometric stiffness: K for exact rotation vectors.

An interface that turns by φ moves a point at d from its center by φ × d and, to second order, by ½ φ × (φ × d). Its
mean displacement and rotation, which are linear in u, read the latter too: a section that turns about two axes across
seems to turn about the third. The tractions t of a unit load on an interface do work on it, T = ∫ t dᵀ ds,

    ∫ t · ½ φ × (φ × d) ds = ½ (φᵀ T φ − tr T φᵀφ)

and −½ pᵀK p of the load, K = ∫ σ⁰ ∂Φ ∂Φ dV, is the work on both. Without it K belongs to the displacement of the
interface's center and to the rotation vector of its section, by which the equations of motion place it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...common.arrays import Array
from ..modal_body import Interface
from ..modal_body.unit_loads import interface_load_names
from .strain_energy import internal_forces
from .supports import Flexibility


def without_their_turn(
    K: Mapping[str, Array],
    flexibility: Flexibility,
    loads: Mapping[str, Array],
    shapes: Mapping[str, Array],
    rows: Mapping[str, Array],
    interfaces: Mapping[str, Interface],
    supports: Mapping[str, Sequence[int]],
) -> dict[str, Array]:
    """K (n, n) by unit load, for centers and rotation vectors of the interfaces; collective.

    The given K has what the mean motion of interfaces reads. `loads` and `shapes` (3 owned,) are nodal forces and
    displacements by unit load, `rows` B (6, 3 owned) the mean motion of each interface, which spreads loads on it.
    `supports`: components of the mean motion that are fixed, in the order of `flexibility.B`; none of rigid faces.
    """
    names = list(K)
    f = np.stack([loads[name] for name in names], axis=1)
    T = _of_spread_loads(flexibility, names, f, rows, interfaces, supports)
    for name, more in _of_plates(flexibility, f, np.stack([shapes[name] for name in names], axis=1)).items():
        T[name] += more
    total = {name: matrix.copy() for name, matrix in K.items()}
    for name, of_loads in T.items():
        phi = interfaces[name].rotation
        squares = phi.T @ phi
        for load, t in zip(names, of_loads, strict=True):
            total[load] += 0.5 * phi.T @ (t + t.T) @ phi - np.trace(t) * squares
    return total


def _of_spread_loads(
    flexibility: Flexibility,
    names: Sequence[str],
    f: Array,
    rows: Mapping[str, Array],
    interfaces: Mapping[str, Interface],
    supports: Mapping[str, Sequence[int]],
) -> dict[str, Array]:
    """T (loads, 3, 3) on each interface of what is spread by its rows: the load itself, reactions of mean supports."""
    model, T = flexibility.model, {}
    reactions = iter(flexibility.reactions(f))
    for name, B in rows.items():
        sizes = np.zeros((6, len(names)))
        own = interface_load_names([name])
        sizes[:, [names.index(load) for load in own]] = np.eye(6)
        for component in supports.get(name, ()):
            sizes[component] += next(reactions)
        arms = model.x - interfaces[name].position
        T[name] = np.einsum("kl,kij->lij", sizes, model.total(np.einsum("kai,aj->kij", B.reshape(6, -1, 3), arms)))
    return T


def _of_plates(flexibility: Flexibility, f: Array, shapes: Array) -> dict[str, Array]:
    """T (loads, 3, 3) on rigid faces of the tractions that keep them plane, beside what is spread over them."""
    model = flexibility.model
    if not flexibility.faces:
        return {}
    constraint = internal_forces(model, model.with_ghosts(shapes)) - flexibility.supported(f)
    at_nodes = constraint.reshape(model.owned, 3, -1)
    return {
        face.name: model.total(
            np.einsum("ail,aj->lij", at_nodes[face.nodes], model.x[face.nodes] - face.centroid, optimize=True)
        )
        for face in flexibility.faces
    }
