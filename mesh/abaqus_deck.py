"""Abaqus and CalculiX decks, keyword by keyword: text, sets, and what they say of parts, instances and the assembly."""

import re
from collections import Counter
from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ..common.errors import InputError
from .frames import GLOBAL, Frame
from .included import Line, included, lines_of, number_of, whole_of

MOST = 1e7  # members of a set
_OF_DATA = ("NODE", "ELEMENT", "NSET", "ELSET", "SURFACE")  # whose data may stand in a file of their own
# Options that are read; decks may shorten them to what is unique: GEN, ELS …
_OPTIONS = ("COMBINE", "ELSET", "GENERATE", "INPUT", "INSTANCE", "LIBRARY", "NAME", "NSET", "PART", "SYSTEM", "TYPE")


@dataclass
class Keyword:
    """Keyword line `*NAME, OPTION=value, …`, upper case but for values, its `place` for messages and its data lines."""

    name: str
    options: Mapping[str, str]
    place: str
    data: list[Line] = field(default_factory=list)

    def __str__(self) -> str:
        return f"*{self.name}, {self.place}"

    def rows(self) -> Iterator[tuple[list[str], str]]:
        """Yield entries and place of each data line, without empty entries at its end."""
        for line in self.data:
            entries = [entry.strip() for entry in line.text.split(",")]
            while entries and not entries[-1]:
                entries.pop()
            if entries:
                yield entries, line.place

    def option(self, name: str) -> str:
        """A required option. Raises `InputError` if it is missing."""
        if not self.options.get(name):
            raise InputError(f"{self}: expected {name}=…", "none")
        return self.options[name]


def keywords(path: Path) -> Iterator[Keyword]:
    """Yield the keywords of a deck and its included files, without comments and empty lines. Raises `InputError`."""
    current: Keyword | None = None
    lines = lines_of(path, _included)
    for line in lines:
        text = line.text.strip()
        if not text or text.startswith("**"):
            continue
        if not text.startswith("*"):
            if current is None:
                raise InputError("expected a keyword (*NODE …) first", f'"{text[:40]}" ({line.place})')
            current.data.append(line)
            continue
        if current is not None:
            yield current
        while text.endswith(","):
            following = next(lines, None)
            if following is None:
                break
            text = text if following.text.startswith("**") else text + following.text.strip()
        current = _keyword(text, line.place)
        if current.name in _OF_DATA and "INPUT" in current.options:
            name = current.options["INPUT"]
            if (file := included(name, path, path)) is None:
                raise InputError(f"{current}: expected a file of data", f"none called {name}")
            data = [one for one in lines_of(file, lambda *_: None) if not one.text.startswith("**")]
            current.data.extend(Line(one.text, f"{file.name}, {one.place}") for one in data)
    if current is not None:
        yield current


def _included(following: Iterator[str], line: str) -> str | None:
    text = line.lstrip()
    if not text.startswith("*") or text.startswith("**") or "INCLUDE" not in text.upper():
        return None
    if _keyword(text.strip(), "").name == "INCLUDE":
        while text.rstrip().endswith(","):
            text = text.rstrip() + next(following, "").strip()
        return _keyword(text.strip(), "").options.get("INPUT", "")
    return None


def _keyword(text: str, place: str) -> Keyword:
    first, *others = re.findall(r'(?:"[^"]*"|[^,"])+', text[1:]) or [""]
    options = {}
    for other in others:
        name, _, value = other.partition("=")
        name = " ".join(name.split()).upper()
        whole = [option for option in _OPTIONS if name and option.startswith(name)]
        options[whole[0] if len(whole) == 1 else name] = value.strip().strip("\"'")
    return Keyword(" ".join(first.split()).upper(), options, place)


