"""Everything of a scene but its analyses: equations of its bodies, of links in pieces too."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from ..actuation.points import PointSet, with_points
from ..common.errors import InputError
from ..mbs.linear.vibration import with_robot_damping
from ..mbs.model.body import Body
from ..mbs.model.build import build_model
from ..mbs.model.model import Model
from ..mbs.posture.branches import chosen_start
from ..scene.pieces import BodyInPieces, bodies_in_pieces, scene_of_pieces
from ..scene.scene import Scene
from .actuation import given_voltages, make_patches, points_3d
from .bodies import LoadedBody, load_bodies, robot_damping_ratios, with_structure
from .mode_choice import mode_levels
from .solution import Solution
from .watcher import Watcher

if TYPE_CHECKING:
    from ..actuation.patches.link_patches import LinkPatches

Bodies = Mapping[str, LoadedBody]


def made_solution(scene: Scene, bodies: Bodies, seconds: Mapping[str, float]) -> Solution:
    """A solution without analyses, of links with as few modes as the scene begins with.

    Raises `InputError` for patches and actuation points that do not fit.
    """
    bodies = _with_equations(bodies, mode_levels(scene, bodies)[0])
    patches, points, stiffened = make_patches(scene, bodies), points_3d(scene, bodies), _all_stiffened(scene, False)
    bodies = _with_points(bodies, points)
    model = _model(scene, bodies, patches, {}, {}, stiffened)
    if (start := chosen_start(model)) is not None:
        own = {"joints": start.guesses, "angles": {}, "branch": {}}
        scene = scene.model_copy(update={"initial": scene.initial.model_copy(update=own)})
        model = _model(scene, bodies, patches, {}, {}, stiffened)
    return Solution(scene, model, bodies, patches, points=points, stiffened=stiffened, seconds=seconds)


def with_bodies(solution: Solution, spatial: Mapping[str, Body]) -> Solution:
    """The scene with some of its bodies replaced, nothing solved yet. Raises `InputError` as `made_solution`."""
    scene, divided = solution.scene, solution.divided
    bodies, parts = (_with_equations(of, spatial) for of in (solution.bodies, solution.parts))
    made, points = make_patches(scene, bodies), points_3d(scene, bodies)
    patches = {name: solution.patches[name] if name in divided else of_link for name, of_link in made.items()}
    bodies, parts = (_with_points(of, points) for of in (bodies, parts))
    return _unsolved(replace(solution, bodies=bodies, parts=parts, patches=patches, points=points))


def _with_equations(bodies: Bodies, spatial: Mapping[str, Body]) -> Bodies:
    return {name: replace(body, spatial=spatial.get(name, body.spatial)) for name, body in bodies.items()}


def _with_points(bodies: Bodies, points: Mapping[str, PointSet]) -> Bodies:
    return {
        name: replace(body, spatial=with_points(body.spatial, points[name])) if name in points else body
        for name, body in bodies.items()
    }


def with_scene(solution: Solution, scene: Scene) -> Solution:
    """Return the same bodies in a scene with other trajectories or analyses, not solved yet."""
    return _unsolved(replace(solution, scene=scene))


def with_pieces(solution: Solution, counts: Mapping[str, int], watcher: Watcher) -> Solution:
    """Divide the named bodies into the given numbers of pieces; returned unsolved, with equations of the pieces."""
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
        new = scene.model_copy(update=alone | may_be)
        loaded = load_bodies(new, watcher.stage)
        parts = own | {body.name: part for body, part in zip(new.body, loaded, strict=True)}
        parts = {body.name: parts[body.name] for body in scene.body}
    for name in divided.keys() & patches.keys():
        patches[name] = _on_pieces(solution, divided[name], patches[name], parts)
        for piece, start in zip(divided[name].names, divided[name].cut.starts, strict=True):
            length = parts[piece].spatial.length or 0.0
            placed = [one for _, one in patches[name].placed_on(start, length)]
            parts[piece] = with_structure(parts[piece], placed)
    return _unsolved(replace(solution, divided=divided, parts=parts, patches=patches))


def _on_pieces(solution: Solution, body: BodyInPieces, patches: LinkPatches, parts: Bodies) -> LinkPatches:
    from ..actuation.patches.link_patches import on_pieces

    link, pieces = solution.bodies[patches.body].modal, [parts[name].modal for name in body.names]
    assert link is not None
    starts = {
        name: (start, piece)
        for name, start, piece in zip(body.names, body.cut.starts, pieces, strict=True)
        if piece is not None
    }
    return on_pieces(solution.scene.path, patches, link, starts)


def with_stiffening(solution: Solution) -> Solution:
    """The scene with geometric stiffening of all links, nothing solved yet."""
    return _unsolved(replace(solution, stiffened=True))


def _unsolved(solution: Solution) -> Solution:
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
    patches: Mapping[str, LinkPatches],
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
        known = set() if scene.geometric_stiffening is False else _known_between(scene, spatial, links)
        spatial |= {name: replace(body, stiffening=None) for name, body in spatial.items() if name not in known}
    model = build_model(scene, list(spatial.values()))
    model = with_robot_damping(model, robot_damping_ratios(bodies))
    return replace(model, modal_loads=tuple(given_voltages(scene, model, patches)))


def _known_between(scene: Scene, bodies: Mapping[str, Body], links: Iterable[tuple[str, ...]]) -> set[str]:
    """Bodies of those `links` in pieces on which nothing acts between the ends of a piece.

    Modal body files have the geometric stiffness of loads at interfaces alone.
    """
    at = [point for reference in scene.references() if (point := reference.body_and_point) is not None]
    between = {
        body
        for body, point in at
        if (stiffening := bodies[body].stiffening) is not None and point not in stiffening.K_points
    }
    return {name for names in links if between.isdisjoint(names) for name in names}


def check_replays(solution: Solution) -> None:
    """Raise `InputError` where `check` would simulate robots for which nothing does that."""
    scene, motors = solution.scene, solution.model.motors
    is_compliant = any(getattr(joint, "stiffness", None) is not None for joint in scene.joint)
    for analysis in scene.analysis:
        if analysis.is_checked and (is_compliant or not motors):
            raise InputError(
                f'{scene.path}: analysis "{analysis.name}": check: expected motors, and joints without stiffness, for'
                ' "finer"'
            )
