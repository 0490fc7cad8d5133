"""Meshes from Abaqus and CalculiX decks: parts and their instances where the assembly puts them, ties, sets, surfaces.

What makes or moves nodes and elements is read, or rejected by keyword and line; what else a deck says (materials,
sections, loads, steps) the link file says. Elements beside solids are left out, and said to be.
"""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import groupby
from operator import itemgetter
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from ..common.arrays import Integers
from ..common.errors import InputError
from .abaqus_deck import Deck, Keyword, Sets
from .cells import in_gmsh_order
from .included import number_of
from .source import PointMass, RawMesh, left_out

# Corners of the sides S1, S2 … (Abaqus Analysis User's Guide, "Three-dimensional solid element library").
_SIDES: dict[str, list[tuple[int, ...]]] = {
    "tetra": [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)],
    "hexahedron": [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)],
}
# Nodes of tied surfaces closer than this, relative to the part, are one.
_COINCIDENT = 1e-5


def read_abaqus(path: Path) -> RawMesh:
    """The mesh of an Abaqus or CalculiX deck.

    Sets of elements name regions and, where they are shells, faces; so do surfaces and sets of nodes. Sets of a part
    mean all its instances. Raises `InputError`, with keyword and line, for what is wrong or cannot be read.
    """
    return _Assembled(Deck(path)).mesh()


