"""Which coordinates a run integrates: those of the joints where the mechanism can be told in them, else its own."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from ...common.arrays import Array
from .. import _core
from ..joints.measure import Measure
from ..model.planar_tree import PlanarTree
from ..model.system import MechanismSystem
from ..model.tree_layout import NotInTreeError
from ..solve.state import State
from .outcome import EarlierRun


@dataclass(frozen=True)
class TreeStart:
    """A tree that is integrated in place of its system, and where: q and v (n,)."""

    tree: PlanarTree
    q: Array
    v: Array


def tree_start(
    assembly: MechanismSystem,
    start: State,
    earlier: EarlierRun | None,
    motors: Iterable[Measure],
) -> TreeStart | str:
    """What is integrated in joint coordinates from `start`; or why nothing is.

    A run that goes on with an `earlier` one stays in the coordinates in which that was stopped. `motors`: along which
    forces are to be found.
    """
    if earlier is not None and isinstance(earlier.continuation.checkpoint, _core.Checkpoint):
        return "as the run that it goes on with"
    try:
        tree = PlanarTree(assembly, motors)
        return TreeStart(tree, *tree.state(start.q, start.v))
    except NotInTreeError as why:
        return str(why)


def tree_size(assembly: MechanismSystem, earlier: EarlierRun) -> int | None:
    """Of q and of v of the tree in whose coordinates an `earlier` run was integrated; None where in absolute ones."""
    if not isinstance(earlier.continuation.checkpoint, _core.TreeCheckpoint):
        return None
    try:
        return int(PlanarTree(assembly).core.n_v)
    except NotInTreeError:
        return None
