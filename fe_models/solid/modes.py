"""Modes of a solid: the lowest of a family, attachment modes, Craig–Bampton. `owned`: nodes of this rank.

Families go by the kinetic energy in the mean motion of the cross sections. Of a mode with unit modal mass, their
translation (u, v, w) and rotation (φ_x, φ_y, φ_z) carry the shares

    axial ∫ρA u² dx,  torsion ∫ρ(I_y + I_z) φ_x² dx,  in-plane bending ∫ρA v² + ρI_z φ_z² dx,  out-of-plane likewise.

The largest names the family; where together they carry less than half, the mode is `local`.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from ...common.arrays import Array, Integers
from ...common.errors import InputError, quoted
from ..link_records.families import DEFAULT_COUNT, FAMILIES, LOCAL, Family
from ..link_records.link import SolidLink
from ..modal_body.attachment_modes import COMPONENTS, Inertia, ModeSet, ascending, residual_modes
from ..modal_body.craig_bampton import FixedInterfaceFlexibility, in_order
from ..modal_body.krylov_schur import KrylovSchur
from ..modal_body.unit_loads import MOTIONS
from .elasticity import MassMatrix, SolidModel
from .functionals import Averages
from .stress import strain_energy
from .supports import Flexibility

# Relative distance up to which neighboring ω² are one repeated value.
REPEATED = 1e-9
# Where one family is wanted, modes this near are taken apart into it and the others.
NEARLY = 1e-3
# Simpson's 3/8 rule on the four stations of an element, exact for cubics.
SIMPSON = np.array([1.0, 3.0, 3.0, 1.0]) / 8
R_X = 3  # among unit loads
_DEFAULT = {str(family): count for family, count in DEFAULT_COUNT.items()}


def wanted_modes(
    link: SolidLink,
    flexibility: Flexibility | FixedInterfaceFlexibility,
    mass: MassMatrix,
    read: Callable[[Array], list[Array]],
    where: str,
) -> ModeSet:
    """Compute the modes that `link.modes` selects; collective. `read`: `section_motion` of modes (3 owned, n), m.

    Raises `InputError`, which names `where`, for more than the mesh has, or than can be found in reasonable time;
    `SolveError` where modes are lost in round-off.
    """
    family, model = "all" if link.modes.family == "all" else link.families, mass.model
    numbers = np.array(link.modes.indices or range(1, (link.modes.count or 0) + 1)) - 1
    default, available = sum(DEFAULT_COUNT[one] for one in link.families), flexibility.rank
    needed = int(numbers[-1]) + 1 if numbers.size else default
    batch = needed + 2 if family == "all" else 2 * needed + 2
    key = "count" if link.modes.indices is None else "indices"
    most = min(available, 40 * needed + 200)  # far more than slender parts need
    search = KrylovSchur(
        flexibility,
        mass,
        3 * model.owned,
        flexibility.rank,
        comm=model.comm,
        total=model.total,
        solver=link.modes.solver,
    )
    sought = 0
    while True:
        if (family == "all" and needed > available) or sought == available:
            raise InputError(
                f"{where}: modes.{key}: expected at most the number of modes available in family"
                f' "{" + ".join(link.families) if family != "all" else family}" on this mesh, which has {available} of'
                " all families",
                needed,
            )
        sought = min(sought + batch, most)
        X = search.candidates(sought)
        omega2, Q = np.linalg.eigh(strain_energy(model, X))
        X = X @ Q
        motion = read(X)
        Q = aligned(omega2, motion, family)
        kinds = names([rows @ Q for rows in motion])
        # Of the modes found, those above the last gap may belong with one that is yet to be found.
        gaps = np.flatnonzero(np.diff(omega2) > NEARLY * omega2[1:])
        settled = available if sought == available else int(gaps.max(initial=-1)) + 1
        hits = [k for k, kind in enumerate(kinds[:settled]) if family == "all" or kind in family]
        if not numbers.size:
            hits = [k for k in hits if kinds[:k].count(kinds[k]) < _DEFAULT.get(kinds[k], 0)]
        if len(hits) >= needed:
            if not search.complete(sought):
                batch = 0
                continue
            chosen = np.array(hits)[numbers] if numbers.size else np.array(hits)
            return _chosen(omega2, X, Q[:, chosen], [kinds[k] for k in chosen])
        if sought == most < available:
            raise InputError(
                f"{where}: modes.{key}: expected {needed} modes of family {quoted(link.families)} among the lowest"
                f" {sought}",
                f"{len(hits)} (short, wide parts hardly bend): request fewer",
            )
        share = max(len(hits), 1) / sought
        batch = int(np.ceil((needed - len(hits)) / share)) + 2


def _chosen(omega2: Array, X: Array, Q: Array, kinds: Sequence[str]) -> ModeSet:
    """Modes X Q, uncoupled among each other."""
    K = (Q.T * omega2) @ Q
    order = ascending(np.diag(K), np.array([[*FAMILIES, LOCAL].index(kind) for kind in kinds]))
    K, Q = K[np.ix_(order, order)], Q[:, order]
    squares = np.diag(K)
    if not np.allclose(K, np.diag(squares), rtol=0, atol=1e-12 * squares.min()):
        squares, turn = np.linalg.eigh(K)
        Q = Q @ turn
    return ModeSet(squares, tuple(kinds[k] for k in order), X @ Q)


def section_motion(
    averages: Averages,
    x: Array,
    element: Integers,
    translation: Array,
    rotation: Array,
    attached: Sequence[tuple[Array, Array]],
) -> list[Array]:
    """Motion (rows, n) of the sections, m·√kg, for each of `FAMILIES`: sums of squares are shares of kinetic energy.

    Sections at x (k,), m, stations of `element` (e, 4), move by `translation` (k, 3, n), m, and `rotation`, rad;
    `attached`: of each mass on an interface the motion there (6, n), m and rad, and its weights (6,), kg and kg·m².
    """
    line = np.zeros(x.size)
    np.add.at(line, element, (x[element[:, 3]] - x[element[:, 0]])[:, None] * SIMPSON)
    mass, polar = line * averages.density * averages.area, np.einsum("kii->ki", averages.inertia)
    turn = (line * averages.density)[:, None] * polar
    lumps = [np.sqrt(weights)[:, None] * motion for motion, weights in attached]
    moved = np.concatenate([np.sqrt(mass)[:, None, None] * translation, *(rows[None, :3] for rows in lumps)])
    turned = np.concatenate([np.sqrt(turn)[:, :, None] * rotation, *(rows[None, 3:] for rows in lumps)])
    bending = [np.concatenate([moved[:, axis], turned[:, about]]) for axis, about in ((1, 2), (2, 1))]
    return [*bending, moved[:, 0], turned[:, 0]]


def names(motion: Sequence[Array]) -> list[str]:
    """The family of each of n modes; "local" where sections have less than half of its motion.

    `motion`: of each of `FAMILIES`, m·√kg, (rows, n) by `section_motion`, whose squares are shares of kinetic energy.
    """
    share = np.array([np.sum(rows**2, axis=0) for rows in motion])
    total, first = share.sum(axis=0), share.argmax(axis=0)
    return [FAMILIES[i] if whole >= 0.5 else LOCAL for whole, i in zip(total, first, strict=True)]


def aligned(omega2: Array, motion: Sequence[Array], wanted: Sequence[str] | str) -> Array:
    """Rotations Q (n, n), no unit, of modes of equal frequency to the families: a reproducible basis.

    `omega2` (n,) in rad²/s² is ascending, `motion` (rows, n), m·√kg, that of the sections by family. For `wanted`
    families (not "all") modes of nearly equal frequency are combined, too: all motion in a family is then in one.
    """
    Q = np.eye(omega2.size)
    gap = REPEATED if wanted == "all" else NEARLY
    ends = np.flatnonzero(np.append(np.diff(omega2) > gap * omega2[1:], True)) + 1
    for first, last in pairwise([0, *ends]):
        if last - first > 1:
            Q[first:last, first:last] = _turn([rows[:, first:last] for rows in motion], wanted)
    return Q


def _turn(families: Sequence[Array], wanted: Sequence[str] | str) -> Array:
    """(m, m): principal axes of the families' energies, each weighted by its number so that none are equal."""
    weights = [4.0, 3.0, 2.0, 1.0]
    if wanted != "all":
        weights = [w * (name in wanted) for w, name in zip(weights, FAMILIES, strict=True)]
    weights = [w / max(weights) if len(wanted) == 1 else w for w in weights]
    energy = sum(weight * rows.T @ rows for weight, rows in zip(weights, families, strict=True))
    return np.linalg.eigh(energy)[1][:, ::-1]


