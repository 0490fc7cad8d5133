"""`modes = "auto"` of bodies: what counts, and the bodies to choose from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..common.arrays import Array, as_floats
from ..mbs.model.body import Body
from ..mbs.model.truncation import loaded_points, with_fewer_modes
from ..mbs.quantities.motion import point_motion
from ..mbs.quantities.supply import followed_trajectories, motor_moments, path_force
from ..scene.scene import Scene
from .bodies import LoadedBody
from .result import AnalysisResult

if TYPE_CHECKING:
    from .mode_search import Reported

GROWTH = 1.5  # of the number of modes from one solve to the next
ALIKE = 1e-9  # of ω²: of a round link, both planes of bending


def reported_modes(result: AnalysisResult) -> Reported:
    """Return what `modes = "auto"` compares, by kind; moments on joints and paths over the largest length of links."""
    run = result.run
    nodes = [node for node in run.model.tree.nodes if node.body.n_modes]
    size = max((node.body.length or 0.0 for node in nodes), default=0.0) or 1.0
    forces: dict[str, Array] = {}
    for trajectory in followed_trajectories(run):
        force, places = path_force(run, trajectory.name), len(trajectory.components)
        forces[f"trajectory {trajectory.name}"] = force[:, :places]
        forces[f"trajectory {trajectory.name}, moment"] = as_floats(force[:, places:] / size)
    for joint, acting in result.reactions.items():
        forces[f"joint {joint}"], forces[f"joint {joint}, moment"] = acting.force, as_floats(acting.moment / size)
    found_by_kind = {
        "deflections": {
            f"{node.body.name}.{label}": point_motion(run, f"{node.body.name}.{label}").deflection
            for node in nodes
            for label in node.body.points
        },
        "forces": {name: values for name, values in forces.items() if values.size},
        "motors": motor_moments(run),
        "voltages": {}
        if result.actuation is None
        else {name: of.required for name, of in result.actuation.voltages.items()},
    }
    return {kind: quantities for kind, quantities in found_by_kind.items() if quantities}


def mode_levels(scene: Scene, bodies: Mapping[str, LoadedBody]) -> list[dict[str, Body]]:
    """The flexible bodies with `modes` given, with more and more modes where that is "auto"; the last have all.

    A level has the modes up to one frequency, of all bodies: 1, 2, 3, 5, 8 … of each on average, of those that count.
    These are the family with most modes: with those of one plane alone, both planes of bending come at once. In a
    planar scene all modes count. `bodies` may have fewer modes already.
    """
    wanted = {body.name: body.modes for body in scene.body if body.modes is not None}
    whole = {name: bodies[name].spatial.whole for name in wanted}
    loaded = {name: loaded_points(scene, name) for name in wanted}
    fixed = {
        name: with_fewer_modes(whole[name], modes, loaded[name])
        for name, modes in wanted.items()
        if isinstance(modes, int)
    }
    auto = {name: whole[name] for name, modes in wanted.items() if modes == "auto"}
    if not auto:
        return [fixed]
    levels: list[dict[str, Body]] = []
    squares = np.sort(_counted(scene, {name: bodies[name] for name in auto}))
    each = 1
    while each * len(auto) < len(squares):
        cut = squares[each * len(auto) - 1] * (1 + ALIKE)
        level = {
            name: with_fewer_modes(body, int(np.count_nonzero(body.stiffness <= cut)), loaded[name])
            for name, body in auto.items()
        }
        if all(body.reduction is None for body in level.values()):
            break
        levels.append(fixed | level)
        each = int(np.ceil(GROWTH * each))
    levels.append(fixed | auto)
    return levels


def _counted(scene: Scene, bodies: Mapping[str, LoadedBody]) -> Array:
    """ω² of the modes that count."""
    squares: dict[str, list[float]] = {}
    for body in bodies.values():
        whole, modal = body.spatial.whole, body.modal
        assert modal is not None
        families = [""] * whole.n_eigenmodes if scene.is_planar else modal.family  # attachment modes come after them
        for family, square in zip(families, whole.stiffness[: whole.n_eigenmodes], strict=False):
            squares.setdefault(family, []).append(square)
    return np.array(max(squares.values(), key=len, default=[]))
