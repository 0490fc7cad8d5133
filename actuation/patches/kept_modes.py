"""Patches that are too few for all modes of their link, where its equations have fewer: they serve what these keep."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...common.arrays import Array, Indices, as_floats
from ...mbs.model.body import Body
from .link_patches import LinkPatches
from .patches import PatchArray
from .reached_modes import ReachedModes


def on_kept_modes(of_link: LinkPatches, equations: Body) -> LinkPatches:
    """The patches of a link whose `equations` may have fewer modes than its file; the same where they reach all modes.

    Modal forces on modes left out follow from the loads on the link. Patches that cannot produce all of these produce
    those on the coordinates that are kept, and may bend the link in the others.
    """
    if equations.reduction is None or of_link.reach.serves_all:
        return of_link
    modes = {layout: _kept(reached, equations) for layout, reached in of_link.modes.items()}
    reached = _kept(of_link.reached, equations)
    arrays = {layout: _array(of_link, layout, modes[layout], equations) for layout in of_link.arrays}
    W_sqrt = of_link.reach.W_sqrt @ _lift(of_link.reached, equations)
    reach = replace(
        of_link.reach, Phi_V=reached.seen(of_link.Phi_V.T).T, W_sqrt=W_sqrt,
        frequency=np.sqrt(reached.stiffness) / (2 * np.pi), served=reached.served,
    )  # fmt: skip
    on_kept = as_floats(equations.modal_transform @ equations.on_file)
    return replace(of_link, arrays=arrays, modes=modes, reach=reach, reached=reached, on_kept=on_kept)


def _columns(reached: ReachedModes, equations: Body) -> Indices:
    """Numbers of the coordinates kept that move the link in these modes above all."""
    squares = equations.modal_transform**2
    return np.flatnonzero(squares[reached.rows].sum(axis=0) > 0.5 * squares.sum(axis=0))


def _kept(reached: ReachedModes, equations: Body) -> ReachedModes:
    columns = _columns(reached, equations)
    T = equations.modal_transform[np.ix_(reached.rows, columns)]
    served = int(np.count_nonzero(columns < equations.n_eigenmodes))
    return ReachedModes(reached.rows, T, equations.stiffness[columns], served)


def _lift(reached: ReachedModes, equations: Body) -> Array:
    """(m, m') forces on all modes that patches reach from those on the coordinates kept."""
    return reached.forces(equations.on_file[_columns(reached, equations)]).T


def _array(of_link: LinkPatches, layout: str, kept: ReachedModes, equations: Body) -> PatchArray:
    array, columns, on_link = of_link.arrays[layout], of_link.columns(layout), of_link.bodies[of_link.body]
    return replace(
        array, turn=kept.seen(on_link.turn[:, columns].T).T, Phi_V=kept.seen(on_link.Phi_V[:, columns].T).T,
        W_sqrt=array.W_sqrt @ _lift(of_link.modes[layout], equations),
        frequency=np.sqrt(kept.stiffness) / (2 * np.pi), served=kept.served,
    )  # fmt: skip