def attachment_modes(
    families: Sequence[Family],
    mass: MassMatrix,
    modes: ModeSet,
    loads: Array,
    shapes: Array,
    interfaces: int,
    length: float,
    twists_along: bool,
) -> ModeSet:
    """Attachment modes of the loads at so many `interfaces` that belong to `families`; collective.

    `loads` (3 owned, l), N, and `shapes`, m, are those of `invariants.unit_loads` and `static_shapes`, `modes` the
    eigenmodes. Moments are unit forces times `length` (m); `twists_along` adds a torque distributed along the link.
    """
    model, scale = mass.model, np.repeat([1.0, length], 3)
    static = {}
    for family in families:
        wanted = [(MOTIONS + 6 * k + row, scale[row]) for k in range(interfaces) for row in COMPONENTS[family]]
        if twists_along and family == "torsion":  # along the link as its inertia about the axis
            turn = np.cross([1.0, 0.0, 0.0], model.x).ravel()
            wanted.append((R_X, length / float(model.total(np.array([turn @ loads[:, R_X]]))[0])))
        columns, sizes = zip(*wanted, strict=True)
        static[family] = shapes[:, columns] * sizes, loads[:, columns] * sizes
    inertia = Inertia(lambda U: mass @ U, lambda U: strain_energy(model, U), model.total)
    return residual_modes(static, modes.X, float(modes.omega2.max()), inertia)


def ritz_modes(model: SolidModel, both: ModeSet, count: int) -> ModeSet:
    """Ritz modes in the space `both`: `count` fixed-interface modes, then static shapes; collective.

    Those that count as eigenmodes come first: see `in_order`.
    """
    ritz = in_order(strain_energy(model, both.X), both.families, [k >= count for k in range(len(both.families))])
    return ModeSet(ritz.omega2, ritz.families, both.X @ ritz.X)
