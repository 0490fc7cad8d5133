"""Scene and link files of single runs: the user's, with some keys changed and all file names made absolute."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import tomli_w

from ..common.errors import InputError
from ..common.validation import did_you_mean, load_toml, quoted
from .variation import Value

Table = dict[str, Any]
Node = dict[str, Any] | list[Any]

LINKS = "links"
FILE_KEYS = {"link", "modal", "waypoints", "file", "python"}


def write_run(scene_path: Path, changes: Mapping[tuple[str, ...], Value], folder: Path) -> Path:
    """Write the scene at `scene_path` with `changes`, and the link files they concern, into `folder`.

    Returns the new scene file. Raises `InputError` for a key that leads nowhere.
    """
    scene = load_toml(scene_path, "scene file")
    _resolve(scene, scene_path.absolute().parent)
    links: dict[str, Table] = {}
    for key, value in changes.items():
        if key[0] == LINKS:
            _set(_link_of(scene_path, scene, key, links), key[2:], value, key)
        else:
            _set(scene, key, value, key)
    folder.mkdir(parents=True, exist_ok=True)
    for body, link in links.items():
        path = folder / f"{body}.toml"
        path.write_text(tomli_w.dumps(link), encoding="utf-8")
        _body(scene, body)["link"] = str(path.absolute())
    path = folder / "scene.toml"
    path.write_text(tomli_w.dumps(scene), encoding="utf-8")
    return path


def _link_of(scene_path: Path, scene: Table, key: tuple[str, ...], links: dict[str, Table]) -> Table:
    """The content of the link file that `links.BODY.…` means, read once, or the table in the scene itself."""
    with_links = [body["name"] for body in scene.get("body", []) if "link" in body]
    if len(key) < 3 or key[1] not in with_links:
        found = ".".join(key)
        raise InputError(
            f"{scene_path}: --vary: expected {LINKS}.BODY.KEY with a body that has a link file ({quoted(with_links)}),"
            f' found "{found}"' + (did_you_mean(key[1], with_links) if len(key) > 1 else "")
        )
    if key[1] not in links:
        link = _body(scene, key[1])["link"]
        if isinstance(link, dict):
            return link
        path = Path(link)
        links[key[1]] = load_toml(path, "link file")
        _resolve(links[key[1]], path.parent)
    return links[key[1]]


def _body(scene: Table, name: str) -> Table:
    return next(body for body in scene["body"] if body["name"] == name)


def _resolve(data: Node, folder: Path) -> None:
    """Make the names of existing files in `data` absolute: a run has a folder of its own."""
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        if isinstance(value, dict | list):
            _resolve(value, folder)
        elif key in FILE_KEYS and isinstance(value, str):
            name, colon, function = value.partition(":")  # of a Python file: FILE:FUNCTION
            data[key] = str(folder / name) + colon + function  # type: ignore[call-overload]


def _set(data: Node, key: tuple[str, ...], value: Value, whole: tuple[str, ...]) -> None:
    """data[key] = value; entries of a list go by their number (from 0), their `name` or their `body`."""
    if len(key) == 1:
        data[_index(data, key[0], whole)] = value  # type: ignore[index]
        return
    if isinstance(data, dict):
        data.setdefault(key[0], {})
    inner = data[_index(data, key[0], whole)]  # type: ignore[index]
    if not isinstance(inner, dict | list):
        raise InputError(f'--vary: expected a table or a list at "{key[0]}" of "{".".join(whole)}", found {inner!r}')
    _set(inner, key[1:], value, whole)


def _index(data: Node, part: str, whole: tuple[str, ...]) -> str | int:
    if isinstance(data, dict):
        return part
    names = [str(entry.get("name", entry.get("body", k))) for k, entry in _tables(data)]
    if part in names:
        return names.index(part)
    if part.isdigit() and int(part) < len(data):
        return int(part)
    known = names or [str(k) for k in range(len(data))]
    raise InputError(
        f'--vary: expected one of {quoted(known)} in "{".".join(whole)}", found "{part}"{did_you_mean(part, known)}'
    )


def _tables(data: list[Any]) -> Iterable[tuple[int, Table]]:
    return ((k, entry) for k, entry in enumerate(data) if isinstance(entry, dict))
