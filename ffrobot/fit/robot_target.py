"""What is fitted: frequencies of a link file, or of a robot by its linear model about the equilibrium."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from copy import deepcopy
from pathlib import Path
from typing import Any

import tomli_w

from ..actuation.control.linear import LinearModels
from ..actuation.control.linear_model import locked_frequencies, robot_modes
from ..common.arrays import Array, as_floats
from ..common.errors import InputError
from ..common.toml_files import load_toml, read_text
from ..fe_models.link import computed_modal_body
from ..fe_models.link_records.families import FAMILIES
from ..fe_models.link_source import LinkTable
from ..run.solve import solve_scene
from ..run.watcher import Watcher
from ..scene.load import load_scene, make_scene
from ..sweep.files import LINKS, run_files, set_key, value_of

Key = tuple[str, ...]

VALUE = r'("[^"\n]*"|[^\s,}\]#]+)'  # a text or a number


def with_values(text: str, changes: Mapping[Key, float | str]) -> str:
    """The TOML `text` with other values of keys that are in it.

    A value is replaced where it stands, which parsing the outcome proves; where no such place is found, as of an entry
    of a list, the tables are written anew, without comments.
    """
    for key, value in changes.items():
        wanted = deepcopy(tomllib.loads(text))
        set_key(wanted, key, value)
        text = _edited(text, key[-1], json.dumps(value, ensure_ascii=False), wanted) or tomli_w.dumps(wanted)
    return text


def _edited(text: str, name: str, value: str, wanted: Mapping[str, object]) -> str:
    """The text with one entry `name = …` replaced such that it says what is `wanted`; empty where none does."""
    for match in re.finditer(rf"(?<![\w.-]){re.escape(name)}\s*=\s*{VALUE}", text):
        edited = text[: match.start(1)] + value + text[match.end(1) :]
        with suppress(tomllib.TOMLDecodeError):
            if tomllib.loads(edited) == wanted:
                return edited
    return ""


class LinkTarget:
    """The link file at `path`: its eigenmodes under its reference condition."""

    families: tuple[str, ...] = FAMILIES

    def __init__(self, path: Path) -> None:
        self._path = path
        self._tables = load_toml(path, "link file")

    def start(self, key: Key) -> object:
        """What the file says at `key`; None where it is not given."""
        return value_of(self._tables, key)

    def modes(self, changes: dict[Key, float]) -> tuple[tuple[str, ...], Array]:
        """Families and frequencies (Hz) of the eigenmodes, the lowest first, with some values changed."""
        tables = deepcopy(self._tables)
        for key, value in changes.items():
            set_key(tables, key, value)
        body = computed_modal_body(LinkTable(tables, self._path))
        return body.family[: body.eigenmode_count], body.frequency[: body.eigenmode_count]

    def files(self, changes: dict[Key, float], output: Path | None) -> dict[Path, str]:
        """The text of the new link file, by where it goes."""
        return {_beside(self._path, output): with_values(read_text(self._path, "link file"), dict(changes))}


def fitted_name(path: Path, more: str = "") -> Path:
    """LINK.fitted.toml of LINK.toml, `more` before the ending."""
    return path.with_name(f"{path.stem}{more}.fitted.toml")


def _beside(path: Path, output: Path | None) -> Path:
    """`output`, or the fitted file of `path`. Raises `InputError` for one elsewhere."""
    if output is not None and output.parent.resolve() != path.parent.resolve():
        raise InputError(f"{output}: output: expected a file next to {path}, to which its file names are relative")
    return output or fitted_name(path)


ANALYSIS = {"name": "fit", "kind": "linear"}


class RobotTarget:
    """The scene at `path`: vibrations about the equilibrium at t = 0, with `motors` "free" or "held"."""

    families: tuple[str, ...] = ()

    def __init__(self, path: Path, motors: str) -> None:
        self._path, self._motors = path, motors
        self._scene = load_toml(path, "scene file")
        load_scene(path)
        bodies = {body["name"]: body.get("link") for body in self._scene["body"]}
        self._links = {name: path.parent / link for name, link in bodies.items() if isinstance(link, str)}
        self._tables: dict[str, Any] = {name: load_toml(link, "link file") for name, link in self._links.items()}
        self._tables |= {name: link for name, link in bodies.items() if isinstance(link, dict)}

    def start(self, key: Key) -> object:
        """What scene or link file say at `key`, `links.BODY.…` in the latter; None where it is not given."""
        if key[0] != LINKS:
            return value_of(self._scene, key)
        return value_of(self._tables, key[1:]) if len(key) > 2 else None

    def modes(self, changes: dict[Key, float]) -> tuple[tuple[str, ...], Array]:
        """Frequencies (Hz) of the robot's vibrations, the lowest first, with some values changed; no families."""
        files = run_files(self._path, changes, self._path.parent)
        scene = files.scene | {"analysis": [ANALYSIS]}
        tables = {path.name: link for path, link in files.links.items()}
        for body in scene["body"]:
            body["link"] = tables.get(body.get("link"), body.get("link")) if "link" in body else None
            if body.get("modes") == "auto":  # the linear model needs no choice: all of them
                del body["modes"]
        solution = solve_scene(make_scene(folder=self._path.parent, **scene), Watcher())
        details = solution.outcomes["fit"].details
        assert isinstance(details, LinearModels)
        free = robot_modes(model := details.models[0]).frequency
        frequency = locked_frequencies(model) if self._motors == "held" else as_floats(free[free > 0.0])
        return ("",) * len(frequency), frequency

    def files(self, changes: dict[Key, float], output: Path | None) -> dict[Path, str]:
        """The text of the new scene file and of the link files that change, by where they go."""
        path = _beside(self._path, output)
        of_scene: dict[Key, float | str] = {}
        of_links: dict[str, dict[Key, float | str]] = {}
        for key, value in changes.items():
            if key[0] != LINKS:
                of_scene[key] = value
            elif key[1] in self._links:
                of_links.setdefault(key[1], {})[key[2:]] = value
            else:
                of_scene["body", key[1], "link", *key[2:]] = value
        found = {}
        for body, values in of_links.items():
            old = self._links[body]
            new = fitted_name(old, f".{body}")
            found[new] = with_values(read_text(old, "link file"), values)
            link = next(entry["link"] for entry in self._scene["body"] if entry["name"] == body)
            of_scene["body", body, "link"] = Path(link).with_name(new.name).as_posix()
        return found | {path: with_values(read_text(self._path, "scene file"), of_scene)}
