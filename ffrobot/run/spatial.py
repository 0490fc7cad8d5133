"""The analyses of a scene in space, run one after the other."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ..actuation.patches.spatial_patches import LinkPatches
from ..fe_models.modal_body import ModalBody
from ..mbs.analysis.spatial_pcid import SpatialRun, run_spatial_pcid
from ..mbs.model.spatial_model import SpatialModel, build_spatial_model
from ..mbs.quantities.spatial_motion import SpatialMotion
from ..mbs.quantities.spatial_reactions import Wrench, reactions
from ..mbs.scene.analysis import IntegratedAnalysis
from ..scene.spatial import SpatialScene, load_spatial_scene
from .spatial_actuation import SpatialActuation, actuated_in_space, patches_in_space
from .spatial_bodies import LoadedSpatialBody, load_spatial_bodies
from .watcher import Watcher


@dataclass(frozen=True)
class SpatialResult:
    """What was computed of one analysis.

    Attributes:
        run: how it went, and states.
        motion: what is read off them.
        reactions: forces in joints by name.
        actuation: what patches have to do, and whether motors and patches can.
    """

    run: SpatialRun
    motion: SpatialMotion
    reactions: Mapping[str, Wrench]
    actuation: SpatialActuation

    @property
    def warnings(self) -> tuple[str, ...]:
        """Why results may be wrong, or not mean what they seem to, a text each."""
        missed = self.actuation.unsupplied
        return self.run.warnings if missed is None else (*self.run.warnings, missed.in_words)


@dataclass(frozen=True)
class SpatialSolution:
    """Everything a solve of a scene in space computed.

    Attributes:
        scene, model: what was solved.
        bodies: by name.
        patches: by body.
        analyses: by name, in the order of the scene.
        seconds: wall time by stage.
    """

    scene: SpatialScene
    model: SpatialModel
    bodies: Mapping[str, LoadedSpatialBody]
    patches: Mapping[str, LinkPatches]
    analyses: Mapping[str, SpatialResult]
    seconds: Mapping[str, float]

    @property
    def links(self) -> dict[str, ModalBody]:
        """The modal bodies of the flexible bodies, as their files have them."""
        return {name: body.modal for name, body in self.bodies.items() if body.modal is not None}

    @property
    def notes(self) -> tuple[str, ...]:
        """What patches do to the stiffness of their links, and what links cannot do, one line each."""
        stiffness = (array.stiffness_in_words for of in self.patches.values() for array in of.arrays.values())
        return tuple(stiffness) + tuple(
            f"{name}: rigid in {', '.join(body.rigid_in)}, of which its file has no modes"
            for name, body in self.bodies.items()
            if body.rigid_in
        )


def solve_spatial(path: Path, watcher: Watcher) -> SpatialSolution:
    """Run every analysis of a scene file in space; stage 1 runs first for links that are not up to date.

    Raises `InputError` for anything wrong with the scene or the files it names, `SolveError` where no state is found.
    """
    scene, began = load_spatial_scene(path), time.perf_counter()
    loaded = load_spatial_bodies(scene, watcher.stage)
    seconds = {"bodies": time.perf_counter() - began}
    model = build_spatial_model(scene, [body.spatial for body in loaded])
    bodies = {body.name: part for body, part in zip(scene.body, loaded, strict=True)}
    patches = patches_in_space(scene, bodies)
    analyses = {}
    for analysis in scene.analysis:
        assert isinstance(analysis, IntegratedAnalysis)
        watcher.stage(analysis.name)
        began = time.perf_counter()
        run = run_spatial_pcid(model, analysis)  # the only kind there is yet: see scene.spatial.AVAILABLE_KINDS
        motion = SpatialMotion(model, run.time, run.q, run.v, run.a, run.multipliers)
        actuation = actuated_in_space(scene, motion, bodies, patches)
        analyses[analysis.name] = SpatialResult(run, motion, reactions(motion, run.frames), actuation)
        seconds[analysis.name] = time.perf_counter() - began
    return SpatialSolution(scene, model, bodies, patches, analyses, seconds)
