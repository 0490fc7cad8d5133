"""`modes = "auto"` in planar scenes: what counts, and the bodies to choose from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..common.arrays import Array
from ..mbs.model.planar_body import PlanarBody
from ..mbs.model.truncation import with_fewer_modes
from ..mbs.quantities.observation import joint_forces, point_motion, trajectory_force
from ..scene.scene import Scene
from .bodies import LoadedBody
from .mode_search import Reported, truncation_levels
from .solution import AnalysisResult


def reported(scene: Scene, result: AnalysisResult) -> Reported:
    """Everything of an analysis whose error counts."""
    outcome, bodies = result.outcome, result.outcome.assembly.model.bodies
    points = [f"{body.name}.{point}" for body in bodies if body.n_modes for point in body.points]
    held = {c.owner for c in outcome.assembly.constraints if c.is_trajectory}
    joints = {joint.name: joint_forces(outcome, joint.name) for joint in scene.joint}
    found: dict[str, dict[str, Array]] = {
        "deflections": {point: point_motion(outcome, point).deflection for point in points},
        "forces": {f"trajectory {name}": trajectory_force(outcome, name) for name in held}
        | {f"joint {name}": of.reaction for name, of in joints.items()},
        "motors": {name: of.motor for name, of in joints.items() if of.motor is not None},
        "voltages": {body: of.required for body, of in result.voltages.items()},
    }
    return {kind: quantities for kind, quantities in found.items() if quantities}


def whole_bodies(bodies: Mapping[str, LoadedBody]) -> dict[str, PlanarBody]:
    """The planar bodies with all their modes."""
    return {n: b.planar if b.planar.reduction is None else b.planar.reduction.whole for n, b in bodies.items()}


def mode_levels(scene: Scene, bodies: Mapping[str, LoadedBody]) -> list[dict[str, PlanarBody]]:
    """See `truncation_levels`; `bodies` may have fewer modes already."""
    whole = whole_bodies(bodies)

    def counted(names: Sequence[str]) -> Array:
        return np.concatenate([whole[name].stiffness[: whole[name].n_eigenmodes] for name in names])

    return truncation_levels(scene, whole, with_fewer_modes, counted)
