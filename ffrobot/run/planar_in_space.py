"""The internal switch: planar scenes solved as scenes in space, where the core finds their plane again.

Records are those in space, bodies those of the plane with their payloads, patches and damping. Users do not see it.
"""

from __future__ import annotations

from ..actuation.control.closed_loop import ClosedLoop
from ..actuation.control.spatial_closed_loop import SpatialClosedLoop
from ..actuation.patches.spatial_records import SpatialPztLayout
from ..common.errors import InputError
from ..mbs.model.planar_body_in_space import planar_body_in_space
from ..mbs.scene.in_space.keys import given_keys, load_keys
from ..mbs.scene.in_space.mechanism import mechanism_in_space
from ..mbs.scene.spatial.loads import SpatialLoad
from ..mbs.solve.start_in_space import start_in_space
from ..scene.kinds import AnyKind, AnyKindInSpace
from ..scene.scene import Scene
from ..scene.spatial import SpatialScene
from .prepare import prepare
from .solution import Solution
from .spatial import run_spatial
from .spatial_actuation import patches_in_space
from .spatial_bodies import LoadedSpatialBody
from .spatial_prepare import made_solution
from .spatial_solution import SpatialSolution
from .watcher import Watcher


def solve_planar_in_space(scene: Scene, watcher: Watcher | None = None) -> SpatialSolution:
    """Every analysis of a planar scene, in space.

    Raises `InputError` for what cannot be said or done in space, and as `solve` and `solve_spatial` do.
    """
    watcher = watcher or Watcher()
    planar = prepare(scene, watcher)
    if refused := [f"{scene.path}: {problem}" for problem in _lacks(scene, planar)]:
        raise InputError("\n".join(refused))
    in_space = scene_in_space(planar)
    bodies = {body.name: _body(planar, body.name) for body in scene.body}
    solution = made_solution(in_space, bodies, patches_in_space(in_space, bodies), {"bodies": 0.0}, {})
    return run_spatial(solution, watcher)


def scene_in_space(planar: Solution) -> SpatialScene:
    """The records of a prepared planar scene in space; joints start where they do in the plane."""
    scene = planar.scene
    mechanism = mechanism_in_space(scene.model_copy(update={"payload": ()}), start_in_space(planar.model))
    return SpatialScene.model_construct(
        **dict(mechanism),
        pzt=tuple(SpatialPztLayout(**given_keys(layout)) for layout in scene.pzt),
        analysis=tuple(_analysis(analysis) for analysis in scene.analysis),
    )


def _lacks(scene: Scene, planar: Solution) -> list[str]:
    """What bodies of the plane leave open of scenes in space."""
    found = [f'actuation_points "{of.body}": components are those of the plane' for of in scene.actuation_points]
    found += [f'body "{body.name}": modes: "auto" needs modes in space' for body in scene.body if body.modes == "auto"]
    found += [f'body "{body.name}": pieces need 3D links' for body in scene.body if body.pieces is not None]
    if planar.stiffened or scene.geometric_stiffening == "auto":
        found.append("geometric_stiffening: that of planar bodies is not carried into space")
    if any(analysis.is_checked for analysis in scene.analysis):
        found.append('check: "finer" needs 3D links')
    return found


def _analysis(analysis: AnyKind) -> AnyKindInSpace:
    if not isinstance(analysis, ClosedLoop):
        return analysis
    loads = tuple(SpatialLoad(**load_keys(given_keys(load))) for load in analysis.disturbance)
    return SpatialClosedLoop(**given_keys(analysis) | {"disturbance": loads})


def _body(planar: Solution, name: str) -> LoadedSpatialBody:
    loaded = planar.bodies[name]
    spatial = planar_body_in_space(planar.model.body(name))
    return LoadedSpatialBody(
        spatial=spatial, carrying=spatial, modal=loaded.modal,
        path=loaded.path, computed=loaded.computed, reused=loaded.reused,
    )  # fmt: skip
