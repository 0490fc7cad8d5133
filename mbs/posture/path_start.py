"""The undeformed robot where its path begins: what inverse analyses start from."""

from ...common.structs import struct
from ..model.gears import with_prescribed_motors
from ..model.known_motion import State
from ..model.model import Model
from .posture import Mobility, check_path, mobility
from .reach import check_reach
from .redundancy import resolved
from .start import displaced_joints, undeformed_posture


@struct
class PathStart:
    """A robot that follows its path, and its state at t = 0 with undeformed links."""

    model: Model  # with equations for redundant freedoms, and with compliant gears where motors follow the path
    state: State
    mobility: Mobility  # with rigid gears
    warnings: tuple[str, ...]


def path_start(model: Model, end: float) -> PathStart:
    """The start of the path that ends at `end` (s).

    Raises `InputError` for a path that the undeformed robot cannot follow, `SolveError` where redundant freedoms cannot
    be resolved.
    """
    rigid = resolved(model, end)
    check_reach(rigid, end)
    state = undeformed_posture(rigid)
    warnings, free = tuple(check_path(rigid, state.q, end)), mobility(rigid, state.q)
    geared = with_prescribed_motors(rigid)
    if geared is not rigid:
        state = undeformed_posture(geared)
        warnings += tuple(displaced_joints(geared, state, {gear.joint.joint.name for gear in geared.tree.gears}))
    return PathStart(geared, state, free, warnings)
