"""`modes = "auto"` of bodies: what counts, and the bodies to choose from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..common.arrays import Array, as_floats
from ..mbs.model.body import Body
from ..mbs.model.truncation import with_fewer_modes
from ..scene.scene import Scene
from .loaded_body import LoadedBody
from .mode_search import Reported, truncation_levels
from .solution import AnalysisResult


def reported_modes(result: AnalysisResult) -> Reported:
    """Everything of an analysis whose error counts; moments on joints and paths as forces at the arm of a link."""
    motion = result.motion
    nodes = [node for node in motion.model.tree.nodes if node.body.n_modes]
    size = max((node.body.length or 0.0 for node in nodes), default=0.0) or 1.0
    forces: dict[str, Array] = {}
    for trajectory in motion.followed:
        found, places = motion.path_force(trajectory.name), len(trajectory.components)
        forces[f"trajectory {trajectory.name}"] = found[:, :places]
        forces[f"trajectory {trajectory.name}, moment"] = as_floats(found[:, places:] / size)
    for joint, acting in result.reactions.items():
        forces[f"joint {joint}"], forces[f"joint {joint}, moment"] = acting.force, as_floats(acting.moment / size)
    found_by_kind = {
        "deflections": {
            f"{node.body.name}.{label}": motion.point(f"{node.body.name}.{label}").deflection
            for node in nodes
            for label in node.body.points
        },
        "forces": {name: values for name, values in forces.items() if values.size},
        "motors": motion.motor_moments,
        "voltages": {}
        if result.actuation is None
        else {name: of.required for name, of in result.actuation.voltages.items()},
    }
    return {kind: quantities for kind, quantities in found_by_kind.items() if quantities}


def mode_levels(scene: Scene, bodies: Mapping[str, LoadedBody]) -> list[dict[str, Body]]:
    """See `truncation_levels`; `bodies` may have fewer modes already.

    Counted is the family with most modes: with those of one plane alone, both planes of bending come at once. In a
    planar scene all modes count.
    """
    whole = {name: body.spatial.whole for name, body in bodies.items()}

    def counted(names: Sequence[str]) -> Array:
        squares: dict[str, list[float]] = {}
        for name in names:
            modal, of_body = bodies[name].modal, whole[name].stiffness[: whole[name].n_eigenmodes]
            assert modal is not None
            families = [""] * len(of_body) if scene.is_planar else modal.family
            for family, square in zip(families, of_body, strict=False):  # attachment modes come after them
                squares.setdefault(family, []).append(square)
        return np.array(max(squares.values(), key=len, default=[]))

    return truncation_levels(scene, whole, with_fewer_modes, counted)
