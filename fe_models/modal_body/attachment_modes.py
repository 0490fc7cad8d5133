"""Residual attachment modes: what static shapes of interface loads have that the eigenmodes of a link have not.

The residual R = (I − X Xᵀ M) K⁻¹ B of unit loads B at interfaces beside the n eigenmodes X (XᵀMX = I) is made
orthonormal in M and uncoupled in K, and serves as further modes (docs/theory.md, Attachment modes). NumPy only.
"""

from collections.abc import Callable, Container, Mapping, Sequence

import numpy as np

from ...common.arrays import Array, Integers
from ...common.structs import struct
from ..link_records.families import FAMILIES, Family
from .parts import Interface

# Of the energy (its square root) of the static shape of a load, what a combination of residuals must have to be kept.
TOLERANCE = 1e-3
# Of the largest energy of a load: less is round-off, of a load that the supports carry.
IMMOBILE = 1e-10
# Times the highest eigenmode's frequency: stiffer shapes (of loads a hair's breadth apart) only spoil linear models.
STIFFEST = 1e4
# Coupling of families by stiffness, relative to their own: less is round-off.
COUPLED = 1e-10
# ω² that differ by less, relative, are equal but for round-off: bending of round and square sections in both planes.
ALIKE = 1e-6
# Components of a load at an interface that move a family: forces 0 … 2 along x, y, z, moments 3 … 5 about them.
COMPONENTS: Mapping[Family, tuple[int, ...]] = {
    "in-plane-bending": (1, 5),
    "out-of-plane-bending": (2, 4),
    "axial": (0,),
    "torsion": (3,),
}


def moving(families: Container[str]) -> list[int]:
    """Components of loads at interfaces, ascending, forces 0 … 2 and moments 3 … 5, that move modes of `families`."""
    return sorted({k for family in FAMILIES if family in families for k in COMPONENTS[family]})


@struct
class Inertia:
    """M and strain energy of a finite element model with m degrees of freedom, of which a process may own a part.

    `mass` returns M U of displacements U (m, k), SI, `energy` UᵀKU (k, k), J, `total` the sum over all processes.
    """

    mass: Callable[[Array], Array]
    energy: Callable[[Array], Array]  # free of the round-off errors of an assembled K
    total: Callable[[Array], Array]

    def without(self, X: Array, U: Array) -> Array:
        """U (m, k), any unit, M-orthogonal to X (m, n), XᵀMX = I, to round-off."""
        for _ in range(2):
            U = U - X @ self.total(X.T @ self.mass(U))
        return U


@struct
class ModeSet:
    """Modes, ascending: `omega2` ω² (n,) in rad²/s², the family of each or of its loads."""

    omega2: Array
    families: tuple[str, ...]
    X: Array  # (m, n) in 1/√kg, with XᵀMX = I

    def followed_by(self, more: "ModeSet") -> "ModeSet":
        """These modes and, after them, `more`."""
        omega2 = np.concatenate([self.omega2, more.omega2])
        return ModeSet(omega2, (*self.families, *more.families), np.concatenate([self.X, more.X], axis=1))


def residual_modes(static: Mapping[Family, tuple[Array, Array]], X: Array, highest: float, inertia: Inertia) -> ModeSet:
    """Attachment modes from `static`: by family the shapes K⁻¹B and the loads B, both (m, loads), SI.

    B are unit forces, and moments of these times a length; X (m, n) are the eigenmodes, XᵀMX = I, `highest` their
    highest ω² in rad²/s², inf without any.
    """
    known, families = X, list[Family]()
    energies = {family: inertia.total(np.einsum("il,il->l", *pair)) for family, pair in static.items()}  # bᵀK⁻¹b
    largest = max((float(of.max(initial=0.0)) for of in energies.values()), default=0.0)
    for family in (one for one in FAMILIES if one in static):
        own = energies[family]
        moved = own > IMMOBILE * largest
        if moved.any():
            independent = _independent(static[family][0][:, moved] / np.sqrt(own[moved]), known, inertia)
            families += [family] * independent.shape[1]
            known = np.concatenate([known, independent], axis=1)
    modes = _uncoupled(known[:, X.shape[1] :], families, inertia)
    count = int(np.searchsorted(modes.omega2, STIFFEST**2 * highest, side="right"))
    return ModeSet(modes.omega2[:count], modes.families[:count], modes.X[:, :count])


