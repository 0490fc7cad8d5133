"""A body of a scene as it is loaded: its equations, its modal body, and the payloads on it."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeVar

from ..actuation.patches.structure import StructureEffect
from ..common.errors import InputError, did_you_mean, quoted
from ..fe_models.link_records import FAMILIES, Family
from ..fe_models.modal_body import ModalBody
from ..mbs.fields.field_types import split_point
from ..mbs.model.body import Body


@dataclass(frozen=True, kw_only=True)
class LoadedBody:
    """A body of the scene.

    Attributes:
        spatial: its equations in space, in which payloads with inertia on links are bodies of their own.
        carrying: with these as well, as small rotations turn them: its modes are those of the loaded link.
        structure: what patches that are part of it change.
        modal, path: its modal body and the file of that, None where it is rigid.
        computed, reused: whether stage 1 ran for it, and why not.
        motions: the families of motion that the scene can ask of a link.
    """

    spatial: Body
    carrying: Body
    structure: StructureEffect | None = None
    modal: ModalBody | None = None
    path: Path | None = None
    computed: bool = False
    reused: str = ""
    motions: tuple[Family, ...] = FAMILIES

    @property
    def file_hash(self) -> str:
        """SHA-256 of the modal body file; empty where rigid."""
        return hashlib.sha256(self.path.read_bytes()).hexdigest() if self.path else ""

    @property
    def rigid_in(self) -> tuple[Family, ...]:
        """Motions that a link cannot follow, since its file has no modes of them; none of a rigid body."""
        return () if self.modal is None else tuple(one for one in self.motions if one not in self.modal.family)


IN_PLANE: tuple[Family, ...] = ("in-plane-bending",)
"""Of planar scenes; stretch: see `omissions`."""


def robot_damping_ratios(bodies: Mapping[str, LoadedBody]) -> dict[str, float]:
    """By body: ζ of the links that want it of the robot's vibrations."""
    return {
        name: float(modal.damping_ratio[0])
        for name, body in bodies.items()
        if (modal := body.modal) is not None and modal.damping_of == "robot"
    }


def remarks_on_parts(bodies: Mapping[str, LoadedBody]) -> list[str]:
    """What the files of solid links' parts hold and the links do not, a line each."""
    return [f"{name}: {text}" for name, body in bodies.items() if body.modal for text in body.modal.remarks]


def rigid_in_words(bodies: Mapping[str, LoadedBody]) -> list[str]:
    """Which links are rigid in which motions, a line each."""
    return [
        f"{name}: rigid in {', '.join(body.rigid_in)}, of which its file has no modes"
        for name, body in bodies.items()
        if body.rigid_in
    ]


class _OnPoint(Protocol):
    @property
    def point(self) -> str:
        """Where it sits, "BODY.POINT"."""


P = TypeVar("P", bound=_OnPoint)


def records_on(
    kind: str, records: Iterable[P], body: str, points: Collection[str], scene: Path
) -> Iterator[tuple[str, P]]:
    """Payloads or tools (`kind`) of a body with their points. Raises `InputError` for a point that it does not have."""
    for record in records:
        name, point = split_point(record.point)
        if name != body:
            continue
        if point not in points:
            raise InputError(
                f'{scene}: {kind}: point: expected a point of "{name}" ({quoted(points)}), found'
                f' "{record.point}"{did_you_mean(point, points)}'
            )
        yield point, record
