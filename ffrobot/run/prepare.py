"""Everything of a scene but its analyses: equations of its bodies, of links in pieces too."""

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..actuation.points import PointSet, with_points
from ..common.errors import naming
from ..mbs.linear.vibration import with_robot_damping
from ..mbs.model.body import Body
from ..mbs.model.build import build_model
from ..mbs.model.model import Model
from ..mbs.posture.branches import chosen_start
from ..scene.load import load_scene
from ..scene.pieces import BodyInPieces, bodies_in_pieces, scene_of_pieces
from ..scene.scene import Scene
from .actuation import given_voltages, make_patches, points_3d
from .bodies import LoadedBody, links_of, load_bodies, with_structure
from .mode_search import mode_levels
from .result import Solution
from .watcher import Watcher

if TYPE_CHECKING:
    from ..actuation.patches.link_patches import LinkPatches

Bodies = Mapping[str, LoadedBody]


def prepare_scene(scene: Scene | Path, watcher: Watcher | None = None) -> Solution:
    """Bodies and equations of a scene, or a scene file, without results; with `modes = "auto"`, of the fewest modes.

    Raises `InputError` for anything wrong with the scene or the files it names.
    """
    watcher = watcher or Watcher()
    if isinstance(scene, Path):
        scene = load_scene(scene)
    began = time.perf_counter()
    loaded = load_bodies(scene, watcher.stage)
    seconds = {"links and files": time.perf_counter() - began}
    bodies = _with_equations(loaded, mode_levels(scene, loaded)[0])
    patches, points, stiffened = make_patches(scene, bodies), points_3d(scene, bodies), _all_stiffened(scene, False)
    bodies = _with_points(bodies, points)
    model = _model(scene, bodies, patches, {}, {}, stiffened)
    if (start := chosen_start(model)) is not None:
        own = {"joints": start.guesses, "angles": {}, "branch": {}}
        scene = scene.model_copy(update={"initial": scene.initial.model_copy(update=own)})
        model = _model(scene, bodies, patches, {}, {}, stiffened)
    solution = Solution(scene, model, bodies, patches, points=points, stiffened=stiffened, seconds=seconds)
    counts = {body.name: 1 if body.pieces == "auto" else body.pieces for body in scene.body if body.pieces is not None}
    return with_pieces(solution, counts, watcher)


def with_bodies(solution: Solution, spatial: Mapping[str, Body]) -> Solution:
    """The scene with bodies `spatial` in place of its own, without results. Raises `InputError` as `prepare_scene`."""
    scene, divided = solution.scene, solution.divided
    bodies, parts = (_with_equations(of, spatial) for of in (solution.bodies, solution.parts))
    made, points = make_patches(scene, bodies), points_3d(scene, bodies)
    patches = {name: solution.patches[name] if name in divided else of_link for name, of_link in made.items()}
    bodies, parts = (_with_points(of, points) for of in (bodies, parts))
    return unsolved(replace(solution, bodies=bodies, parts=parts, patches=patches, points=points))


def _with_equations(bodies: Bodies, spatial: Mapping[str, Body]) -> Bodies:
    return {name: replace(body, spatial=spatial.get(name, body.spatial)) for name, body in bodies.items()}


def _with_points(bodies: Bodies, points: Mapping[str, PointSet]) -> Bodies:
    return {
        name: replace(body, spatial=with_points(body.spatial, points[name])) if name in points else body
        for name, body in bodies.items()
    }


def with_pieces(solution: Solution, counts: Mapping[str, int], watcher: Watcher) -> Solution:
    """Divide bodies into `counts` pieces, by name; returned without results, with equations of the pieces."""
    divided = bodies_in_pieces(solution.scene, counts)
    if not divided and not solution.divided:
        return solution
    parts: dict[str, LoadedBody] = {}
    patches = dict(solution.patches)
    if divided:
        scene = scene_of_pieces(solution.scene, divided)
        own = {name: body for name, body in solution.bodies.items() if name not in divided}
        alone = {"body": tuple(body for body in scene.body if body.name not in own), "pzt": ()}
        may_be = {"geometric_stiffening": scene.geometric_stiffening is not False}
        loaded = own | load_bodies(scene.model_copy(update=alone | may_be), watcher.stage)
        parts = {body.name: loaded[body.name] for body in scene.body}
    for name in divided.keys() & patches.keys():
        from ..actuation.patches.link_patches import on_pieces

        links, starts = links_of(parts), dict(zip(divided[name].names, divided[name].cut.starts, strict=True))
        pieces = {piece: (start, links[piece]) for piece, start in starts.items()}
        with naming(solution.scene.path):
            patches[name] = on_pieces(patches[name], solution.links[name], pieces)
        for piece, start in starts.items():
            on_piece = [one for _, one in patches[name].placed_on(start, parts[piece].spatial.length or 0.0)]
            parts[piece] = with_structure(parts[piece], on_piece)
    return unsolved(replace(solution, divided=divided, parts=parts, patches=patches))


def unsolved(solution: Solution) -> Solution:
    """The solution without results, with new equations from its scene, bodies and `stiffened`."""
    stiffened = _all_stiffened(solution.scene, solution.stiffened)
    scene, bodies, patches = solution.scene, solution.bodies, solution.patches
    model, divided = _model(scene, bodies, patches, solution.divided, solution.parts, stiffened), solution.divided
    whole = _model(scene, bodies, patches, {}, {}, stiffened) if divided else None
    seconds = {"links and files": solution.seconds["links and files"]}
    return replace(solution, model=model, whole=whole, analyses={}, seconds=seconds, stiffened=stiffened)


def _all_stiffened(scene: Scene, is_needed: bool) -> bool:
    """Whether all links are stiffened; with "auto" where that `is_needed`; in the plane beside links in pieces, too."""
    in_pieces = any(body.pieces is not None for body in scene.body)
    if scene.geometric_stiffening == "auto":
        return is_needed or in_pieces
    return scene.geometric_stiffening is True or (scene.is_planar and in_pieces)


def _model(
    scene: Scene,
    bodies: Bodies,
    patches: "Mapping[str, LinkPatches]",
    divided: Mapping[str, BodyInPieces],
    parts: Bodies,
    stiffened: bool,
) -> Model:
    """The equations, of pieces in place of their links, with the voltages that the scene gives to patches."""
    heavy = {layout.body for layout in scene.pzt if layout.adds_mass}  # between the ends of pieces
    links = [
        divided[body.name].names if body.name in divided else (body.name,)
        for body in scene.body
        if body.pieces and body.name not in heavy
    ]
    if divided:
        scene, bodies = scene_of_pieces(scene, divided), parts
    spatial = {name: body.spatial for name, body in bodies.items()}
    if not stiffened:
        between = set(spatial)  # loaded there, where files have no geometric stiffness
        if scene.geometric_stiffening is not False:
            at = [point for reference in scene.references() if (point := reference.body_and_point) is not None]
            between = {
                name
                for name, point in at
                if (stiffening := spatial[name].stiffening) is not None and point not in stiffening.K_points
            }
        known = {name for names in links if between.isdisjoint(names) for name in names}
        spatial |= {name: replace(body, stiffening=None) for name, body in spatial.items() if name not in known}
    ratios = {
        name: float(modal.damping_ratio[0])
        for name, body in bodies.items()
        if (modal := body.modal) is not None and modal.damping_of == "robot"
    }
    model = with_robot_damping(build_model(scene, list(spatial.values())), ratios)
    return replace(model, modal_loads=tuple(given_voltages(scene, model, patches)))
