"""The modes that a link file asks for: the lowest of a family, however many others lie in between."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, quoted
from ..link_records.families import DEFAULT_COUNT, FAMILIES, LOCAL
from ..link_records.link import SolidLink
from ..modal_body.attachment_modes import ModeSet, ascending
from ..modal_body.krylov_schur import KrylovSchur
from .elasticity import MassMatrix
from .families import NEARLY, SectionShapes, aligned, names
from .strain_energy import strain_energy

if TYPE_CHECKING:
    from .attachment_modes import FixedInterfaceFlexibility
    from .supports import Flexibility

    Inverse: TypeAlias = Flexibility | FixedInterfaceFlexibility


# Mean motion of the sections, of modes (3 owned, n).
Reader = Callable[[Array], SectionShapes]


def wanted_modes(link: SolidLink, flexibility: Inverse, mass: MassMatrix, read: Reader, where: str) -> ModeSet:
    """Compute the modes that `link.modes` selects; collective.

    The search for the lowest modes goes on until the wanted ones are among them; for how many more follows from the
    share of wanted ones so far. Raises `InputError` for more than the mesh has, or than can be found in reasonable
    time; `SolveError` where modes are lost in round-off.
    """
    family, model = "all" if link.modes.family == "all" else link.families, flexibility.model
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
        omega2, Q = np.linalg.eigh(strain_energy(model, model.with_ghosts(X)))
        X = X @ Q
        motion = read(X)
        Q = aligned(omega2, motion, family)
        kinds = names(motion.turned(Q))
        settled = available if sought == available else _settled(omega2)
        hits = [k for k, kind in enumerate(kinds[:settled]) if family == "all" or kind in family]
        if not numbers.size:
            hits = _lowest_of_each(hits, kinds)
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


def _lowest_of_each(hits: Sequence[int], kinds: Sequence[str]) -> list[int]:
    taken: Counter[str] = Counter()
    chosen = []
    for k in hits:
        taken[kinds[k]] += 1
        if kinds[k] in DEFAULT_COUNT and taken[kinds[k]] <= DEFAULT_COUNT[kinds[k]]:  # type: ignore[index]
            chosen.append(k)
    return chosen


def _settled(omega2: Array) -> int:
    """How many of the modes found lie below the last gap: the others may belong with one that is yet to be found."""
    gaps = np.flatnonzero(np.diff(omega2) > NEARLY * omega2[1:])
    return int(gaps[-1]) + 1 if gaps.size else 0


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
