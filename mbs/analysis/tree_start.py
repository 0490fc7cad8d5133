"""Which coordinates a run integrates: those of the joints where the mechanism can be told in them, else its own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...common.arrays import Array
from .. import _core
from ..model.planar_tree import PlanarTree
from ..model.system import MechanismSystem
from ..model.tree_layout import NotInTreeError
from ..solve.integrators import Choice
from ..solve.state import State
from .outcome import EarlierRun

UNITS = "they take the same steps in any units of measure there"
OTHERS = {"radau": UNITS, "generalized-alpha": UNITS}
"""Integrators that a run does not begin with in joint coordinates, and why: docs/recursion.md."""

LOOPS = "closed loops keep small tolerances there, and stop where they are singular"


@dataclass(frozen=True)
class TreeStart:
    """A tree that is integrated in place of its system, and where: q and v (n,)."""

    tree: PlanarTree
    q: Array
    v: Array

    @property
    def core_arguments(self) -> dict[str, Any]:
        """Of `_core.run_tree`, beside those that it shares with `_core.run`."""
        tree = self.tree
        return {"tree": tree.core, "scene": tree.scene, "bodies": tree.bodies, "drives": tree.drives}


def tree_start(
    assembly: MechanismSystem, start: State, integrator: Choice, earlier: EarlierRun | None
) -> TreeStart | str:
    """What is integrated in joint coordinates from `start`; or why nothing is.

    A run that goes on with an `earlier` one stays in the coordinates in which that was stopped.
    """
    if earlier is not None and isinstance(earlier.continuation.checkpoint, _core.Checkpoint):
        return "as the run that it goes on with"
    if integrator.name in OTHERS:
        return OTHERS[integrator.name]
    if assembly.model.scene.topology.loop_joints:
        return LOOPS
    try:
        tree = PlanarTree(assembly)
        return TreeStart(tree, *tree.state(start.q, start.v))
    except NotInTreeError as why:
        return str(why)