@dataclass
class Sets:
    """Named sets of `what`, "nodes" or "elements": by name in upper case, and as first `spelled`.

    A member is (instance, entry, place): the instance, "" for the scope of the set; a number or text that names it or
    another set; the place for messages. `of_instances` are the sets that names INSTANCE.SET mean.
    """

    what: str
    members: dict[str, list[tuple[str, str | int, str]]] = field(default_factory=dict)
    spelled: dict[str, str] = field(default_factory=dict)
    of_instances: "Mapping[str, Sets]" = field(default_factory=dict)

    def copy(self) -> "Sets":
        """A copy, to which members can be added."""
        return Sets(self.what, {name: list(of) for name, of in self.members.items()}, dict(self.spelled))

    def add(self, name: str, entries: Iterable[tuple[str, str | int, str]]) -> None:
        """Add members (instance, entry, place) to the set `name`."""
        self.spelled.setdefault(name.upper(), name)
        self.members.setdefault(name.upper(), []).extend(entries)

    def read(self, keyword: Keyword, name: str) -> None:
        """Add to the set `name` what data lines of *NSET or *ELSET list."""
        instance = keyword.options.get("INSTANCE", "").upper()
        if "GENERATE" not in keyword.options:
            self.add(name, ((instance, entry, place) for row, place in keyword.rows() for entry in row if entry))
            return
        for row, place in keyword.rows():
            first, last, step = (whole_of(entry, place) for entry in [*row, "1"][:3])
            if len(row) < 2 or step == 0 or abs(last - first) > abs(step) * MOST:
                raise InputError(f"{place}: expected first, last and step of {self.what}", ", ".join(row))
            self.add(name, ((instance, number, place) for number in range(first, last + (step > 0) - (step < 0), step)))

    def numbers(self, name: str, within: tuple[str, ...] = ()) -> Iterator[tuple[str, int, str]]:
        """Yield (instance, number, place for messages) of the members of a set, including those of nested sets.

        `within`: sets that contain it. Raises `InputError` for a set in it that is missing or contains itself.
        """
        for instance, entry, place in self.members[name]:
            if isinstance(entry, int):
                yield instance, entry, place
                continue
            owner = self.of_instances.get(instance, self)
            for of, number, _ in owner.meant(entry, place, (name, *within) if owner is self else ()):
                yield instance or of, number, place

    def meant(self, entry: str, place: str, within: tuple[str, ...] = ()) -> Iterator[tuple[str, int, str]]:
        """Yield (instance, number, place) of what an `entry` NUMBER, INSTANCE.NUMBER, SET or INSTANCE.SET means.

        Raises `InputError`, with the entry's `place`, for an unknown set, or one `within` which it is.
        """
        name = entry.strip("\"'").upper()
        of, _, short = name.rpartition(".")
        if short.isdigit():
            yield of, int(short), place
        elif name in self.members and name not in within:
            yield from self.numbers(name, within)
        elif of in self.of_instances and short in self.of_instances[of].members:
            for instance, number, _ in self.of_instances[of].numbers(short):
                yield instance or of, number, place
        else:
            raise InputError(f"{place}: expected {self.what} or a set of them", f'"{entry}"')


_SOLID = re.compile(r"D?C3D(4|5|6|8|10|15|20)[A-Z]*")  # those of heat (DC3D) have the same nodes
_OTHER_SOLID = re.compile(r"(?:C3D|Q3D|CCL)\d+[A-Z]*|SC[68]R[A-Z]*|CSS8[A-Z]*")
_KINDS = {4: "tetra", 5: "pyramid", 6: "wedge", 8: "hexahedron", 10: "tetra10", 15: "wedge15", 20: "hexahedron20"}
# Surface elements, which name faces; the digit is their number of nodes.
_SURFACE = re.compile(r"(?:STRI|S|DS|CPS|CPE|CPEG|CAX|M3D|R3D|SFM3D)(3|4|65|6|8|9)(?![0-9]{2})[A-Z0-9]*")
_MAKING = (
    "ELCOPY", "ELGEN", "IMPORT", "MATRIX ASSEMBLE", "MATRIX INPUT", "MODEL CHANGE", "NCOPY", "NFILL", "NGEN", "NMAP",
    "PARAMETER", "SUBSTRUCTURE GENERATE", "SYMMETRIC MODEL GENERATION", "USER ELEMENT",
)  # fmt: skip
# Beside these, a keyword that is not read is named in a remark.
_OF_THE_LINK = (
    "AMPLITUDE", "ASSEMBLY", "CONDUCTIVITY", "DAMPING", "DENSITY", "ELASTIC", "END ASSEMBLY", "END INSTANCE",
    "END PART", "EXPANSION", "HEADING", "INITIAL CONDITIONS", "MATERIAL", "ORIENTATION", "PART",
    "PHYSICAL CONSTANTS", "PLASTIC", "PREPRINT", "RESTART", "SHELL SECTION", "SOLID SECTION", "SPECIFIC HEAT",
    "TRANSFORM", "BEAM SECTION", "SURFACE INTERACTION", "FRICTION", "SURFACE BEHAVIOR", "BOUNDARY",
)  # fmt: skip


