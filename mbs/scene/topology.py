"""Which joint carries which body: a spanning forest of the joints, and the joints that close loops."""

from collections.abc import Sequence
from heapq import heappop, heappush
from typing import NamedTuple

from ...common.structs import struct
from ..fields.field_types import GROUND, body_of


class Edge(NamedTuple):
    """A joint `between` two sides ("BODY.POINT" or "ground"); loops are cut at joints of the highest `rank`."""

    between: tuple[str, str]
    rank: int = 0


class Carrier(NamedTuple):
    """Joint that carries a body: its index, its side on the body (`own`), the `other` side."""

    joint: int
    own: str
    other: str

    @property
    def parent(self) -> str:
        """The body, or the ground, on the other side."""
        return body_of(self.other)


@struct
class Topology:
    """Spanning forest of a mechanism, and the joints that close its loops."""

    # by body the joint on the way to the root of its tree, None of a root; each body comes after its parent, trees on
    # the ground first
    carriers: dict[str, Carrier | None]
    loop_joints: tuple[int, ...]  # numbers of the joints that are in no tree: each closes a loop

    @property
    def is_open_chain(self) -> bool:
        """Whether the joints form trees."""
        return not self.loop_joints


def spanning_forest(bodies: Sequence[str], joints: Sequence[Edge]) -> Topology:
    """Return the topology of `joints` between `bodies`: trees from the ground, then from each unconnected body.

    A tree grows by the joint of the lowest rank, the first among equals, of all between it and the rest (Prim, Bell
    Syst. Tech. J. 36, 1957).
    """
    touching: dict[str, list[int]] = {name: [] for name in (GROUND, *bodies)}
    for number, joint in enumerate(joints):
        for side in joint.between:
            touching.setdefault(body_of(side), []).append(number)
    carriers: dict[str, Carrier | None] = {}
    for root in (GROUND, *bodies):
        if root in carriers:
            continue
        carriers[root] = None
        candidates = sorted((joints[number].rank, number) for number in touching[root])
        while candidates:
            _, number = heappop(candidates)
            own, other = sorted(joints[number].between, key=lambda side: body_of(side) in carriers)
            if body_of(own) not in carriers:
                carriers[body_of(own)] = Carrier(number, own, other)
                for following in touching[body_of(own)]:
                    heappush(candidates, (joints[following].rank, following))
    del carriers[GROUND]
    carrying = {carrier.joint for carrier in carriers.values() if carrier is not None}
    return Topology(carriers, tuple(number for number in range(len(joints)) if number not in carrying))
