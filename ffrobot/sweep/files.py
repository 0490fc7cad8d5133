"""Scene and link files of single runs: the user's, with some keys changed and all file names made absolute."""

import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import tomli_w

from ..common.errors import InputError, did_you_mean, quoted
from ..common.files import write_atomically
from ..common.keys import MOST_RUNS, check_name
from ..common.structs import struct
from ..common.tables import DEEPEST, shown
from ..common.toml_files import load_toml
from ..run.inputs import FILE_KEYS, digest_of_file, fingerprints, named_files

Value: TypeAlias = Any
"""What TOML may hold: a number, a text, a list …"""


@struct
class Variation:
    """Varied key of the scene or a link file (`links.BODY.…`), or several varied together, and its values."""

    # parts of each key, `("links", "link1", "geometry", "section", "height")`
    keys: tuple[tuple[str, ...], ...]
    values: tuple[Value, ...]  # the values, in order
    # first and last value of a range, from which a sample draws; None where values are listed
    ends: tuple[float, float] | None = None
    logarithmic: bool = False  # whether values of a range are evenly spaced in the logarithm

    @property
    def name(self) -> str:
        """The keys as the user writes them."""
        return ",".join(".".join(key) for key in self.keys)

    def draw(self, u: float) -> Value:
        """The value at the share u, in [0, 1), of the range or the list."""
        if self.ends is None:
            return self.values[int(u * len(self.values))]
        a, b = self.ends
        return float(a * (b / a) ** u) if self.logarithmic else float(a + u * (b - a))


def parse_variation(text: str) -> Variation:
    """Read a variation: `key=0.01:0.03:9` (evenly spaced), `key=1e-6:1e-3:4:log` or a list `key=0.1,0.2`.

    Lists may have texts: `key="static","undeformed"`. `key,key=…` sets both to the same value. Raises `InputError` for
    other text.
    """
    key, equals, values = text.partition("=")
    keys = tuple(tuple(one.strip().split(".")) for one in key.split(","))
    text = f'"{shown(text)}"'
    if not equals or not all(map(all, keys)) or max(map(len, keys)) > DEEPEST:
        raise InputError("--vary: expected KEY=VALUES, such as gravity.1=-9.81:0:5", text)
    pieces = values.split(":")
    if len(pieces) in (3, 4) and '"' not in values:
        return _range(keys, pieces, text)
    try:
        listed = tomllib.loads(f"values = [{values}]")["values"]
    except (ValueError, RecursionError):  # no TOML, a number of thousands of digits, lists in lists without end
        listed = []
    if not listed:
        raise InputError(
            "--vary: expected FIRST:LAST:COUNT, FIRST:LAST:COUNT:log or a list with commas (texts in quotes)",
            text,
        )
    return Variation(keys, tuple(listed))


def _range(keys: tuple[tuple[str, ...], ...], pieces: Sequence[str], text: str) -> Variation:
    logarithmic, count = len(pieces) == 4, 0
    with suppress(ValueError):
        first, last, count = float(pieces[0]), float(pieces[1]), int(pieces[2])
    if count < 1 or not np.isfinite([first, last]).all() or (logarithmic and pieces[3] != "log"):
        raise InputError("--vary: expected FIRST:LAST:COUNT with two numbers and a count of at least 1, or …:log", text)
    if count > MOST_RUNS:
        raise InputError(f"--vary: expected at most {MOST_RUNS} values", text)
    if logarithmic and not np.sign(first) * np.sign(last) > 0:
        raise InputError("--vary: expected two ends of one sign for a logarithmic range", text)
    spaced = np.geomspace(first, last, count) if logarithmic else np.linspace(first, last, count)
    return Variation(keys, tuple(float(value) for value in spaced), (first, last), logarithmic)


Table = dict[str, Any]
Node = dict[str, Any] | list[Any]

LINKS, SCENE = "links", "scene.toml"


@struct
class RunFiles:
    """Content of the scene file of one run and of its changed link files."""

    scene: Table  # tables of the scene, with the names of changed link files in the run's folder
    links: dict[Path, Table]  # tables of changed link files, by their path there
    # fingerprints of everything that the run is made from, under the names of the user's files
    inputs: dict[str, str]

    def write(self, folder: Path) -> Path:
        """Write the files into `folder`; returns the path of the scene file."""
        folder.mkdir(parents=True, exist_ok=True)
        for path, tables in (*self.links.items(), (folder / SCENE, self.scene)):
            write_atomically(path, tomli_w.dumps(tables).encode(), "scene of the run", ours=True)
        return folder / SCENE


def run_files(scene_path: Path, changes: Mapping[tuple[str, ...], Value], folder: Path) -> RunFiles:
    """Return the scene at `scene_path` with `changes` by key, and link files that these change, for `folder`.

    Raises `InputError` for a body without link file, a missing list entry, and a key below a plain value.
    """
    scene, links = _read(scene_path, "scene file"), dict[str, Table]()
    places = dict[object, tuple[str, ...]]()
    for key, value in changes.items():
        tables, inner = _place(scene_path, scene, key, links)
        place = set_key(tables, inner, deepcopy(value), key)  # of which later keys may change a part
        if (first := places.setdefault(place, key)) != key:
            raise InputError("expected different keys", f"{'.'.join(first)} and {'.'.join(key)}, which are one")
    inputs = fingerprints(scene, scene_path.absolute())
    copies = {}
    for body, link in links.items():
        path = (folder / f"{body}.link.toml").absolute()  # no name of a body has a dot: none meets another file
        origin = Path(_body(scene, body)["link"])
        inputs |= {str(path): digest_of_file(path) for path in named_files(link, origin.parent)}
        copies[path] = link
        _body(scene, body)["link"] = path.name  # next to the scene: the folder may move
    return RunFiles(scene, copies, inputs)


