"""Constraint rows of a robot in the core: values, postures and velocities that meet them, mobility there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from ...common.arrays import Array, Booleans, as_list
from .. import _core
from .kinematics import Kinematics
from .nodes import ConstraintRow
from .tree import KinematicTree

TOLERANCE = 1e-13  # of constraints, relative to the size of the robot
MET = 1e3 * TOLERANCE  # what counts as met where round-off hinders
LARGEST_TURN = 0.5  # rad (and sizes of the robot) that a Newton step may move: keeps to the branch of the guess


class Constraints(Kinematics):
    """Equations C(q, t) = 0 of `rows`; `length` (m) of the robot, natural sizes of rows (rows,) and joints (n_v,)."""

    def __init__(
        self, tree: KinematicTree, rows: Sequence[ConstraintRow], length: float, row_sizes: Array, joint_sizes: Array
    ) -> None:
        super().__init__(tree.nodes, rows=rows)
        self._rows, self._length, self._row_sizes, self._joint_sizes = rows, length, row_sizes, joint_sizes

    @cached_property
    def _senses(self) -> tuple[list[str], Kinematics]:
        """Cosines that distinguish parallel from opposite axes of "dot" rows, positive if parallel, with row owners.

        Of z of b against z of a and, of joints that do not turn, x against x. An owner's rows are of x and y of a with
        z of b and, of such joints, of x of a with y of b.
        """
        aligned, turning = dict[str, list[ConstraintRow]](), list[ConstraintRow]()
        for row in (row for row in self._rows if row.kind == "dot"):
            aligned.setdefault(row.owner, []).append(row)
        for first, second, *still in (rows for rows in aligned.values() if len(rows) > 1):
            turning.append(replace(first, f=np.cross(first.f, second.f)))
            turning += [replace(row, g=np.cross(row.g, first.g)) for row in still]
        return [row.owner for row in turning], Kinematics(self.nodes, rows=turning)

    def natural_gradients(self, q: Array, times: Array, sizes: Array | None = None) -> Array:
        """Return C_v (T, rows, n_v) at q (T, n_q) and `times` (T,), rows in natural sizes and coordinates in `sizes`.

        Those of joints by default. Its rank does not depend on units.
        """
        sizes = self._joint_sizes if sizes is None else sizes
        return self.values(q, times)[1] * sizes / self._row_sizes[:, None]

    def turned_over(self, q: Array, times: Array) -> dict[str, Booleans]:
        """Return, by loop joint and tool axis, at which of q (T, n_q) and `times` (T,) it is turned by π.

        Its "dot" rows are 0 there, too: they leave open which way the axes point that they align.
        """
        owners, senses = self._senses
        if not owners:
            return {}
        against = senses.values(q, times)[0] < 0.0
        return {owner: against[:, [other == owner for other in owners]].any(axis=1) for owner in owners}

    def posture(self, q: Array, t: float, locked: Booleans | None = None) -> Array | None:
        """Return the posture (n_q,) next to q (n_q,) at t (s), as `postures`; None without convergence."""
        solved, is_met = self.postures(q[None], np.array([t]), locked)
        return solved[0] if is_met[0] else None

    def postures(self, q: Array, times: Array, locked: Booleans | None = None) -> tuple[Array, Booleans]:
        """Project q (T, n_q) onto C(q, t) = 0 at `times` (T,), s; with flags (T,) of convergence.

        By least steps of joints not `locked` (n_v,). A solution with a joint or tool axis turned by π does not count as
        converged.
        """
        moved, left = self.moved(q, times, locked=locked)
        is_met = left <= MET
        for is_turned_over in self.turned_over(moved, times).values():
            is_met &= ~is_turned_over
        return moved, is_met

    def moved(
        self, q: Array, times: Array, beside: Array | None = None, locked: Booleans | None = None
    ) -> tuple[Array, Array]:
        """Project q (T, n_q) onto C = `beside` (T, rows), default 0, at `times` (T,); returned with residuals (T,).

        By Newton's method with the least steps of joints not `locked` (n_v,); modal coordinates stay. What is left is
        in terms of natural sizes, NaN where it is not finite.
        """
        more = np.zeros((0, 0)) if beside is None else self.signs * beside
        scales = self._joint_sizes if locked is None else np.where(locked, 0.0, self._joint_sizes)
        # Coordinates by themselves have no branches
        farthest = np.inf if all(row.kind == "coordinate" for row in self._rows) else LARGEST_TURN
        return self.core.postures(
            self.scene,
            as_list(times),
            q,
            beside=more,
            scales=scales,
            sizes=self._row_sizes,
            largest_step=farthest,
        )

    def velocities(self, q: Array, v: Array, locked: Booleans | None = None) -> Array:
        """Return v (n_v,) moved onto Ċ = 0 at q (n_q,) and t = 0 by the least change of joints not `locked` (n_v,)."""
        scales, now = self._joint_sizes if locked is None else np.where(locked, 0.0, self._joint_sizes), np.zeros(1)
        (C_v,), (C_dot,) = self.natural_gradients(q[None], now, scales), self.rates(q[None], v[None], now)
        moved: Array = v - scales * np.linalg.lstsq(C_v, C_dot / self._row_sizes, rcond=1e-10)[0]
        return moved

    def mobilities(self, q: Array, times: Array, loop_rank: int = -1) -> list[_core.Mobility]:
        """Return the mobility with rigid links and gears at q (T, n_q) and `times` (T,), s.

        Links may be bent, by which constraints of loops that are redundant with straight ones seem to lock joints:
        `loop_rank` is their rank with straight ones.
        """
        is_path = [row.is_trajectory for row in self._rows]
        return self.core.mobilities(self.scene, as_list(times), q, is_path, self._length, loop_rank)

    def ratios(self, q: Array, times: Array, rank: int) -> Array:
        """Return ratios (T,) of smallest to largest of `rank` singular values of all rows: see `mobilities`."""
        is_path = [False] * len(self._rows)
        motions = self.core.mobilities(self.scene, as_list(times), q, is_path, self._length, rank)
        return np.array([at.loop_ratio for at in motions])
