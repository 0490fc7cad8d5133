"""Meshes from Nastran's bulk data: grid points in any coordinate system, solid elements by property.

Elements beside solids are left out, and said to be; materials, properties, loads and constraints the link file says.

Cards are of fixed or free field, of 8 or 16 columns, with continuations: see "Format of Bulk Data Entries" in the Quick
Reference Guide of MSC Nastran.
"""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError
from .cells import in_gmsh_order
from .frames import GLOBAL, Frame, Kind
from .included import Line, lines_of, number_of, whole_of
from .source import PointMass, RawMesh, left_out

_BEGIN = re.compile(r"\s*BEGIN\b[\s,]*(\w*)", re.IGNORECASE)
_BY_BLANKS = re.compile(r"(GRID|C(?:HEXA|TETRA|PENTA|PYRAM?|ORD[12][RCS]|ONM[12]))\*?(?= )", re.IGNORECASE)
_CONTROL = re.compile(r"\s*CEND\b", re.IGNORECASE)


@dataclass
class Card:
    """Bulk data card, or a line of it: `name` in upper case, `place` for messages, and the fields after the name.

    `begin` and `end` are continuation marks: the line that `follows` begins with the mark at the end of another.
    """

    name: str
    place: str
    fields: list[str]
    begin: str
    end: str
    follows: bool
    is_half: bool  # of 16 columns, with * at its end: another line has to follow

    def __str__(self) -> str:
        return f"{self.name}, {self.place}"

    def text(self, number: int) -> str:
        """Field `number`, counted from 0 after the name; empty where there is none."""
        return self.fields[number] if number < len(self.fields) else ""

    def whole(self, number: int, default: int | None = None) -> int:
        """The whole number in field `number`, `default` where it is empty. Raises `InputError` where it is none."""
        text = self.text(number)
        return default if default is not None and not text else whole_of(text, str(self))

    def real(self, number: int) -> float:
        """The number in field `number`, 0 where it is empty. Raises `InputError` where it is none."""
        return number_of(self.text(number) or "0", str(self))


def cards(path: Path) -> Iterator[Card]:
    """Yield the cards of a deck's bulk data, of included files too.

    Raises `InputError` for a missing included file, a line that continues no card, and replicated cards (=).
    """
    rows = [_row(line) for line in _bulk(path)]
    ends: dict[str, int] = {}
    for k, row in enumerate(rows):
        if row.end:
            ends[row.end] = -1 if row.end in ends else k
    after: dict[int, int] = {}
    for k, row in enumerate(rows):
        if not row.follows:
            continue
        before = k - 1
        if row.begin and (k == 0 or rows[before].end != row.begin):
            before = ends.get(row.begin, before if k and not rows[before].end else -1)
        if before < 0 or before in after:
            raise InputError(f"expected one card (GRID …) that {row.place} continues", "none or several")
        after[before] = k
    for k, row in enumerate(rows):
        if row.is_half and k not in after:
            raise InputError(f"{row.place}: expected a line that continues this one (*)", "none")
        if row.follows:
            continue
        while (k := after.get(k, -1)) >= 0:
            row.fields += rows[k].fields
        while row.fields and not row.fields[-1]:
            row.fields.pop()
        yield row


def _bulk(path: Path) -> Iterator[Line]:
    """The lines of the bulk data: after BEGIN BULK where there is one, up to ENDDATA; no comments or empty lines."""
    lines = [Line(line.text.partition("$")[0].rstrip(), line.place) for line in lines_of(path, _included)]
    begins = [k for k, line in enumerate(lines) if _BEGIN.match(line.text)]
    if len(begins) > 1:
        raise InputError(f"{lines[begins[1]].place}: expected one BEGIN BULK", "another (superelements)")
    if not begins and any(_CONTROL.match(line.text) for line in lines):
        raise InputError("expected BEGIN BULK after CEND", "none")
    for line in islice(lines, begins[0] + 1 if begins else 0, None):
        if line.text.strip().upper().startswith("ENDDATA"):
            return
        if line.text.strip():
            yield line


