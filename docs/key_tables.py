"""Pages with every key of link, scene and figures files, and the tables of datasets of the page on files.

Keys are from the schemas that `ffrobot schema` prints, datasets from `common/meanings.py`. Pages are kept in the
repository, so that they can be read there: `python docs/key_tables.py` writes them anew.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

from ffrobot.common.meanings import LABELS, MODAL_BODY, RESULTS, Meaning
from ffrobot.schema import scene_in, schema

INTRODUCTION = {
    "link": "A link file is the input of stage 1. SI units; the link's axis is x, in-plane bending displaces along y.",
    "scene": "A scene file is the input of stage 2. SI units, angles in rad; file names are relative to the scene's"
    " folder. `ffrobot schema scene` prints these keys for editors. Axes and signs: [conventions](conventions.md)."
    ' Scenes are planar, or 3D with `space = "spatial"`. The tables mark keys and values of one of the two. ffrobot'
    " rejects [unsupported features](#unsupported) with an error message.",
    "figures": "A file `figures.toml` next to the results lists the figures of `ffrobot plot`. Without it, standard"
    " figures are drawn.",
}
HERE = Path(__file__).parent / "reference"
UNSUPPORTED = (
    (
        "`motor = true` of spherical and free joints, which have no coordinates",
        "revolute and prismatic joints in series; loads on points",
        "ffrobot.mbs.joints.joint",
    ),
    (
        '`coupling = "surface"` of patches on ±z, of fibers and of twist: link files outline patches on ±y',
        '`coupling = "rotation"`',
        "ffrobot.actuation.patches.records",
    ),
    (
        'compliant gears (`stiffness` of joints) with `motors = "frame"` in joints whose axis modes tilt, where they'
        " are driven, controlled or linearized: no angle goes with a moment between frames there",
        '`motors = "section"`',
        "ffrobot.mbs.run.gears",
    ),
    (
        "kinematic loops with a motor without `rotor_inertia`, or a compliant gear, in each joint (rotors,"
        " trajectories, friction, loads and limits of positions may be in all)",
        "a rotor in front of a rigid gear in one of them, or no motor there: ffrobot cuts the loop there",
        "ffrobot.mbs.model.build",
    ),
    (
        "sensors and controllers on spherical and free joints, which have no coordinates, and on all joints of a"
        " kinematic loop where none has a `rotor_inertia`",
        "sensors of points, or of other joints of the loop",
        "ffrobot.actuation.control.robot",
    ),
)
"""What keys of scenes can say and ffrobot does not support, what to write instead, and the module that rejects it."""


HEADER = "| key | description | value | default |"
LINK_TABLES = tuple(schema("link")["$defs"])
Schema = dict[str, Any]


def write_key_tables(folder: Path) -> None:
    """Write `link_keys.md`, `scene_keys.md`, `figures_keys.md` and `files.md` into `folder`."""
    for name, text in {**key_pages(), "files.md": files_page()}.items():
        (folder / name).write_text(text, encoding="utf-8")


def files_page() -> str:
    """The page on files with its tables of datasets made anew."""
    text = (HERE / "files.md").read_text(encoding="utf-8")
    for title, table in (("a modal body", MODAL_BODY), ("results", RESULTS)):
        begin, end = f"<!-- datasets of {title} -->\n", "\n<!-- end of datasets -->"
        pattern = re.escape(begin) + ".*?" + re.escape(end)
        lines = "\n".join(_datasets(table))
        text, count = re.subn(pattern, lambda _, new=f"{begin}\n{lines}\n{end}": new, text, flags=re.DOTALL)
        assert count == 1, title
    return text


NAMES = {
    "points": "BODY.POINT",
    "settling": "BODY.POINT",
    "compliance": "BODY.POINT",
    "joints": "JOINT",
    "torque_price": "JOINT",
    "trajectories": "TRAJECTORY",
    "pzt": "LAYOUT",
    "interfaces": "NAME",
    "placement": "PATCHES",
    "robustness": "CONTROL",
    "controller": "MATRIX",
    "zeros": "K",
}
"""What * stands for behind these parts of a dataset's name; behind others for a body."""


def _datasets(table: Mapping[str, Meaning]) -> Iterator[str]:
    """A row for each group of datasets."""
    groups: dict[str, list[str]] = {}
    for pattern, about in table.items():
        group, _, name = _shown(pattern).rpartition("/")
        unit = f" ({about.unit})" if about.unit else ""
        groups.setdefault(group, []).append(f"`{name.lstrip('@')}`{unit} {about.what}{_columns(about.columns)}")
    yield from ("| group | datasets and attributes, with units |", "|---|---|")
    for group, texts in groups.items():
        yield f"| {f'`{group}/`' if group else ''} | {'; '.join(texts)} |"


