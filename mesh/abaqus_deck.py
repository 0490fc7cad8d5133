"""Abaqus and CalculiX decks as text: keywords with their options and data lines, sets that name others."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ..common.errors import InputError
from .included import Line, included, lines_of, whole_of

MOST = 1e7  # members of a set
_OF_DATA = ("NODE", "ELEMENT", "NSET", "ELSET", "SURFACE")  # whose data may stand in a file of their own
# Options that are read; decks may shorten them to what is unique: GEN, ELS …
_OPTIONS = ("COMBINE", "ELSET", "GENERATE", "INPUT", "INSTANCE", "LIBRARY", "NAME", "NSET", "PART", "SYSTEM", "TYPE")


@dataclass
class Keyword:
    """Keyword line `*NAME, OPTION=value, …`, upper case but for values, with its position and data lines."""

    name: str
    options: Mapping[str, str]
    place: str
    data: list[Line] = field(default_factory=list)

    def __str__(self) -> str:
        return f"*{self.name}, {self.place}"

    def rows(self) -> Iterator[tuple[list[str], str]]:
        """The entries of each data line, without empty ones at its end, and its place."""
        for line in self.data:
            entries = [entry.strip() for entry in line.text.split(",")]
            while entries and not entries[-1]:
                entries.pop()
            if entries:
                yield entries, line.place

    def option(self, name: str) -> str:
        """Return a required option. Raises `InputError` if it is missing."""
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
            current.data.extend(_data_of(current, path))
    if current is not None:
        yield current


def _data_of(keyword: Keyword, path: Path) -> Iterator[Line]:
    name = keyword.options["INPUT"]
    file = included(name, path, path)
    if file is None:
        raise InputError(f"{keyword}: expected a file of data", f"none called {name}")
    for line in lines_of(file, lambda *_: None):
        if not line.text.startswith("**"):
            yield Line(line.text, f"{file.name}, {line.place}")


def _included(following: Iterator[str], line: str) -> str | None:
    text = line.lstrip()
    if not text.startswith("*") or text.startswith("**") or "INCLUDE" not in text.upper():
        return None
    keyword = _keyword(text.strip(), "")
    if keyword.name == "INCLUDE":
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
    """Named sets whose members are numbers, INSTANCE.NUMBER, or other sets; names in any case.

    A member is (instance, entry, place), instance "" for the scope that the set stands in; `of_instances` are the sets
    that names of the form INSTANCE.SET mean.
    """

    what: str
    members: dict[str, list[tuple[str, str | int, str]]] = field(default_factory=dict)
    spelled: dict[str, str] = field(default_factory=dict)
    of_instances: Mapping[str, Sets] = field(default_factory=dict)

    def copy(self) -> Sets:
        """Sets of the same members, which can be added to."""
        return Sets(self.what, {name: list(of) for name, of in self.members.items()}, dict(self.spelled))

    def add(self, name: str, entries: Iterable[tuple[str, str | int, str]]) -> None:
        """Add (instance, entry, place) to a set."""
        self.spelled.setdefault(name.upper(), name)
        self.members.setdefault(name.upper(), []).extend(entries)

    def read(self, keyword: Keyword, name: str) -> None:
        """Add the members that data lines of *NSET or *ELSET list."""
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
        """Yield (instance, number, place) of the members of a set, including those of nested sets.

        Raises `InputError` for a set in it that is missing or contains itself.
        """
        for instance, entry, place in self.members[name]:
            if isinstance(entry, int):
                yield instance, entry, place
                continue
            owner = self.of_instances.get(instance, self)
            for of, number, _ in owner.meant(entry, place, (name, *within) if owner is self else ()):
                yield instance or of, number, place

    def meant(self, entry: str, place: str, within: tuple[str, ...] = ()) -> Iterator[tuple[str, int, str]]:
        """Yield the members that `entry` names: NUMBER, INSTANCE.NUMBER, SET or INSTANCE.SET."""
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