def _included(following: Iterator[str], line: str) -> str | None:
    """The file of INCLUDE 'NAME', which may go over several lines."""
    text = line.partition("$")[0].strip()
    if not re.match(r"INCLUDE\b", text, re.IGNORECASE):
        return None
    text = text[7:].strip()
    if text[:1] in ("'", '"'):
        while text.count(text[0]) < 2 and (more := next(following, None)) is not None:
            text += more.strip()
    return text.strip("'\" ")


def _row(line: Line) -> Card:
    text = line.text
    if "," in text:
        entries = [entry.strip() for entry in text.split(",")]
        name = entries[0]
        width = 4 if "*" in name else 8
        entries += [""] * (width + 2 - len(entries))
        if any(entries[width + 2 :]):
            raise InputError(f"{line.place}: expected {width} fields in a line at most", len(entries) - 1)
    else:
        text = text.expandtabs(8)
        name = text[:8].strip()
        width, columns = (4, 16) if "*" in name else (8, 8)
        entries = [
            name,
            *(text[8 + columns * k : 8 + columns * (k + 1)].strip() for k in range(width)),
            text[72:80].strip(),
        ]
    if first := _BY_BLANKS.match(name):
        raise InputError(
            f"{line.place}: expected fields of 8 columns or commas between them", f'"{first[0]}" and a blank'
        )
    if name.startswith("=") or any(entry.startswith("=") for entry in entries):
        raise InputError(f"{line.place}: expected cards one by one", "replicated ones (=)")
    follows = not name or name[0] in "+*"
    last = entries[width + 1]
    return Card(
        name=name.rstrip("*").strip().upper(),
        place=line.place,
        fields=entries[1 : width + 1],
        begin=name.lstrip("+* ") if follows else "",
        end=last.lstrip("+* "),
        follows=follows,
        is_half=last.startswith("*"),
    )


# Solid elements: corners, all nodes, names of both types.
_SOLIDS = {
    "CTETRA": (4, 10, "tetra", "tetra10"),
    "CHEXA": (8, 20, "hexahedron", "hexahedron20"),
    "CPENTA": (6, 15, "wedge", "wedge15"),
    "CPYRAM": (5, 13, "pyramid", "pyramid13"),
    "CPYRA": (5, 13, "pyramid", "pyramid13"),
}
# Nastran numbers the upright edges of a hexahedron before those of its upper face, VTK after them.
_AS_VTK = {"hexahedron20": [*range(12), *range(16, 20), *range(12, 16)]}
_OTHER_SOLIDS = re.compile(r"C(?:I?HEX|TET|PEN|PYR|WEDGE|HAC|IFHEX|IFPEN)\w+")
_SHELLS = {"CTRIA3": 3, "CTRIAR": 3, "CTRIA6": 3, "CQUAD4": 4, "CQUADR": 4, "CQUAD8": 4}
_OTHERS = (
    "CBAR", "CBEAM", "CBEAM3", "CBEND", "CBUSH", "CBUSH1D", "CDAMP1", "CDAMP2", "CDAMP3", "CDAMP4", "CELAS1", "CELAS2",
    "CELAS3", "CELAS4", "CFAST", "CGAP", "CMASS1", "CMASS2", "CMASS3", "CMASS4", "CONM1", "CONM2", "CONROD", "CROD",
    "CSEAM", "CSHEAR", "CTUBE", "CVISC", "CWELD", "GENEL", "RBAR", "RBAR1", "RBE1", "RBE2", "RBE3", "RJOINT", "RROD",
    "RSPLINE", "RSSCON", "RTRPLT",
)  # fmt: skip
_SYSTEMS: dict[str, Kind] = {"R": "rectangular", "C": "cylindrical", "S": "spherical"}
# Beside these, a card that is not read is named in a remark.
_OF_THE_LINK = (
    "PARAM", "PSOLID", "PSHELL", "PBAR", "PBARL", "PBEAM", "PBEAML", "PROD", "PELAS", "PBUSH", "MAT1", "MAT2", "MAT8",
    "MAT9", "SPC", "SPC1", "SPCADD", "LOAD", "FORCE", "MOMENT", "PLOAD", "PLOAD2", "PLOAD4", "GRAV", "EIGR", "EIGRL",
    "SUPORT", "ASET", "ASET1", "SET1", "TEMP", "TEMPD", "PLOTEL", "MDLPRM", "SEQGP", "TABLED1", "FREQ", "FREQ1",
)  # fmt: skip