def _shown(pattern: str) -> str:
    """A name with words in place of *."""
    names = NAMES | {"points": "NAME"} if pattern.startswith("stress/") else NAMES
    parts = pattern.replace("/**", "/…").split("/")
    shown = [names.get(before, "BODY") if part == "*" else part for before, part in pairwise(["", *parts])]
    return "/".join(shown)


def _columns(of: str) -> str:
    """What columns are, in words."""
    if of in LABELS and of != "stress":
        return ", by axis" if of == "axis" else f", by {', '.join(LABELS[of])}"
    return f", by {of.removesuffix(' of {}')}" if of.endswith(" of {}") else ""


def key_pages() -> dict[str, str]:
    """The pages by the name of their file."""
    pages = {}
    for kind, introduction in INTRODUCTION.items():
        lines = [f"# Keys of a {kind} file", "", introduction, ""]
        lines += _with_common_keys([list(section) for section in _sections(kind)])
        lines += _lacks() if kind == "scene" else ()
        pages[f"{kind}_keys.md"] = "\n".join(lines).rstrip("\n") + "\n"
    return pages


COMMON = 3  # tables that have a key with the same description, values and default


def _with_common_keys(sections: list[list[str]]) -> Iterator[str]:
    """Lines of the sections, with the keys of several tables in one table at the end."""
    rows = Counter(line for lines in sections for line in lines if line.startswith("| `"))
    common = {line for line, count in rows.items() if count >= COMMON}
    for lines in sections:
        own = [line for line in lines if line not in common]
        if len(own) == len(lines):
            yield from lines
            continue
        shared = ", ".join(line.split("|")[1].strip() for line in lines if line in common)
        own.insert(own.index(HEADER), f"[Common keys](#common-keys): {shared}.\n")
        yield from own if own[-2] != "|---|---|---|---|" else own[:-3]
    if common:
        yield from ("## Common keys", "", "Several tables have these keys.", "", HEADER, "|---|---|---|---|")
        yield from (*sorted(common), "")


def _lacks() -> Iterator[str]:
    """Unsupported features, and what to use instead."""
    yield from ("## Unsupported", "", "| feature | instead |", "|---|---|")
    yield from (f"| {what} | {instead} |" for what, instead, _ in UNSUPPORTED)


def _sections(kind: str) -> Iterator[Iterator[str]]:
    """Of the whole file first, then of every table in it; a body's link has the keys of a link file."""
    if kind != "scene":
        yield from (_section(name, record, {"": record}) for name, record in _records(schema(kind)).items())
        return
    everything, *parts = (_records(scene_in(space)) for space in (None, "planar", "spatial"))
    for name, record in everything.items():
        if name not in LINK_TABLES:
            of_spaces = zip(("planar", "3D"), parts, strict=True)
            yield _section(name, record, {space: part[name] for space, part in of_spaces if name in part})


def _records(described: Schema) -> dict[str, Schema]:
    """By name; the whole file first."""
    whole = {"the file": described} if "properties" in described else {}
    return whole | {name: record for name, record in described["$defs"].items() if "properties" in record}


def _section(name: str, record: Schema, parts: dict[str, Schema]) -> Iterator[str]:
    """Of a table with all its keys, and what it is in each space."""
    about = record.get("description", "").splitlines()  # stars are products here, not emphasis
    yield from (f"## {name}", "", *(line.replace("*", "\\*") for line in about), "")
    if len(parts) < 2 and "" not in parts:
        yield from (f"In {next(iter(parts))} scenes only.", "")
    yield from (HEADER, "|---|---|---|---|")
    for key, entry in record["properties"].items():
        having = {space: part for space, part in parts.items() if key in part["properties"]}
        only = f" ({next(iter(having))} only)" if len(having) < len(parts) else ""
        value = _kind(entry)  # tables say by themselves which scenes have them
        if "](" not in value:
            value = _each({space: _kind(part["properties"][key]) for space, part in having.items()})
        default = _each({space: _default(key, part) for space, part in having.items()})
        yield f"| `{key}`{only} | {_meaning(key, entry)} | {value} | {default} |"
    yield ""


def _each(texts: dict[str, str]) -> str:
    """The one text, or that of each space."""
    if len(set(texts.values())) == 1:
        return next(iter(texts.values()))
    return "; ".join(f"{space}: {text or 'none'}" for space, text in texts.items())


def _default(key: str, record: Schema) -> str:
    return "required" if key in record.get("required", []) else _code(record["properties"][key].get("default"))


def _meaning(key: str, entry: dict[str, Any]) -> str:
    """The description; of a constant, for which editors show the first line about its table, what it is."""
    if "const" in entry and key != "check":
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