@dataclass
class Scope:
    """Content of a part, an instance or the assembly: nodes and elements by number, and sets.

    `frame` is that of *SYSTEM, `place` where an instance is in the assembly. `nodes` are coordinates in the unit of
    the deck; elements are `solids` (type, nodes), `surfaces` (corners), `others` (types of all but solids), `masses`
    (the node of each of type MASS), `weights` their *MASS. `nsets`, `elsets` are sets of nodes and elements, `faces`
    *SURFACE by name.
    """

    frame: Frame = GLOBAL
    place: Frame = GLOBAL
    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    solids: dict[int, tuple[str, tuple[int, ...]]] = field(default_factory=dict)
    surfaces: dict[int, tuple[int, ...]] = field(default_factory=dict)
    others: dict[int, str] = field(default_factory=dict)
    masses: dict[int, int] = field(default_factory=dict)
    weights: list[Keyword] = field(default_factory=list)
    nsets: Sets = field(default_factory=lambda: Sets("nodes"))
    elsets: Sets = field(default_factory=lambda: Sets("elements"))
    faces: dict[str, Keyword] = field(default_factory=dict)

    def copy(self) -> "Scope":
        """A copy, to which content can be added."""
        return replace(self, **{name: of.copy() for name, of in vars(self).items() if name not in ("frame", "place")})

    def read(self, keyword: Keyword) -> bool:
        """Read the mesh data of a `keyword`; returns whether it has any."""
        if keyword.name == "ELSET":
            self.elsets.read(keyword, keyword.option("ELSET"))
        elif keyword.name == "SURFACE":
            self.faces[_new_name(keyword, self.faces, "surfaces")] = keyword
        elif keyword.name == "MASS":
            self.weights.append(keyword)
        else:
            own = {"NODE": self._nodes, "ELEMENT": self._elements, "SYSTEM": self._system, "NSET": self._nset}
            if keyword.name not in own:
                return False
            own[keyword.name](keyword)
        return True

    def _system(self, keyword: Keyword) -> None:
        numbers = np.array([number_of(entry or "0", place) for row, place in keyword.rows() for entry in row])
        if numbers.size not in (0, 3, 6, 9):
            raise InputError(f"{keyword}: expected three points", f"{numbers.size} coordinates")
        points = numbers.reshape(-1, 3)
        if len(points) == 2:  # the z axis stays
            x = points[1] - points[0]
            points = np.array([points[0], points[0] + [x[0], x[1], 0], points[0] + [-x[1], x[0], 0]])
        try:
            shifted = Frame(points[0], np.eye(3)) if len(points) else GLOBAL
            self.frame = Frame.through(points, "xy") if len(points) > 1 else shifted
        except ValueError as error:
            raise InputError(f"{keyword}: expected three points that span a plane", error) from None

    def _nodes(self, keyword: Keyword) -> None:
        system = (keyword.options.get("SYSTEM") or "R").upper()
        if system not in ("R", "C"):
            raise InputError(f"{keyword}: expected SYSTEM=R or C", f"{system} (spherical): write Cartesian ones")
        read: dict[int, tuple[list[float], str]] = {}
        for row, place in keyword.rows():
            number = whole_of(row[0], place)
            coordinates = [number_of(entry or "0", place) for entry in row[1:4]]
            coordinates += [0.0] * (3 - len(coordinates))
            if number in read and read[number][0] != coordinates:
                raise InputError(f"{place}: expected one place of each node", f"another one of node {number}")
            read[number] = coordinates, place
        if not read:
            return
        frame = replace(self.frame, kind="cylindrical" if system == "C" else "rectangular")
        given = np.array([coordinates for coordinates, _ in read.values()])
        for (number, (_, place)), point in zip(read.items(), frame.points(given).tolist(), strict=True):
            if self.nodes.setdefault(number, tuple(point)) != tuple(point):
                raise InputError(f"{place}: expected one place of each node", f"another one of node {number}")
        if name := keyword.options.get("NSET"):
            self.nsets.add(name, (("", number, place) for number, (_, place) in read.items()))

    def _elements(self, keyword: Keyword) -> None:
        kind = keyword.option("TYPE").upper()
        solid, surface = _SOLID.fullmatch(kind), _SURFACE.fullmatch(kind)
        if not solid and _OTHER_SOLID.fullmatch(kind):
            raise InputError(f"{keyword}: expected solids of the types C3D4, C3D8, C3D10, C3D20", f"TYPE={kind}")
        count = int(solid[1]) if solid else {"65": 6}.get(surface[1], int(surface[1])) if surface else 0
        members: list[tuple[int, str]] = []
        for entries, place in _of_length(keyword, count + 1) if count else keyword.rows():
            if not count:
                if entries[0].isdigit():
                    self.others[int(entries[0])] = kind
                    members.append((int(entries[0]), place))
                    if kind == "MASS" and len(entries) > 1:
                        self.masses[int(entries[0])] = whole_of(entries[1], place)
                continue
            number = whole_of(entries[0], place)
            members.append((number, place))
            nodes = tuple(whole_of(entry, place) for entry in entries[1:])
            if solid:
                entry = _KINDS[count], nodes
                if self.solids.setdefault(number, entry) != entry:
                    raise InputError(f"{place}: expected elements with unique numbers", f"{number} again")
            else:
                self.others[number] = kind
                self.surfaces[number] = nodes[: 3 if count in (3, 6) else 4]
        if name := keyword.options.get("ELSET"):
            self.elsets.add(name, (("", number, place) for number, place in members))

    def _nset(self, keyword: Keyword) -> None:
        if "ELSET" not in keyword.options:
            self.nsets.read(keyword, keyword.option("NSET"))
            return
        for _, number, place in self.elsets.meant(keyword.option("ELSET"), str(keyword)):
            nodes = self.solids[number][1] if number in self.solids else self.surfaces.get(number, ())
            self.nsets.add(keyword.option("NSET"), (("", node, place) for node in nodes))