def value_at(scene_path: Path, key: tuple[str, ...], option: str) -> Value:
    """Return the value of `key` in the scene, or in a link file for `links.BODY.…`; None if absent.

    Raises `InputError`, with the `option` of the command, for a body without link file and a missing list entry.
    """
    return value_of(*_place(scene_path, _read(scene_path, "scene file"), key, {}, option), key, option)


def number_at(path: Path, key: tuple[str, ...], option: str, kind: str = "scene file") -> float:
    """Return the number at `key`; see `value_at`. Raises `InputError` without one; messages call the file `kind`."""
    return number_of(*_place(path, _read(path, kind), key, {}, option), f"{path}: {option}", key)


def number_of(tables: Table, key: tuple[str, ...], label: str, whole: tuple[str, ...] = ()) -> float:
    """Return the number at `key` of `tables`. Raises `InputError`: `label` begins it, `whole` names the key."""
    value = value_of(tables, key, whole, label)
    if isinstance(value, bool) or not isinstance(value, int | float):
        text = "none" if value is None else repr(value)
        raise InputError(
            f"{label}: expected a number at {'.'.join(whole or key)}, found {text}{_near(tables, key)}"
            + (", and no default counts: write its value into the file" if value is None else "")
        )
    return float(value)


def _read(path: Path, kind: str) -> Table:
    tables = load_toml(path, kind)
    _resolve(tables, path.absolute().parent)
    return tables


def _near(data: Node, key: tuple[str, ...]) -> str:
    """What the first part of `key` that a table does not have may have been meant to be."""
    for part in key:
        if isinstance(data, dict) and part not in data:
            return did_you_mean(part, data)
        if not isinstance(data, dict | list):
            return ""
        data = data[_index(data, part, key)]
    return ""


def _place(
    scene_path: Path, scene: Table, key: tuple[str, ...], links: dict[str, Table], option: str = "--vary"
) -> tuple[Table, tuple[str, ...]]:
    """The tables that `key` is in, and the key there: of `links.BODY.…` those of a link file, read once to `links`."""
    if key[0] != LINKS:
        return scene, key
    with_links = [name for name, body in reversed(_bodies(scene).items()) if "link" in body]
    if len(key) < 3 or key[1] not in with_links:
        dotted = ".".join(key)
        raise InputError(
            f"{scene_path}: {option}: expected {LINKS}.BODY.KEY with a body that has a link file"
            f' ({quoted(with_links)}), found "{dotted}"' + (did_you_mean(key[1], with_links) if len(key) > 1 else "")
        )
    if key[1] not in links:
        try:
            check_name(key[1])  # before a file gets it
        except ValueError as error:
            raise InputError(f'{scene_path}: body "{shown(key[1])}": name: {error}') from None
        link = _body(scene, key[1])["link"]
        if isinstance(link, dict):
            return link, key[2:]
        links[key[1]] = _read(Path(str(link)), "link file")
    return links[key[1]], key[2:]


def _body(scene: Table, name: str) -> Table:
    if (table := _bodies(scene).get(name)) is None:
        raise InputError(f'--vary: expected no other name of the body "{shown(name)}" with {LINKS}.{shown(name)}')
    return table


def _bodies(scene: Table) -> dict[str, Table]:
    """The first body of each name; scenes are not validated yet."""
    bodies = scene.get("body")
    tables = [body for body in bodies if isinstance(body, dict)] if isinstance(bodies, list) else []
    return {body["name"]: body for body in reversed(tables) if isinstance(body.get("name"), str)}


def _resolve(data: Node, folder: Path) -> None:
    """Make the names of existing files in `data` absolute: a run has a folder of its own."""
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        if isinstance(value, dict | list):
            _resolve(value, folder)
        elif key in FILE_KEYS and isinstance(value, str):
            name, colon, function = value.partition(":")  # of a Python file: FILE:FUNCTION
            data[key] = str(folder / name) + colon + function  # type: ignore[call-overload]


def value_of(data: Node, key: tuple[str, ...], whole: tuple[str, ...] = (), option: str = "--vary") -> Value:
    """Return data[key], see `set_key`; None if absent. Messages name `option` and, for the key, `whole`."""
    value: Value = data
    for part in key:
        if not isinstance(value, dict | list) or (isinstance(value, dict) and part not in value):
            return None
        value = value[_index(value, part, whole or key, option)]
    return value


def set_key(data: Node, key: tuple[str, ...], value: Value, whole: tuple[str, ...] = ()) -> object:
    """Set data[key] = value; entries of a list go by their number (from 0), their `name` or their `body`.

    Returns the place, whatever the key calls it. `whole` is what messages call the key, where that is not `key` itself.
    """
    whole = whole or key
    for part in key[:-1]:
        if isinstance(data, dict):
            data.setdefault(part, {})
        inner = data[_index(data, part, whole)]
        if not isinstance(inner, dict | list):
            raise InputError(f'--vary: expected a table or a list at "{part}" of "{".".join(whole)}"', f"{inner!r}")
        data = inner
    data[last := _index(data, key[-1], whole)] = value
    return id(data), last


def _index(data: Node, part: str, whole: tuple[str, ...], option: str = "--vary") -> Any:
    """The key of a table, or the number in a list."""
    if isinstance(data, dict):
        return part
    names = [str(one.get("name", one.get("body", k))) for k, one in enumerate(data) if isinstance(one, dict)]
    if part in names:
        return names.index(part)
    if part.isdecimal() and int(part) < len(data):
        return int(part)
    known = names or [str(k) for k in range(len(data))]
    raise InputError(
        f'{option}: expected one of {quoted(known)} in "{".".join(whole)}"', f'"{part}"{did_you_mean(part, known)}'
    )