def _independent(shapes: Array, known: Array, inertia: Inertia) -> Array:
    """(m, r) orthonormal in M to each other and to `known`: combinations of `shapes` that have energy of their own."""
    shapes = inertia.without(known, shapes)
    energy, turn = np.linalg.eigh(inertia.energy(shapes))
    kept = energy > TOLERANCE**2
    shapes = shapes @ (turn[:, kept] / np.sqrt(energy[kept]))
    for _ in range(2):
        shapes = inertia.without(known, shapes)
        gram = inertia.total(shapes.T @ inertia.mass(shapes))
        squares, turn = np.linalg.eigh(0.5 * (gram + gram.T))
        shapes = shapes @ (turn / np.sqrt(squares))[:, ::-1]
    return shapes


def _uncoupled(X: Array, families: Sequence[Family], inertia: Inertia) -> ModeSet:
    """Principal axes of the strain energy: in each family by itself, unless the link couples families."""
    of = np.array([FAMILIES.index(family) for family in families], dtype=np.int64)
    squares, turn, of = uncoupled(inertia.energy(X), of)
    order = ascending(squares, of)
    return ModeSet(squares[order], tuple(FAMILIES[of[k]] for k in order), X @ turn[:, order])


def ascending(omega2: Array, family: Integers) -> Integers:
    """Order (n,) of modes by ω² (n,) in rad²/s², ties by family number (n,), so that round-off cannot decide."""
    order = np.argsort(omega2, kind="stable")
    steps = np.diff(omega2[order]) > ALIKE * omega2[order][1:]
    level = np.concatenate([[0], np.cumsum(steps)])[: len(order)]
    return order[np.lexsort((family[order], level))]


def uncoupled(K: Array, of: Integers) -> tuple[Array, Array, Integers]:
    """Eigenvalues (n,), unit eigenvectors (n, n), families (n,) of K (n, n), rad²/s²; `of` (n,): its rows' families."""
    apart = of[:, None] != of
    size = np.sqrt(np.diag(K))
    if np.any(np.abs(K)[apart] > (COUPLED * np.outer(size, size))[apart]):
        squares, turn = np.linalg.eigh(K)
        shares = np.array([np.sum(turn[of == k] ** 2, axis=0) for k in range(of.max() + 1)])
        of = shares.argmax(axis=0)
    else:
        squares, turn = np.zeros(of.size), np.zeros(K.shape)
        for k in np.unique(of):
            own = np.flatnonzero(of == k)
            squares[own], turn[np.ix_(own, own)] = np.linalg.eigh(K[np.ix_(own, own)])
    return squares, turn, of


def interface_loads(
    omega2: Array, eigenmodes: int, interfaces: Mapping[str, Interface]
) -> tuple[Array, dict[str, Array]]:
    """The inertia and the loads at interfaces that deform a link into each of its n modes Y, K Y = M Y W + B c.

    Returns W (n, n), rad²/s², and by interface c (6, n), force in N and moment in N·m per unit of modal coordinate. B
    are unit loads. `omega2` (n,) is ω², first of so many `eigenmodes`, then of residual attachment modes.
    """
    # K x = ω² M x of an eigenmode; K r = Bc − M X XᵀBc of a residual one, c by the work rᵀBc = rᵀKr.
    W, of = np.diag(omega2), slice(eigenmodes, None)
    W[of, of] = 0.0
    if eigenmodes == omega2.size:
        return W, {}
    rows = np.concatenate([at.motion for at in interfaces.values()])
    flexibility = np.square(rows) @ (1.0 / omega2)
    scale = np.zeros(len(rows))
    # Loads that do no work on any mode are carried by the supports.
    scale[flexibility > 0.0] = 1.0 / np.sqrt(flexibility[flexibility > 0.0])
    work = (rows[:, of] * scale[:, None]).T
    c = np.zeros(rows.shape)
    c[:, of] = scale[:, None] * np.linalg.pinv(work, rcond=TOLERANCE**2) * omega2[of]
    W[:eigenmodes, of] = -rows[:, :eigenmodes].T @ c[:, of]
    return W, dict(zip(interfaces, c.reshape(len(interfaces), 6, -1), strict=True))
