"""Inertia shape integrals of a solid, unit loads and their prestress. SI units; `owned`: nodes of this rank.

With displacements and coordinates in the same space, every integral of docs/theory.md is a product with the scalar mass
matrix: x is its own nodal interpolation, so nothing is lumped and nothing is approximated.

An interface that turns by φ moves a point at d from its center by φ × d and, to second order, by ½ φ × (φ × d). Its
mean displacement and rotation, which are linear in u, include the latter. Without the work on it of the tractions t of
a unit load, T = ∫ t dᵀ ds (docs/theory.md, eq. 49), geometric stiffness belongs to the displacement of the interface's
center and to the rotation vector of its section, by which the equations of motion place it.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from ...common.arrays import Array
from ..modal_body import Interface
from ..modal_body.parts import Invariants
from ..modal_body.unit_loads import MOTIONS, inertia_wrenches, loads_at, unit_load_names
from .elasticity import SolidModel
from .stress import geometric_stiffness, internal_forces
from .supports import Flexibility


def shape_integrals(model: SolidModel, modes: Array) -> Invariants:
    """The integrals, SI, of the part alone for `modes` (3 owned, n), 1/√kg; no spin inertia; collective."""
    n, x = modes.shape[1], model.x
    Phi = modes.reshape(-1, 3, n)
    M_Phi = (model.mass @ modes).reshape(-1, 3, n)
    M_x = (model.mass @ x.reshape(-1, 1)).reshape(-1, 3)
    M_one = (model.mass @ np.ones((x.size, 1))).reshape(-1, 3)[:, 0]
    S_bar_kl = model.total(np.einsum("akm,aln->klmn", Phi, M_Phi, optimize=True))
    second = model.total(x.T @ M_x)
    return Invariants(
        mass=float(model.total(M_one.sum(keepdims=True))[0]),
        first_moment=model.total(M_x.sum(axis=0)),
        second_moment=0.5 * (second + second.T),
        S_bar=model.total(M_Phi.sum(axis=0)),
        I_bar=model.total(np.einsum("ak,aln->kln", x, M_Phi, optimize=True)),
        S_bar_kl=0.5 * (S_bar_kl + S_bar_kl.transpose(1, 0, 3, 2)),
        J_spin=0.0,
        h_spin=np.zeros(n),
        S_spin=np.zeros((n, n)),
    )


def unit_loads(model: SolidModel, interfaces: Mapping[str, Array]) -> Array:
    """Consistent nodal forces (3 owned, l), N per unit, of the l unit loads of a link; collective.

    They are d'Alembert forces, and forces and moments at `interfaces`, spread by the transpose of their mean motion B
    (6, 3 owned), m and rad per m: see `modal_body.unit_loads`.
    """
    wrenches = inertia_wrenches(model.x, np.ones(len(model.x)), np.zeros_like(model.x))
    return np.hstack([model.mass @ wrenches[:, :3].reshape(-1, MOTIONS), *(B.T for B in interfaces.values())])


def static_shapes(flexibility: Flexibility, loads: Array) -> Array:
    """Displacements (3 owned, l), m, by `loads` (3 owned, l), N, under the reference condition; collective."""
    displacements = flexibility @ loads
    # Bending stresses cancel over a section: the round-off errors of an assembled K, small as they are, would show.
    return displacements + flexibility @ (loads - internal_forces(flexibility.model, displacements))


def prestressed(
    flexibility: Flexibility,
    modes: Array,
    loads: Array,
    shapes: Array,
    *,
    rows: Mapping[str, Array],
    interfaces: Mapping[str, Interface],
    supports: Mapping[str, Sequence[int]],
) -> Array:
    """Geometric stiffness (l, n, n), rad²/s² per unit of load, of `modes` (3 owned, n), 1/√kg; collective.

    Forces act at centers of interfaces, moments on their rotation vectors. `loads` and `shapes` (3 owned, l) are nodal
    forces, N, and displacements, m, of unit loads, `rows` B (6, 3 owned) the mean motion of each interface; Bᵀ
    spreads loads on it. `supports`: fixed components by interface, in the order of `flexibility.B`; empty without B.
    """
    total = geometric_stiffness(flexibility.model, modes, shapes)
    T = _of_spread_loads(flexibility, loads, rows, interfaces, supports)
    for name, more in _of_plates(flexibility, loads, shapes).items():
        T[name] += more
    for name, t in T.items():
        phi = interfaces[name].rotation
        total += 0.5 * phi.T @ (t + t.transpose(0, 2, 1)) @ phi
        total -= np.trace(t, axis1=1, axis2=2)[:, None, None] * (phi.T @ phi)
    return total


def _of_spread_loads(
    flexibility: Flexibility,
    f: Array,
    rows: Mapping[str, Array],
    interfaces: Mapping[str, Interface],
    supports: Mapping[str, Sequence[int]],
) -> dict[str, Array]:
    """T (loads, 3, 3) on each interface of what is spread by its rows: the load itself, reactions of mean supports."""
    model, names, T = flexibility.model, unit_load_names(rows), {}
    reactions = iter(flexibility.reactions(f))
    for name, B in rows.items():
        sizes = np.zeros((6, len(names)))
        sizes[:, loads_at(names, name)] = np.eye(6)
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
    constraint = internal_forces(model, shapes) - flexibility.supported(f)
    at_nodes = constraint.reshape(model.owned, 3, -1)
    return {
        face.name: model.total(
            np.einsum("ail,aj->lij", at_nodes[face.nodes], model.x[face.nodes] - face.centroid, optimize=True)
        )
        for face in flexibility.faces
    }
