"""Pages with every key of link, scene and figures files, from the schemas that `ffrobot schema` prints.

They are kept in the repository, so that they can be read there: `python docs/key_tables.py` writes them anew.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ffrobot.scene.spatial_lacks import LACKS
from ffrobot.schema import schema

INTRODUCTION = {
    "link": "A link file is the input of stage 1. SI units; the link's axis is x, in-plane bending displaces along y.",
    "scene": "A scene file is the input of stage 2. SI units, angles in rad; file names are relative to the scene's"
    " folder. `ffrobot schema scene` prints these keys for editors. Axes and signs: [conventions](conventions.md).",
    "spatial": 'A scene file with `space = "spatial"` is the input of stage 2 in 3D. SI units, angles in rad. Analyses'
    " have the keys of [planar scenes](scene_keys.md). ffrobot rejects [unsupported keys](#unsupported-in-3d) with an"
    " error message. `ffrobot schema spatial` prints these keys for editors.",
    "figures": "A file `figures.toml` next to the results lists the figures of `ffrobot plot`. Without it, standard"
    " figures are drawn.",
}
HERE = Path(__file__).parent / "reference"


LINK_TABLES = tuple(schema("link")["$defs"])
SCENE_TABLES = tuple(schema("scene")["$defs"])


def write_key_tables(folder: Path) -> None:
    """Write `link_keys.md`, `scene_keys.md`, `spatial_keys.md` and `figures_keys.md` into `folder`."""
    for name, text in key_pages().items():
        (folder / name).write_text(text, encoding="utf-8")


def key_pages() -> dict[str, str]:
    """The pages by the name of their file."""
    pages = {}
    for kind, introduction in INTRODUCTION.items():
        what = "3D scene file" if kind == "spatial" else f"{kind} file"
        lines = [f"# Keys of a {what}", "", introduction, ""]
        elsewhere = LINK_TABLES if kind in ("scene", "spatial") else ()
        elsewhere += SCENE_TABLES if kind == "spatial" else ()  # a body's link has the keys of a link file
        records = [(name, record) for name, record in _records(schema(kind)) if name not in elsewhere]
        lines += [line for name, record in records for line in _section(name, record)]
        lines += _lacks() if kind == "spatial" else ()
        text = "\n".join(lines).rstrip("\n") + "\n"
        for name in SCENE_TABLES if kind == "spatial" else ():  # analyses are those of planar scenes
            text = text.replace(f"](#{name.lower()})", f"](scene_keys.md#{name.lower()})")
        pages[f"{kind}_keys.md"] = text
    return pages


def _lacks() -> Iterator[str]:
    """Unsupported features of 3D scenes, and what to use instead."""
    yield from ("## Unsupported in 3D", "", "| feature | instead |", "|---|---|")
    yield from (f"| {lack.what} | {lack.instead} |" for lack in LACKS)


def _records(described: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """The whole file first, then every table in it."""
    if "properties" in described:
        yield "the file", described
    yield from ((name, record) for name, record in described["$defs"].items() if "properties" in record)


def _section(name: str, record: dict[str, Any]) -> Iterator[str]:
    about = record.get("description", "").splitlines()  # stars are products here, not emphasis
    yield from (f"## {name}", "", *(line.replace("*", "\\*") for line in about), "")
    yield from ("| key | what | value | default |", "|---|---|---|---|")
    required = record.get("required", [])
    for key, entry in record["properties"].items():
        default = "required" if key in required else _code(entry.get("default"))
        yield f"| `{key}` | {_meaning(key, entry)} | {_kind(entry)} | {default} |"
    yield ""


def _meaning(key: str, entry: dict[str, Any]) -> str:
    """The description; of a constant, for which editors show the first line about its table, what it is."""
    if "const" in entry:
        return "Dimension of the motion." if key == "space" else f"{key.capitalize()} of this table."
    return str(entry["description"])


def _code(default: object) -> str:
    if isinstance(default, dict):
        default = {key: value for key, value in default.items() if value}
    return "" if default in (None, [], {}) else f"`{json.dumps(default, ensure_ascii=False)}`"


def _kind(entry: dict[str, Any]) -> str:
    """What a value has to be, in words."""
    if "$ref" in entry:
        name = entry["$ref"].rpartition("/")[2]
        return f"table [{name}]({'link_keys.md' if name in LINK_TABLES else ''}#{name.lower()})"
    if "const" in entry:
        return f'`"{entry["const"]}"`'
    if "enum" in entry:
        return ", ".join(f'`"{word}"`' for word in entry["enum"])
    for alternatives in ("anyOf", "oneOf"):
        if alternatives in entry:
            return " or ".join(dict.fromkeys(_kind(item) for item in entry[alternatives]))
    if entry.get("type") == "array":
        return _array(entry)
    if entry.get("type") == "object":
        return "table of " + _kind(entry.get("additionalProperties", {}))
    words = {"number": "number", "integer": "whole number", "boolean": "`true` or `false`"}
    kind = words.get(str(entry.get("type")), "file name" if entry.get("format") == "path" else "text")
    bounds = [f"{sign} {entry[key]:g}" for key, sign in BOUNDS.items() if key in entry]
    return " ".join([kind, ", ".join(bounds)]).strip()


BOUNDS = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}


def _array(entry: dict[str, Any]) -> str:
    if "prefixItems" in entry:
        kinds = [_kind(item) for item in entry["prefixItems"]]
        return f"{len(kinds)} of: {kinds[0]}" if len(set(kinds)) == 1 else ", ".join(kinds)
    kind = _kind(entry.get("items", {}))
    return kind.replace("table ", "tables ", 1) if kind.startswith("table ") else f"list of {kind}"


if __name__ == "__main__":
    write_key_tables(HERE)
