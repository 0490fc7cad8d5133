"""Scenes in space with links in pieces: the same scene with a body for each piece, welded to the next.

As in the plane (`pieces.py`), what computes motions gets the scene of pieces; `ffrobot.run.spatial_pieces` tells of the
one link.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ..common.errors import InputError
from ..fe_models.link_records import FAMILIES
from ..fe_models.pieces import cut
from ..mbs.joints.spatial.weld import SpatialWeld
from ..mbs.scene.spatial.bodies import BodyInSpace
from ..mbs.scene.spatial.mechanism import SpatialMechanismKeys
from .pieces import BodyInPieces, places_on_pieces, renamed, unfit_actuators, unfit_references, welds_between
from .spatial import SpatialScene


def bodies_in_pieces_in_space(scene: SpatialScene, counts: Mapping[str, int]) -> dict[str, BodyInPieces]:
    """The bodies of a scene with the key `pieces` that are cut in more than one, by name; `counts` of all of them.

    Raises `InputError` where a link or the scene allows no pieces.
    """
    found = {}
    for body in scene.body:
        if body.link is not None and body.name in counts:
            names = tuple(f"{body.name}, piece {k}" for k in range(1, counts[body.name] + 1))
            found[body.name] = BodyInPieces(cut(body.link, counts[body.name], FAMILIES), names)
    problems = [f"{scene.path}: {problem}" for problem in _problems(scene, found)]
    if problems:
        raise InputError("\n".join(problems))
    return {name: body for name, body in found.items() if len(body.names) > 1}


def scene_of_pieces_in_space(scene: SpatialScene, divided: Mapping[str, BodyInPieces]) -> SpatialScene:
    """The scene in which each piece is a body; points that scene and analyses name are those of the pieces."""
    places = places_on_pieces(divided)
    keys = {
        name: renamed(getattr(scene, name), places) for name in ("joint", "trajectory", "load", "payload", "analysis")
    }
    bodies = tuple(piece for body in scene.body for piece in _pieces(body, divided))
    welds = (
        SpatialWeld(name=weld, type="weld", between=between)
        for name, body in divided.items()
        for weld, between in welds_between(name, body)
    )
    return scene.model_copy(update=keys | {"body": bodies, "joint": (*keys["joint"], *welds)})


def _pieces(body: BodyInSpace, divided: Mapping[str, BodyInPieces]) -> Iterator[BodyInSpace]:
    if body.name not in divided:
        yield body
        return
    pieces = divided[body.name]
    for name, link in zip(pieces.names, pieces.cut.tables, strict=True):
        yield body.model_copy(update={"name": name, "link": link, "pieces": None})


def _problems(scene: SpatialScene, divided: Mapping[str, BodyInPieces]) -> Iterator[str]:
    """What cannot be had together with links in pieces."""
    if not divided:
        return
    first = next(iter(divided))
    beside = f'with subdivided bodies ("{first}")'
    yield from unfit_actuators((points.body for points in scene.actuation_points), scene.motors, first)
    for analysis in scene.analysis:
        if analysis.is_checked:
            yield f'analysis "{analysis.name}": check: expected none {beside}, found one'
    for joint in scene.joint:
        if getattr(joint, "stiffness", None) is not None:
            yield f'joint "{joint.name}": stiffness: expected none {beside}, found one'
    yield from unfit_references(SpatialMechanismKeys.references(scene), divided)