class _Assembled:
    """The instances of a deck with one numbering of nodes and solid elements; "" is the assembly itself."""

    def __init__(self, deck: Deck) -> None:
        self.deck = deck
        self.scopes = {"": deck.assembly, **deck.instances}
        self.node: dict[str, dict[int, int]] = {}
        self.solid: dict[str, dict[int, int]] = {}
        count = cells = 0
        for name, instance in self.scopes.items():
            self.node[name] = {number: count + k for k, number in enumerate(instance.nodes)}
            count += len(instance.nodes)
            by_kind = sorted(instance.solids.items(), key=lambda item: item[1][0])
            instance.solids = dict(by_kind)
            self.solid[name] = {number: cells + k for k, (number, _) in enumerate(by_kind)}
            cells += len(by_kind)
        nodes = ((one.place, np.array(list(one.nodes.values())).reshape(-1, 3)) for one in self.scopes.values())
        self.points = np.concatenate([place.points(own) for place, own in nodes])

    def mesh(self) -> RawMesh:
        cells = [
            (kind, [self._node(name, node, f"element {number}") for node in nodes])
            for name, instance in self.scopes.items()
            for number, (kind, nodes) in instance.solids.items()
        ]
        same, remarks = self._tied()
        remarks += self._left_out()
        groups = {name: same[group] for name, group in self._node_sets().items()}
        raw = RawMesh(self.points, groups, regions=self._regions(), remarks=remarks, masses=[*self._masses()])
        for kind, run in groupby(cells, key=itemgetter(0)):
            raw.add_solids(kind, in_gmsh_order(kind, same[np.array([nodes for _, nodes in run])]), ())
        for name, pieces in self._faces().items():
            raw.facet_groups[name] = [same[piece] for piece in pieces]
        return raw

    def _node(self, instance: str, number: int, of: str) -> int:
        try:
            return self.node[instance][number]
        except KeyError:
            where = f" of instance {instance}" if instance else ""
            raise InputError(f"{of}{where}: expected existing nodes", f"node {number}") from None

    def _regions(self) -> dict[str, list[Integers]]:
        members: dict[str, list[int]] = {}
        for name, scope, instance, number in self._members("elsets"):
            place = self.solid.get(instance, {}).get(number)
            if place is not None:
                members.setdefault(name, []).append(place)
            elif number not in self.scopes[instance].others:
                raise InputError(f"*ELSET {name}{scope}: expected existing elements", f"element {number}")
        return {name: [np.array(cells, dtype=np.int64)] for name, cells in members.items()}

    def _node_sets(self) -> dict[str, Integers]:
        sets: dict[str, list[int]] = {}
        for name, scope, instance, number in self._members("nsets"):
            sets.setdefault(name, []).append(self._node(instance, number, f"*NSET {name}{scope}"))
        for own, one in self.scopes.items():
            for keyword in one.faces.values():
                if nodes := self._surface_node_list(own, keyword):
                    sets.setdefault(keyword.options["NAME"], []).extend(nodes)
        return {name: np.unique(np.array(nodes, dtype=np.int64)) for name, nodes in sets.items()}

    def _members(self, kind: str) -> Iterator[tuple[str, str, str, int]]:
        """Name of each set as it is spelled, its scope in words, instance and number of its members."""
        for own, instance in self.scopes.items():
            sets: Sets = getattr(instance, kind)
            for key, name in sets.spelled.items():
                for of, number, place in sets.numbers(key):
                    if (of or own) not in self.scopes:
                        raise InputError(f"{place}: expected an instance of the assembly", of)
                    yield name, f" of instance {own}" if own else "", of or own, number

    def _faces(self) -> dict[str, list[Integers]]:
        faces: dict[str, list[Integers]] = {}
        for own, instance in self.scopes.items():
            for keyword in instance.faces.values():
                corners = [face for face in self._sides(own, keyword) if face]
                for size in {len(face) for face in corners}:
                    rows = np.array([face for face in corners if len(face) == size], dtype=np.int64)
                    faces.setdefault(keyword.options["NAME"], []).append(rows)
        for name, _, own, number in self._members("elsets"):
            if (nodes := self.scopes[own].surfaces.get(number)) is not None:
                row = [self._node(own, node, f"element {number}") for node in nodes]
                faces.setdefault(name, []).append(np.array([row], dtype=np.int64))
        return faces

    def _sides(self, own: str, keyword: Keyword) -> Iterator[tuple[int, ...]]:
        sets = self.scopes[own].elsets
        for row, place in keyword.rows():
            if (side := _side(row)) is None:
                continue
            for instance, number, _ in sets.meant(row[0], place):
                if (instance or own) not in self.scopes:
                    raise InputError(f"{place}: expected an instance of the assembly", instance)
                if (solid := self.scopes[instance or own].solids.get(number)) is None:
                    continue
                for corners in _SIDES.get(solid[0].rstrip("012"), [])[int(side[1]) - 1 : int(side[1])]:
                    yield tuple(self._node(instance or own, solid[1][corner], place) for corner in corners)

    def _tied(self) -> tuple[Integers, list[str]]:
        """Which node each node is once tied surfaces share theirs, and what to say of it."""
        same, remarks = np.arange(len(self.points)), list[str]()
        used = np.unique([
            self.node[name][node] for name, one in self.scopes.items() for _, nodes in one.solids.values()
            for node in nodes if node in self.node[name]
        ]).astype(np.int64)  # fmt: skip
        for tie in self.deck.ties:
            for row, place in tie.rows():
                if len(row) != 2:
                    raise InputError(f"*TIE, {place}: expected two surfaces", len(row))
                pair = [self._surface_nodes(entry) for entry in row]
                slave, master = (used if nodes is None else np.intersect1d(nodes, used) for nodes in pair)
                joined = self._join(same, slave, master)
                known = all(nodes is not None for nodes in pair)
                wanted = np.setdiff1d(slave, master).size
                if joined < (wanted if known else 1) or joined == 0:
                    raise InputError(
                        f"*TIE, {place}: expected the nodes of {row[0]} where {row[1]} has some",
                        f"{joined} of {wanted} there: meshes that do not match cannot be tied",
                    )
                if not known:
                    remarks.append(
                        f"*TIE, {place}: its surfaces are not in the deck as sides of solids or nodes; all nodes of"
                        f" instances that coincide are tied, {joined} pairs"
                    )
        while not np.array_equal(same, same[same]):
            same = same[same]
        return same, remarks

    def _join(self, same: Integers, slave: Integers, master: Integers) -> int:
        """Have nodes of `slave` be those of `master` that they coincide with; how many do."""
        if not slave.size or not master.size:
            return 0
        near = _COINCIDENT * float(np.ptp(self.points[master], axis=0).max() or 1.0)
        pairs = cKDTree(self.points[slave]).query_ball_tree(cKDTree(self.points[master]), near)
        joined = 0
        for node, partners in zip(slave.tolist(), pairs, strict=True):
            others = [int(master[k]) for k in partners if int(master[k]) != node]
            if others and same[others[0]] != same[node]:
                low, high = sorted((int(same[others[0]]), int(same[node])))
                same[same == high] = low
            joined += bool(others)
        return joined

    def _surface_nodes(self, name: str) -> Integers | None:
        """The nodes of a surface of sides of solids, or of nodes; None where the deck has no such surface."""
        of, _, short = name.strip("\"'").upper().rpartition(".")
        for own, instance in self.scopes.items():
            keyword = instance.faces.get(short)
            if keyword is None or (of and of != own):
                continue
            nodes = [node for face in self._sides(own, keyword) for node in face]
            if nodes := nodes or self._surface_node_list(own, keyword):
                return np.unique(nodes)
        return None

    def _surface_node_list(self, own: str, keyword: Keyword) -> list[int]:
        if keyword.options.get("TYPE", "").upper() != "NODE":
            return []
        sets = self.scopes[own].nsets
        rows = [(place, sets.meant(row[0], place)) for row, place in keyword.rows()]
        return [self._node(of or own, node, place) for place, members in rows for of, node, _ in members]

    def _masses(self) -> Iterator[PointMass]:
        for own, instance in self.scopes.items():
            sets = instance.elsets
            for keyword in instance.weights:
                value = next((number_of(row[0], place) for row, place in keyword.rows()), 0.0)
                name = keyword.options.get("ELSET", "").upper()
                for of, number, _ in sets.numbers(name) if name in sets.members else ():
                    if (node := self.scopes[of or own].masses.get(number)) is not None:
                        place = self._node(of or own, node, f"element {number}")
                        yield PointMass(f"{keyword}, element {number}", value, self.points[place])

    def _left_out(self) -> Iterator[str]:
        others = Counter(kind for one in self.scopes.values() for kind in one.others.values())
        yield from left_out(others, [f"*{name}" for name, count in self.deck.not_read.items() if count])
        for one in self.scopes.values():
            for keyword in one.faces.values():
                # Of nodes, or of sides of solids; sides of shells are faces by their set.
                of_nodes, combined = keyword.options.get("TYPE", "").upper() == "NODE", "COMBINE" in keyword.options
                rows = [row for row, _ in keyword.rows() if not of_nodes]
                if strange := [", ".join(row) for row in rows if combined or not _side(row)]:
                    name = keyword.options["NAME"]
                    yield f'{keyword}: of surface {name} {len(strange)} lines are not read: "{strange[0]}"'
        if self.deck.unused:
            yield f"parts without an instance are left out: {', '.join(sorted(self.deck.unused))}"


def _side(row: Sequence[str]) -> re.Match[str] | None:
    return re.fullmatch(r"S([1-6])", row[1].upper()) if len(row) > 1 else None
