"""Everything of a scene but its analyses: bodies, patches, equations."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ..actuation.patches.patches import check_reach, patch_array
from ..actuation.patches.structure import StructureEffect
from ..actuation.points import point_set, with_points
from ..common.errors import InputError, of_file
from ..mbs.model.model import build_model
from ..mbs.model.planar_body import PlanarBody
from ..mbs.solve.robot_damping import with_robot_damping
from ..scene.load import load_scene
from ..scene.pieces import BodyInPieces, bodies_in_pieces, scene_of_pieces
from ..scene.scene import Scene
from .bodies import LoadedBody, add_patches, load_bodies
from .divided import patched_pieces, patches_on_pieces, voltage_loads
from .loaded_body import robot_damping_ratios
from .mode_choice import mode_levels
from .omissions import omissions
from .solution import Solution
from .watcher import Watcher


def prepare(scene: Scene | Path, watcher: Watcher | None = None) -> Solution:
    """A solution without analyses; stage 1 runs for links that are not up to date.

    Raises `InputError` for anything wrong with the scene or the files it names.
    """
    watcher = watcher or Watcher()
    began = time.perf_counter()
    if not isinstance(scene, Scene):
        scene = load_scene(scene)
    with of_file(scene.path):
        return _prepared(scene, watcher, began)


def _prepared(scene: Scene, watcher: Watcher, began: float) -> Solution:
    bodies = {body.name: loaded for body, loaded in zip(scene.body, load_bodies(scene, watcher.stage), strict=True)}
    seconds = {"links and files": time.perf_counter() - began}
    structure = add_patches(scene, bodies)
    first = mode_levels(scene, bodies)[0]
    bodies = {name: replace(body, planar=first.get(name, body.planar)) for name, body in bodies.items()}
    counts = {body.name: 1 if body.pieces == "auto" else body.pieces for body in scene.body if body.pieces is not None}
    is_stiffened = bool(counts) or scene.geometric_stiffening is True
    solution = _assembled(scene, bodies, structure, seconds, stiffened=is_stiffened)
    return with_pieces(solution, counts, watcher)


def with_pieces(solution: Solution, counts: Mapping[str, int], watcher: Watcher) -> Solution:
    """The scene with the bodies named in so many pieces each, nothing solved yet: equations are those of the pieces."""
    divided = bodies_in_pieces(solution.scene, counts)
    whole = solution if solution.whole is None else replace(solution, model=solution.whole)
    if not divided:
        return replace(whole, analyses={}, divided={}, parts={}, whole=None, on_pieces={})
    scene = scene_of_pieces(solution.scene, divided)
    loaded = load_bodies(scene, watcher.stage)
    parts = {body.name: part for body, part in zip(scene.body, loaded, strict=True)}
    parts |= {name: body for name, body in whole.bodies.items() if name in parts}  # with their patches
    for layout in solution.scene.pzt:
        if layout.body in divided:
            length = whole.bodies[layout.body].planar.length or 0.0
            parts |= patched_pieces(layout, length, divided[layout.body], parts)
    return _in_pieces(replace(whole, analyses={}), divided, parts)


def _in_pieces(whole: Solution, divided: Mapping[str, BodyInPieces], parts: Mapping[str, LoadedBody]) -> Solution:
    """The solution with the equations of the pieces in place of those of their links."""
    if not divided:
        return whole
    planar = [_equations_of(part, whole.stiffened) for part in parts.values()]
    arrays = patches_on_pieces(whole.scene.path, whole.patches, whole.bodies, divided, parts)
    loads = list(voltage_loads(whole.scene, {**whole.patches, **arrays}, {body.name: body for body in planar}))
    model = build_model(scene_of_pieces(whole.scene, divided), planar, loads)
    model = with_robot_damping(model, robot_damping_ratios(parts))
    return replace(whole, model=model, whole=whole.model, divided=divided, parts=parts, on_pieces=arrays)


def _equations_of(body: LoadedBody, stiffened: bool) -> PlanarBody:
    return body.planar if stiffened else replace(body.planar, stiffening=None)


def with_bodies(solution: Solution, planar: Mapping[str, PlanarBody]) -> Solution:
    """The scene with some of its bodies replaced, nothing solved yet."""
    bodies = {name: replace(b, planar=planar.get(name, b.planar)) for name, b in solution.bodies.items()}
    return _assembled(solution.scene, bodies, solution.structure, solution.preparation, solution.stiffened)


def with_scene(solution: Solution, scene: Scene) -> Solution:
    """The same bodies in a scene with other trajectories or analyses, nothing solved yet."""
    found = _assembled(scene, solution.bodies, solution.structure, solution.preparation, solution.stiffened)
    return _in_pieces(found, solution.divided, solution.parts)


def stiffened(solution: Solution) -> Solution:
    """The scene with geometric stiffening, nothing solved yet."""
    whole = _assembled(solution.scene, solution.bodies, solution.structure, solution.preparation, stiffened=True)
    return _in_pieces(whole, solution.divided, solution.parts)


def _assembled(
    scene: Scene,
    bodies: Mapping[str, LoadedBody],
    structure: Mapping[str, StructureEffect],
    preparation: Mapping[str, float],
    stiffened: bool,
) -> Solution:
    """The equations of a scene, with or without geometric stiffening."""
    _check_stiffening(scene, bodies, stiffened)
    patches = {
        layout.body: patch_array(scene.path, layout, modal, bodies[layout.body].planar)
        for layout in scene.pzt
        if (modal := bodies[layout.body].modal) is not None
    }
    if any(analysis.allocates_patches for analysis in scene.analysis) and scene.trajectory:
        for array in patches.values():
            check_reach(scene.path, array)
    points = {
        layout.body: point_set(scene.path, layout, bodies[layout.body].modal, bodies[layout.body].planar)
        for layout in scene.actuation_points
    }
    bodies = {
        name: replace(body, planar=with_points(body.planar, points[name])) if name in points else body
        for name, body in bodies.items()
    }
    planar = [_equations_of(body, stiffened) for body in bodies.values()]
    loads = list(voltage_loads(scene, patches, {body.name: body for body in planar}))
    return Solution(
        scene=scene,
        model=with_robot_damping(build_model(scene, planar, loads), robot_damping_ratios(bodies)),
        bodies=bodies,
        patches=patches,
        points=points,
        structure=structure,
        preparation=preparation,
        omissions=tuple(omissions(scene, bodies)),
        stiffened=stiffened,
    )


def _check_stiffening(scene: Scene, bodies: Mapping[str, LoadedBody], stiffened: bool) -> None:
    """Raise `InputError` for a stiffened body whose file does not say how."""
    for name, body in bodies.items():
        if stiffened and body.modal is not None and body.planar.stiffening is None:
            raise InputError(
                f"{scene.path}: geometric_stiffening: expected modal bodies with geometric stiffness, found none in"
                f' that of "{name}"'
            )
