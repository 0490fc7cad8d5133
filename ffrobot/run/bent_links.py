"""How far links bend, those in pieces as one link each, and whether they can be divided."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from ..common.errors import InputError
from ..mbs.quantities.second_order import Missing
from ..mbs.quantities.validity import Bending
from ..scene.pieces import BodyInPieces


def worst_of_pieces(bending: Mapping[str, Bending], divided: Mapping[str, BodyInPieces]) -> dict[str, Bending]:
    """How far links bend, each divided one as its piece whose results are worst."""
    link_of = {piece: name for name, body in divided.items() for piece in body.names}
    worst: dict[str, Bending] = {}
    for piece, found in bending.items():
        name = link_of.get(piece, piece)
        if name not in worst or found.position_error > worst[name].position_error:
            worst[name] = found
    return {
        name: replace(found, pieces=len(divided[name].names)) if name in divided else found
        for name, found in worst.items()
    }


def shared_in_motion(bending: Mapping[str, Bending]) -> dict[str, Bending]:
    """How far links bend, none with smaller errors than the worst: what one does wrong moves and loads all others."""
    missing = [of.missing for of in bending.values()] or [Missing(0.0, 0.0)]
    worst = Missing(*(max(errors) for errors in zip(*missing, strict=True)))
    return {name: replace(of, missing=of.missing.grown_to(worst)) for name, of in bending.items()}


def with_advice(
    bending: Mapping[str, Bending], divided: Callable[[Mapping[str, int]], Mapping[str, BodyInPieces]]
) -> dict[str, Bending]:
    """How far links bend, those beyond small deformations with whether the scene lets them be divided.

    `divided` cuts bodies into so many pieces, and raises `InputError` where the scene does not let it.
    """

    def is_divisible(name: str) -> bool:
        try:
            return bool(divided({name: 2}))
        except InputError:
            return False

    return {
        name: replace(found, is_divisible=is_divisible(name)) if found.is_beyond else found
        for name, found in bending.items()
    }
