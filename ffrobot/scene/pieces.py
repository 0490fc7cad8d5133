"""Scenes with links in pieces: the same scene with a body for each piece, welded to the next.

Motions are computed in the scene of pieces; results are of the whole link (`ffrobot.run.pieces`).
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeVar

from ..common.errors import refuse
from ..common.structs import struct
from ..common.validation import Record
from ..fe_models.link_records.families import FAMILIES
from ..mbs.fields.field_types import split_point
from ..mbs.joints.joints import WeldJoint
from ..mbs.scene.bodies import BodyKeys
from ..mbs.scene.mechanism import MechanismKeys
from .scene import Scene

if TYPE_CHECKING:
    from ..fe_models.pieces import CutLink


@struct
class BodyInPieces:
    """Division `cut` of a body's link into pieces, and their `names` as bodies, from root to tip."""

    cut: "CutLink"
    names: tuple[str, ...]

    def point(self, label: str) -> str:
        """Return the point PIECE.POINT where the body's point `label` is."""
        piece, name = self.cut.places[label]
        return f"{self.names[piece]}.{name}"


def bodies_in_pieces(scene: Scene, counts: Mapping[str, int]) -> dict[str, BodyInPieces]:
    """Divide bodies of a scene into pieces, their `counts` by body; bodies in one piece are left out.

    Raises `InputError` where a link or the scene allows no pieces.
    """
    if not counts:
        return {}
    from ..fe_models.pieces import IN_PLANE, cut

    divided, families = {}, IN_PLANE if scene.is_planar else FAMILIES
    for body in scene.body:
        if body.link is not None and body.name in counts:
            names = tuple(f"{body.name}, piece {k}" for k in range(1, counts[body.name] + 1))
            whole = cut(body.link, counts[body.name], families)
            places = dict(whole.places)
            for tool in scene.tool:
                name, point = split_point(tool.point)
                if name == body.name and point in places:
                    places[tool.name] = places[point][0], tool.name
            divided[body.name] = BodyInPieces(replace(whole, places=places), names)
    refuse(_problems(scene, divided), scene.path)
    return {name: body for name, body in divided.items() if len(body.names) > 1}


def scene_of_pieces(scene: Scene, divided: Mapping[str, BodyInPieces]) -> Scene:
    """The scene in which each piece is a body, welded to the next; names of points are those on the pieces."""
    places = places_on_pieces(divided)
    keys = {
        name: _renamed(getattr(scene, name), places)
        for name in ("tool", "joint", "trajectory", "load", "payload", "analysis")
    }
    bodies: list[BodyKeys] = []
    for body in scene.body:
        if body.name in divided:
            tables = zip(divided[body.name].names, divided[body.name].cut.tables, strict=True)
            bodies += [body.model_copy(update={"name": name, "link": link, "pieces": None}) for name, link in tables]
        else:
            bodies.append(body)
    welds = (
        WeldJoint(name=f"{name}, cut {k}", type="weld", between=(f"{first}.tip", f"{second}.root"))
        for name, pieces in divided.items()
        for k, (first, second) in enumerate(pairwise(pieces.names), 1)
    )
    return scene.model_copy(update=keys | {"body": tuple(bodies), "joint": (*keys["joint"], *welds)})


def places_on_pieces(divided: Mapping[str, BodyInPieces]) -> dict[str, str]:
    """Map each point "BODY.POINT" of divided bodies to PIECE.POINT."""
    return {f"{name}.{label}": body.point(label) for name, body in divided.items() for label in body.cut.places}


T = TypeVar("T")


def _renamed(value: T, places: Mapping[str, str]) -> T:
    new: Any = value
    if isinstance(value, str):  # a point, or an input at one, "force/BODY.POINT/x"
        new = "/".join(places.get(part, part) for part in value.split("/"))
    elif isinstance(value, tuple):
        new = tuple(_renamed(entry, places) for entry in value)
    elif isinstance(value, dict):
        new = {_renamed(key, places): _renamed(entry, places) for key, entry in value.items()}
    elif isinstance(value, Record):
        new = value.model_copy(update={key: _renamed(getattr(value, key), places) for key in value.model_fields_set})
    return new


def _problems(scene: Scene, divided: Mapping[str, BodyInPieces]) -> Iterator[str]:
    if not divided:
        return
    beside = f'with subdivided bodies ("{next(iter(divided))}")'
    for points in scene.actuation_points:
        yield f'actuation_points "{points.body}": expected none {beside}, found these'
    if scene.motors == "frame":
        yield f'motors: expected "section" {beside}, found "frame"'
    for analysis in scene.analysis:
        if analysis.is_checked:
            yield f'analysis "{analysis.name}": check: expected none {beside}, found one'
    for joint in scene.joint:
        if getattr(joint, "stiffness", None) is not None:
            yield f'joint "{joint.name}": stiffness: expected none {beside}, found one'
    for reference in MechanismKeys.references(scene):
        if reference.kind == "body" and reference.name in divided:
            yield (
                f"{reference.key}: expected a point or a joint where a body is subdivided, whose frame no piece has,"
                f' found "{reference.name}"'
            )
