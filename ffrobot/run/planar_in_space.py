"""The internal switch: planar scenes solved as scenes in space, where the core finds their plane again.

Records are those in space, bodies those of the plane with their payloads, patches and damping. Users do not see it.
"""

from __future__ import annotations

from ..actuation.control.closed_loop import ClosedLoop
from ..actuation.control.spatial_closed_loop import SpatialClosedLoop
from ..actuation.patches.spatial_records import SpatialPztLayout
from ..common.errors import InputError
from ..mbs.scene.in_space.keys import given_keys, load_keys
from ..mbs.scene.in_space.mechanism import mechanism_in_space
from ..mbs.scene.spatial.loads import SpatialLoad
from ..mbs.solve.start_in_space import start_in_space
from ..scene.kinds import AnyKind, AnyKindInSpace
from ..scene.scene import Scene
from ..scene.spatial import SpatialScene
from .prepare import prepare
from .solution import Solution
from .spatial import solve_spatial
from .spatial_solution import SpatialSolution
from .watcher import Watcher


def solve_planar_in_space(scene: Scene, watcher: Watcher | None = None) -> SpatialSolution:
    """Every analysis of a planar scene, in space.

    Raises `InputError` for what cannot be said or done in space, and as `solve` and `solve_spatial` do.
    """
    watcher = watcher or Watcher()
    if refused := [f"{scene.path}: {problem}" for problem in _lacks(scene)]:
        raise InputError("\n".join(refused))
    return solve_spatial(scene_in_space(prepare(scene, watcher)), watcher)


def scene_in_space(planar: Solution) -> SpatialScene:
    """The records of a prepared planar scene in space; joints start where they do in the plane."""
    scene = planar.scene
    return SpatialScene.model_construct(
        **dict(mechanism_in_space(scene, start_in_space(planar.model))),
        pzt=tuple(SpatialPztLayout(**given_keys(layout)) for layout in scene.pzt),
        analysis=tuple(_analysis(analysis) for analysis in scene.analysis),
    )


def _lacks(scene: Scene) -> list[str]:
    """What records of scenes in space leave open."""
    return [f'actuation_points "{of.body}": components are those of the plane' for of in scene.actuation_points]


def _analysis(analysis: AnyKind) -> AnyKindInSpace:
    if not isinstance(analysis, ClosedLoop):
        return analysis
    loads = tuple(SpatialLoad(**load_keys(given_keys(load))) for load in analysis.disturbance)
    return SpatialClosedLoop(**given_keys(analysis) | {"disturbance": loads})
