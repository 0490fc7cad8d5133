"""The modes of a link that its patches reach: those of some of its families, as it moves in these alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array, Indices, as_floats
from ...fe_models.modal_body import ModalBody
from ...mbs.model.body import Body
from ...mbs.model.masses import uncoupling

OUT_OF_REACH = 1e-9  # of the largest modal force per volt: less is rounding


@dataclass(frozen=True)
class ReachedModes:
    """The modes of a link that moves in some of its families alone, with what it carries.

    Attributes:
        rows: (m,) numbers (from 0) of the modes of the modal body in these families.
        T: (m, m) p of these rows from the coordinates p' in which m_ff is the identity and K_ff diagonal; (m, fewer) of
            the coordinates that equations keep, see `link_patches.on_kept_modes`.
        stiffness: (m,) of the p'.
        served: number of them, the first ones: the others are attachment modes.
    """

    rows: Indices
    T: Array
    stiffness: Array
    served: int

    def forces(self, F_p: Array) -> Array:
        """(T, m) on the p' from those on the modes of the modal body (T, n)."""
        on_modes: Array = F_p[:, self.rows] @ self.T
        return on_modes

    def coordinates(self, p: Array) -> Array:
        """(T, m) p' from those of the modal body (T, n)."""
        return as_floats(np.linalg.lstsq(self.T, p[:, self.rows].T, rcond=None)[0].T)

    def seen(self, rows: Array) -> Array:
        """(k, m) what is linear in the modes of the modal body, (k, n), over p'."""
        return self.forces(rows)


def reached_modes(per_volt: Array, body: ModalBody, spatial: Body) -> ReachedModes:
    """By modal forces per volt (k, n) on the modes of the modal body: the families in which any is not 0."""
    size = np.abs(per_volt).max(axis=0)
    families = {body.family[k] for k in np.flatnonzero(size > OUT_OF_REACH * size.max())}
    moving = spatial.modal_transform.any(axis=1)
    rows = np.flatnonzero([moves and family in families for moves, family in zip(moving, body.family, strict=True)])
    T_inverse, square = spatial.on_file, np.ix_(rows, rows)
    T, stiffness = uncoupling((T_inverse.T @ T_inverse)[square], (T_inverse.T * spatial.stiffness @ T_inverse)[square])
    modes_first = np.argsort(body.residual[rows], kind="stable")
    served = int(np.count_nonzero(body.residual[rows] == 0))
    return ReachedModes(rows, T[:, modes_first], stiffness[modes_first], served)
