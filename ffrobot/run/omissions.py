"""What a scene does not need, in words: it is not computed, not multiplied, not stored."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

import numpy as np

from ..fe_models.modal_body import ModalBody
from ..mbs.model.body import Body
from ..mbs.model.projection import vanishing_in_plane
from ..mbs.model.truncation import modes_kept
from ..scene.scene import Scene
from .loaded_body import LoadedBody

_STAGE_1 = {"modes": "stage 1 but for damping, stresses and name", "mesh": "the mesh, which is that of an earlier run"}

RIGID = 1e-9  # of the motion across: less along the axis is rounding

_TERMS = {
    "D_ff": "damping",
    "S_tilde": "inertia between rotation and pairs of modes",  # S̃
    "j": "change of inertia to first order in deflections",  # j
}


def omissions(scene: Scene, bodies: Mapping[str, LoadedBody]) -> Iterator[str]:
    """One line for each thing that a planar scene leaves out."""
    of = {name: body.spatial for name, body in bodies.items()}
    for name, body in bodies.items():
        if body.modal is None:
            continue
        if not body.computed:
            yield f"{name}: stage 1, up to date"
        elif body.reused:
            yield f"{name}: {_STAGE_1[body.reused]}"
        yield from _modes(name, of[name], body.modal)
    flexible = [name for name, body in bodies.items() if body.modal is not None]
    rigid = [name for name in bodies if name not in flexible]
    if rigid:
        yield f"modal coordinates of {', '.join(rigid)}, rigid"
    yield "out-of-plane motion"
    stiff = [name for name in flexible if _is_rigid_along(of[name])]
    if stiff:
        yield f"axial deformation of {', '.join(stiff)}: no axial modes in [modes] family"
    for term, symbol in _TERMS.items():
        zero = [name for name, body in of.items() if term in vanishing_in_plane(body)]
        if zero:
            whose = "" if zero == flexible else f" of {', '.join(zero)}"
            yield f"{symbol}{whose}, which is zero"
    algebraic = [analysis.name for analysis in scene.analysis if analysis.is_algebraic]
    if algebraic:
        yield f"integration of {', '.join(algebraic)}, algebraic"


def _is_rigid_along(body: Body) -> bool:
    """Whether no force at a point moves any point of the link along its axis, where joints and weight load it."""
    along = [point.translation[0] for point in body.points.values()]
    across = [point.translation[1] for point in body.points.values()]
    return bool(np.abs(along).max(initial=0.0) <= RIGID * np.abs(across).max(initial=0.0))


def _modes(name: str, body: Body, modal: ModalBody) -> Iterator[str]:
    """Modes that do not move in the plane, and those left out by choice."""
    whole = body if body.reduction is None else body.reduction.whole
    idle = np.flatnonzero(~whole.modal_transform.any(axis=1))
    if idle.size:
        families = Counter(modal.family[k] for k in idle)
        named = ", ".join(f"{count} {family}" for family, count in families.items())
        yield f"{name}: {idle.size} of {modal.mode_count} modes, without in-plane motion ({named})"
    if body.reduction is not None:
        yield f"{name}: all modes but {modes_kept(body)}"
