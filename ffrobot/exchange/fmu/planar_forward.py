"""Forward motions of planar scenes for FMUs: the robot put into space, its bodies those of the plane."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...common.errors import InputError
from ...mbs.analysis.forward import Forward
from ...mbs.model.planar_body_in_space import planar_body_in_space
from ...mbs.model.raised_mass import mass_factors, with_raised_mass
from ...mbs.model.spatial_gears import with_compliance_in_space
from ...mbs.model.spatial_model import SpatialModel, build_spatial_model
from ...mbs.scene.in_space.mechanism import mechanism_in_space
from ...mbs.solve.start_in_space import start_in_space
from ...run.prepare import prepare
from ...run.solution import Solution
from ...run.watcher import Watcher
from ...scene.scene import Scene
from .forward_model import HeldUnit, Input, held_unit, voltage

AXES = "xy"


def unit_in_plane(scene: Scene, analysis: Forward, watcher: Watcher) -> tuple[SpatialModel, HeldUnit]:
    """The motion of `analysis` from the state that it starts from in the plane, with the equations that it has there.

    Payloads, patches, damping and raised masses are those of the planar bodies. Stage 1 tells `watcher`.

    Raises `InputError` and `SolveError` as the analysis itself does, and for what space cannot say.
    """
    if scene.geometric_stiffening:
        raise InputError(
            f"{scene.path}: geometric_stiffening: expected false of a scene exported as an FMU, whose points move by"
            f" the modes alone, found {str(scene.geometric_stiffening).lower()}: not available yet"
        )
    solution = prepare(_with_all_modes(scene), watcher)
    # What nothing follows need not be said in space; bodies have their payloads.
    unfollowed = scene.model_copy(update={"trajectory": (), "payload": ()})
    mechanism = mechanism_in_space(unfollowed, start_in_space(solution.model))
    bodies = [planar_body_in_space(with_raised_mass(body)) for body in solution.model.bodies]
    model = with_compliance_in_space(build_spatial_model(mechanism, bodies))
    return model, held_unit(model, _voltages(solution, model), solution.links, analysis, AXES)


def _with_all_modes(scene: Scene) -> Scene:
    """With all modes of links that have modes = "auto", which a run would choose by its error."""
    bodies = [body.model_copy(update={"modes": None}) if body.modes == "auto" else body for body in scene.body]
    return scene.model_copy(update={"body": tuple(bodies)})


def _voltages(solution: Solution, model: SpatialModel) -> Iterator[Input]:
    for name, array in solution.patches.items():
        raised = np.sqrt(mass_factors(solution.model.body(name)))
        for k, forces in enumerate(array.Phi_V.T, 1):
            direction = np.zeros(model.tree.n_v)
            direction[model.tree.nodes[model.tree.index[name]].p_v] = forces / raised
            yield voltage(name, k), direction
