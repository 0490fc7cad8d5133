"""Scenes with links in pieces: the same scene with a body for each piece, welded to the next.

Everything that computes motions gets the scene of pieces, everything that reports them the one link
(`ffrobot.run.pieces`): in between, nothing knows of pieces.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from ..common.errors import InputError
from ..common.validation import Record
from ..fe_models.pieces import CutLink, cut
from ..mbs.fields.references import Reference
from ..mbs.joints.weld import WeldJoint
from ..mbs.scene.bodies import Body
from ..mbs.scene.mechanism import MechanismKeys
from .scene import Scene

KINDS = ("pcid", "forward", "static", "linear", "closed-loop")
"""Kinds of analysis that links in pieces can take part in: the others prescribe the modes of a link, or place patches
for these."""


@dataclass(frozen=True)
class BodyInPieces:
    """How a body of a scene is cut, and the names of its pieces as bodies, from the root to the tip."""

    cut: CutLink
    names: tuple[str, ...]

    def point(self, label: str) -> str:
        """Where one of its points is, as PIECE.POINT."""
        piece, name = self.cut.places[label]
        return f"{self.names[piece]}.{name}"


def bodies_in_pieces(scene: Scene, counts: Mapping[str, int]) -> dict[str, BodyInPieces]:
    """The bodies of a scene with the key `pieces` that are cut in more than one, by name; `counts` of all of them.

    Raises `InputError` where a link or the scene allows no pieces.
    """
    found = {}
    for body in scene.body:
        if body.link is not None and body.name in counts:
            names = tuple(f"{body.name}, piece {k}" for k in range(1, counts[body.name] + 1))
            found[body.name] = BodyInPieces(cut(body.link, counts[body.name]), names)
    problems = [f"{scene.path}: {problem}" for problem in _problems(scene, found)]
    if problems:
        raise InputError("\n".join(problems))
    return {name: body for name, body in found.items() if len(body.names) > 1}


def scene_of_pieces(scene: Scene, divided: Mapping[str, BodyInPieces]) -> Scene:
    """The scene in which each piece is a body; points that the scene names are those of the pieces."""
    places = places_on_pieces(divided)
    keys = {name: renamed(getattr(scene, name), places) for name in ("joint", "trajectory", "load", "payload")}
    initial = scene.initial.model_copy(
        update={"angles": _of_each(scene.initial.angles, divided), "rates": _of_each(scene.initial.rates, divided)}
    )
    bodies = tuple(piece for body in scene.body for piece in _pieces(body, divided))
    welds = (
        WeldJoint(name=weld, type="weld", between=between)
        for name, body in divided.items()
        for weld, between in welds_between(name, body)
    )
    joints = (*keys["joint"], *welds)
    alone = {"pzt": (), "analysis": ()}  # of the whole links
    return scene.model_copy(update=keys | alone | {"body": bodies, "joint": joints, "initial": initial})


def places_on_pieces(divided: Mapping[str, BodyInPieces]) -> dict[str, str]:
    """Where each point "BODY.POINT" of the bodies in pieces is, as PIECE.POINT."""
    return {f"{name}.{label}": body.point(label) for name, body in divided.items() for label in body.cut.places}


def _pieces(body: Body, divided: Mapping[str, BodyInPieces]) -> Iterator[Body]:
    if body.name not in divided:
        yield body
        return
    pieces = divided[body.name]
    for name, link in zip(pieces.names, pieces.cut.tables, strict=True):
        yield body.model_copy(update={"name": name, "link": link, "pieces": None})


def welds_between(name: str, body: BodyInPieces) -> Iterator[tuple[str, tuple[str, str]]]:
    """Names of the welds between the pieces of a body, and what each joins."""
    for k, (first, second) in enumerate(zip(body.names, body.names[1:], strict=False), 1):
        yield f"{name}, cut {k}", (f"{first}.tip", f"{second}.root")


def _of_each(guesses: Mapping[str, float], divided: Mapping[str, BodyInPieces]) -> dict[str, float]:
    """Guesses for frames, those of a divided body for each of its pieces."""
    return {
        piece: guess
        for name, guess in guesses.items()
        for piece in (divided[name].names if name in divided else (name,))
    }


T = TypeVar("T")


def renamed(value: T, places: Mapping[str, str]) -> T:
    """A record, or several of them, with names of points replaced."""
    new: Any = value
    if isinstance(value, str):
        new = places.get(value, value)
    elif isinstance(value, tuple):
        new = tuple(renamed(entry, places) for entry in value)
    elif isinstance(value, Record):
        new = value.model_copy(update={key: renamed(getattr(value, key), places) for key in value.model_fields_set})
    return new  # type: ignore[no-any-return]


def _problems(scene: Scene, divided: Mapping[str, BodyInPieces]) -> Iterator[str]:
    """What cannot be had together with links in pieces."""
    if not divided:
        return
    first = next(iter(divided))
    yield from unfit_actuators((points.body for points in scene.actuation_points), scene.motors, first)
    for analysis in scene.analysis:
        if analysis.kind not in KINDS:
            yield (
                f'analysis "{analysis.name}": kind: expected one of {", ".join(KINDS)} with subdivided bodies'
                f' ("{first}"), found "{analysis.kind}"'
            )
        if analysis.is_checked:
            yield f'analysis "{analysis.name}": check: expected none with subdivided bodies ("{first}"), found one'
    for joint in scene.joint:
        if joint.elastic_gear("section") is not None:
            yield f'joint "{joint.name}": stiffness: expected none with subdivided bodies ("{first}"), found one'
    references = MechanismKeys.references(scene)
    yield from unfit_references((each for each in references if not each.key.startswith("initial.")), divided)


def unfit_actuators(pointed: Iterable[str], motors: str, first: str) -> Iterator[str]:
    """What acts and cannot do so beside bodies in pieces, of which `first` is one; in the plane and in space.

    `pointed` are bodies with actuation points.
    """
    for body in pointed:
        yield f'actuation_points "{body}": expected none with subdivided bodies ("{first}"), found these'
    if motors == "frame":
        yield f'motors: expected "section" with subdivided bodies ("{first}"), found "frame"'


def unfit_references(references: Iterable[Reference], divided: Container[str]) -> Iterator[str]:
    """References to frames of bodies in pieces; in the plane and in space."""
    for reference in references:
        if reference.kind == "body" and reference.name in divided:
            yield (
                f"{reference.key}: expected a point or a joint where a body is subdivided, whose frame no piece has,"
                f' found "{reference.name}"'
            )