def _new_name(keyword: Keyword, known: Container[str], what: str) -> str:
    """NAME=… in upper case, which none of the `known` parts, surfaces … has."""
    name = keyword.option("NAME").upper()
    if name in known:
        raise InputError(f"{keyword}: expected {what} with unique names", f"{name} again")
    return name


def _of_length(keyword: Keyword, length: int) -> Iterator[tuple[list[str], str]]:
    """Entries of elements of so many, over as many data lines as they take, and the place of the first."""
    entries: list[str] = []
    begin = ""
    for row, place in keyword.rows():
        begin = begin if entries else place
        entries += row
        if len(entries) > length:
            break
        if len(entries) == length:
            yield entries, begin
            entries = []
    if entries:
        raise InputError(f"{begin}: expected {length - 1} nodes of an element", len(entries) - 1)


def _instance(keyword: Keyword, parts: Mapping[str, Scope]) -> Scope:
    """Read *INSTANCE and its data lines: a translation, then a rotation about an axis through two points."""
    name = keyword.option("PART")
    if name.upper() not in parts:
        raise InputError(f"{keyword}: expected PART= one of {', '.join(parts) or 'none'}", name)
    own = parts[name.upper()].copy()
    rows = [([number_of(entry or "0", place) for entry in row], place) for row, place in keyword.rows()]
    for sets, option, members in (
        (own.nsets, "NSET", [*own.nodes]),
        (own.elsets, "ELSET", [*own.solids, *own.others]),
    ):
        if whole := keyword.options.get(option):
            sets.add(whole, [("", number, str(keyword)) for number in members])
    if len(rows) > 2 or (rows and len(rows[0][0]) > 3):
        raise InputError(f"{keyword}: expected a line of 3 numbers (translation) and one of 7 (rotation) at most")
    moved, turn = np.array([*rows[0][0], 0.0, 0.0, 0.0][:3]) if rows else np.zeros(3), np.eye(3)
    if len(rows) > 1:
        values, place = rows[1]
        axis = np.subtract(values[3:6], values[:3]) if len(values) == 7 else np.zeros(3)
        if not np.linalg.norm(axis) > 0:
            raise InputError(f"{place}: expected two points on an axis and an angle", values)
        turn = Rotation.from_rotvec(np.radians(values[6]) * axis / np.linalg.norm(axis)).as_matrix()
        moved = values[:3] + turn @ (moved - values[:3])
    return replace(own, place=Frame(moved, turn))