def read_nastran(path: Path) -> RawMesh:
    """The mesh in Nastran's bulk data.

    Properties name regions, and faces where they are those of shells. Raises `InputError`, with card and line, for what
    is wrong or cannot be read.
    """
    return _Deck(path).mesh()


class _Deck:
    def __init__(self, path: Path) -> None:
        self.grids: dict[int, Card] = {}
        self.systems: dict[int, tuple[Card, int]] = {}  # with the field where a CORD1x's points begin
        self.solids: dict[int, Card] = {}
        self.shells: dict[int, Card] = {}
        self.others: Counter[str] = Counter()
        self.masses: list[Card] = []
        self.not_read: Counter[str] = Counter()
        self.system = 0  # of grid points that name none
        self._frames: dict[int, Frame | None] = {0: GLOBAL}
        for card in cards(path):
            self._take(card)
        self._places = {number: k for k, number in enumerate(self.grids)}

    def _take(self, card: Card) -> None:
        name = card.name
        if name == "GRID":
            if len(card.fields) > 8:
                raise InputError(f"{card}: expected 8 fields of a grid point at most", len(card.fields))
            _add(self.grids, card, card.whole(0))
        elif name == "GRDSET":
            self.system = card.whole(1, 0)
        elif name in _SOLIDS:
            _add(self.solids, card, card.whole(0))
        elif name[:5] in ("CORD1", "CORD2") and name[5:] in _SYSTEMS:
            for begin in (0, 4) if name[4] == "1" else (0,):
                if card.text(begin):
                    number = card.whole(begin)
                    if self.systems.setdefault(number, (card, begin))[0].fields != card.fields:
                        raise InputError(f"{card}: expected coordinate systems with unique numbers", f"{number} again")
        elif name in _SHELLS:
            _add(self.shells, card, card.whole(0))
            self.others[name] += 1
        elif name in _OTHERS:
            self.others[name] += 1
            if name in ("CONM1", "CONM2"):
                self.masses.append(card)
        elif _OTHER_SOLIDS.fullmatch(name):
            raise InputError(f"{card}: expected solids of {', '.join(_SOLIDS)}", name)
        elif name == "PARAM" and card.text(0).upper() == "WTMASS":
            self.not_read["PARAM WTMASS"] += 1
        else:
            self.not_read[name] += name not in _OF_THE_LINK

    def mesh(self) -> RawMesh:
        if not self.grids and not self.solids:
            raise InputError("expected GRID and CTETRA or CHEXA cards", "none")
        of_kind: dict[str, list[tuple[list[int], int]]] = {}
        for card in self.solids.values():
            kind, nodes = _nodes(card)
            row = [self._place(node, card) for node in nodes], card.whole(1, card.whole(0))
            of_kind.setdefault(kind, []).append(row)
        raw = RawMesh(
            self._points(list(self.grids.values())),
            remarks=[*left_out(self.others, [name for name, count in self.not_read.items() if count])],
            masses=[*map(self._mass, self.masses)],
        )
        for kind, rows in of_kind.items():
            owner = np.array([number for _, number in rows])
            groups = [(str(number), np.flatnonzero(owner == number)) for number in np.unique(owner).tolist()]
            raw.add_solids(kind, in_gmsh_order(kind, np.array([nodes for nodes, _ in rows]), _AS_VTK), groups)
        for card in self.shells.values():
            corners = [self._place(card.whole(2 + k), card) for k in range(_SHELLS[card.name])]
            name = str(card.whole(1, card.whole(0)))
            raw.facet_groups.setdefault(name, []).append(np.array([corners], dtype=np.int64))
        return raw

    def _mass(self, card: Card) -> PointMass:
        """Of CONM1 or CONM2, whose offset is in rectangular axes; with CID = -1 it is the place in the basic ones."""
        point, offset = self._point(card.whole(1), card), np.zeros(3)
        lost = " and its inertia" if any(card.fields[7:]) else ""
        if card.name == "CONM2":
            offset = np.array([card.real(k) for k in (4, 5, 6)])
        if (system := card.whole(2, 0)) == -1:
            point, offset = offset, np.zeros(3)
        elif np.any(offset):
            frame = self._frame(system, card)
            offset = frame.C @ offset
            if frame.kind != "rectangular":
                offset, lost = np.zeros(3), f"{lost} and its offset in {frame.kind} axes"
        return PointMass(f"{card.name} {card.whole(0)}{lost}, {card.place}", card.real(3), point + offset)

    def _place(self, node: int, asked: Card) -> int:
        if node not in self._places:
            raise InputError(f"{asked}: expected existing grid points", node)
        return self._places[node]

    def _points(self, cards: Sequence[Card]) -> Array:
        """(p, 3) of grid points, in the basic system."""
        given = np.array([[card.real(k) for k in (2, 3, 4)] for card in cards]).reshape(-1, 3)
        system = np.array([card.whole(1, self.system) for card in cards], dtype=np.int64)
        points = np.empty_like(given)
        for number, first in zip(*np.unique(system, return_index=True), strict=True):
            own = system == number
            points[own] = self._frame(int(number), cards[first]).points(given[own])
        return points

    def _frame(self, number: int, asked: Card) -> Frame:
        if number in self._frames:
            frame = self._frames[number]
            if frame is None:
                raise InputError(f"{asked}: expected coordinate systems that do not refer to themselves", number)
            return frame
        if number not in self.systems:
            raise InputError(f"{asked}: expected a coordinate system of CORD1x or CORD2x cards", number)
        self._frames[number] = None
        card, begin = self.systems[number]
        if card.name[4] == "2":
            given = np.array([[card.real(2 + 3 * k + i) for i in range(3)] for k in range(3)])
            points = self._frame(card.whole(1, 0), card).points(given)
        else:
            points = np.array([self._point(card.whole(begin + k), card) for k in (1, 2, 3)])
        try:
            frame = Frame.through(points, "zx", _SYSTEMS[card.name[5]])
        except ValueError as error:
            raise InputError(f"{card}: expected three points that span a plane", error) from None
        self._frames[number] = frame
        return frame

    def _point(self, number: int, asked: Card) -> Array:
        """(3,) of a grid point, in the basic system."""
        self._place(number, asked)  # raises where there is none
        return self._points([self.grids[number]])[0]


def _add(cards: dict[int, Card], card: Card, number: int) -> None:
    other = cards.setdefault(number, card)
    if other is not card and (other.name, other.fields) != (card.name, card.fields):
        raise InputError(f"{card}: expected cards with unique numbers", f"{number} again ({other.place})")


def _nodes(card: Card) -> tuple[str, list[int]]:
    corners, most, linear, quadratic = _SOLIDS[card.name]
    fields = card.fields[2:]
    if any(fields[most:]):
        raise InputError(f"{card}: expected {corners} or {most} grid points", len(fields))
    nodes = [card.whole(2 + k, None if k < corners else 0) for k in range(most)]
    middles = [node for node in nodes[corners:] if node]
    if not middles:
        return linear, nodes[:corners]
    if len(middles) < most - corners:
        raise InputError(f"{card}: expected midside grid points on all edges or none", len(middles))
    return quadratic, nodes