class Deck:
    """Content of the deck at `path`: parts in `instances`, all else in `assembly`. Raises `InputError`."""

    def __init__(self, path: Path) -> None:
        self.parts: dict[str, Scope] = {}
        self.assembly = Scope()
        self.instances: dict[str, Scope] = {}
        self.ties: list[Keyword] = []
        self.not_read: Counter[str] = Counter()
        self.unused: set[str] = set()  # parts
        scope, in_step = self.assembly, False
        for keyword in keywords(path):
            if keyword.name in _MAKING:
                raise InputError(f"{keyword}: expected nodes and elements one by one", f"*{keyword.name}")
            if keyword.name == "STEP":
                in_step = True
            elif in_step:
                in_step = keyword.name != "END STEP"
            elif keyword.name == "PART":
                scope = self._new_part(keyword)
            elif keyword.name == "INSTANCE":
                scope = self._new_instance(keyword)
            elif keyword.name in ("END PART", "END INSTANCE"):
                scope = self.assembly
            elif keyword.name == "TIE":
                self.ties.append(keyword)
            elif not scope.read(keyword):
                self.not_read[keyword.name] += keyword.name not in _OF_THE_LINK
        if scope is not self.assembly:
            raise InputError("expected *END PART or *END INSTANCE", "the end of the file: it is cut off")
        self.assembly.nsets.of_instances = {name: one.nsets for name, one in self.instances.items()}
        self.assembly.elsets.of_instances = {name: one.elsets for name, one in self.instances.items()}
        if not self.instances and self.parts:
            if len(self.parts) > 1:
                raise InputError("expected an *INSTANCE of each part", f"none of {', '.join(self.parts)}")
            self.instances = dict(self.parts)
            self.unused.clear()
        self.unused -= {name for name in self.unused if not self.parts[name].solids}

    def _new_part(self, keyword: Keyword) -> Scope:
        name = _new_name(keyword, self.parts, "parts")
        self.unused.add(name)
        return self.parts.setdefault(name, Scope())

    def _new_instance(self, keyword: Keyword) -> Scope:
        if {"LIBRARY", "INSTANCE"} & keyword.options.keys():
            raise InputError(f"{keyword}: expected an instance of a part in this deck", "one of results (LIBRARY=)")
        self.unused.discard(keyword.option("PART").upper())
        name = _new_name(keyword, self.instances, "instances")
        return self.instances.setdefault(name, _instance(keyword, self.parts))
