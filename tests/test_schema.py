"""JSON schemas: they take what the program takes, and refuse the mistakes in single keys that it refuses."""

import copy
import json
import re
import tomllib
from pathlib import Path

import jsonschema
import pytest
from checkpoint_mechanisms import CASES as CHECKPOINTS
from checkpoint_mechanisms import FOLDER

from ffrobot.common.errors import InputError
from ffrobot.fe_models.link_file import read_link
from ffrobot.scene.load import load_robot, make_scene
from ffrobot.schema import schema

CASES = Path(__file__).parents[1] / "cases"
FILES = {path: path.read_text(encoding="utf-8") for path in sorted(CASES.glob("*/*.toml"))}
SCENES = [path for path, text in FILES.items() if "[[analysis]]" in text]
ROBOTS = [path for path, text in FILES.items() if "[[body]]" in text and path not in SCENES]
FIGURES = [path for path in FILES if path.name == "figures.toml"]
LINKS = [path for path in FILES if path not in (*SCENES, *ROBOTS, *FIGURES)]


@pytest.fixture(scope="module")
def validator(ffrobot):
    """Validators of what the command prints."""

    def make(kind):
        done = ffrobot.ok("schema", kind)
        printed = json.loads(done.stdout)
        assert kind in ("scene", "spatial") or printed == schema(kind)  # those of scenes take seconds to make
        cls = jsonschema.validators.validator_for(printed)
        cls.check_schema(printed)
        return cls(printed)

    return {kind: make(kind) for kind in ("link", "scene", "spatial", "figures")}


def parsed(path):
    return tomllib.loads(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("path", [*SCENES, *ROBOTS], ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_scenes_of_the_cases_pass(validator, path):
    """Robots are scenes without analyses, as `ffrobot smooth` takes them."""
    scene, tables = load_robot(path), {"analysis": [{"name": "rest", "kind": "static"}]} | parsed(path)
    validator["scene"].validate(tables)
    assert validator["spatial"].is_valid(tables) is not scene.is_planar


@pytest.mark.parametrize("name", CHECKPOINTS)
def test_scenes_in_3d_pass(validator, name):
    scene = parsed(FOLDER / f"{name}.toml")
    validator["spatial"].validate(scene)
    validator["scene"].validate(scene)


@pytest.mark.parametrize("path", [*LINKS, *FIGURES], ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_links_and_figures_of_the_cases_pass(validator, path):
    if path in LINKS:
        read_link(path)
    validator["link" if path in LINKS else "figures"].validate(parsed(path))


@pytest.mark.parametrize("kind", ["link", "scene", "spatial", "figures"])
def test_every_key_says_what_it_means_in_what_toml_can_say(validator, kind):
    """Hover text of editors, and the pages of keys: the text under the field in its record."""
    described = validator[kind].schema
    tables = {"the file": described, **described["$defs"]}
    assert not [
        f"{name}.{key}"
        for name, table in tables.items()
        for key, entry in table.get("properties", {}).items()
        if not entry.get("description", "").endswith(".")
    ]
    assert not re.search('"null"|: null', json.dumps(described))


def test_link_in_a_scene_passes(validator):
    """Without a name, which is the body's."""
    scene = parsed(CASES / "two_link" / "scene.toml")
    link = parsed(CASES / "two_link" / scene["body"][0]["link"])
    scene["body"][0]["link"] = {key: value for key, value in link.items() if key != "name"}
    validator["scene"].validate(scene)
    del scene["body"][0]["link"]["mesh"]
    with pytest.raises(jsonschema.ValidationError):
        validator["scene"].validate(scene)


def edited(data, keys, value):
    """A copy of `data` with one entry replaced, added, or (None) left out."""
    data = copy.deepcopy(data)
    *path, last = keys
    table = data
    for key in path:
        table = table[key]
    if value is None:
        del table[last]
    else:
        table[last] = value
    return data


SCENE_MISTAKES = {
    "unknown key": (("moters",), "section"),
    "missing key": (("gravity",), None),
    "wrong type": (("analysis", 0, "end"), "1.0"),
    "number out of range": (("pzt", 0, "length"), -0.05),
    "unknown word": (("joint", 0, "type"), "revolut"),
    "table for a list": (("body",), {"name": "link1"}),
    "planar scene called a 3D one": (("space",), "spatial"),
    "axis of a revolute joint": (("joint", 0, "axis"), [0.0, 0.0, 1.0]),
    "joint of 3D": (("joint", 0, "type"), "spherical"),
    "force of 3D": (("load",), [{"point": "link2.tip", "z": "t"}]),
    "inertia of 3D": (("payload",), [{"point": "link2.tip", "mass": 1.0, "inertia": [0.1, 0.1, 0.1]}]),
    "components of 3D": (("actuation_points",), [{"body": "link1", "x": [0.5]}]),
}
MISTAKES_IN_3D = {
    "planar scene": (("space",), "planar"),
    "no space": (("space",), None),
    "joint without its axis": (("joint", 0, "axis"), None),
    "angles of bodies": (("initial",), {"angles": {"upper": 0.1}}),
    "inertia of the plane": (("payload",), [{"point": "fore.tip", "mass": 1.0, "inertia": 0.1}]),
}
LINK_MISTAKES = {
    "unknown key": (("material", "densty"), 1.0),
    "missing key": (("geometry", "length"), None),
    "negative": (("material", "density"), -7850.0),
    "unknown section": (("geometry", "section", "shape"), "square"),
    "unknown kind": (("geometry", "kind"), "shell"),
}


@pytest.mark.parametrize(("case", "mistake"), [
    *(("two_link", name) for name in SCENE_MISTAKES), *(("arm_3r", name) for name in MISTAKES_IN_3D)
])  # fmt: skip
def test_mistakes_in_a_scene_are_refused_by_both(validator, case, mistake):
    of_case = SCENE_MISTAKES if case == "two_link" else MISTAKES_IN_3D
    data = edited(parsed(CASES / case / "scene.toml"), *of_case[mistake])
    with pytest.raises(InputError):
        make_scene(folder=CASES / case, **data)
    assert not validator["scene"].is_valid(data)


@pytest.mark.parametrize(("keys", "value"), LINK_MISTAKES.values(), ids=LINK_MISTAKES)
def test_mistakes_in_a_link_are_refused_by_both(validator, tmp_path, keys, value):
    import tomli_w

    data = edited(parsed(CASES / "two_link" / "link1.toml"), keys, value)
    (tmp_path / "link.toml").write_text(tomli_w.dumps(data), encoding="utf-8")
    with pytest.raises(InputError):
        read_link(tmp_path / "link.toml")
    assert not validator["link"].is_valid(data)


def test_key_of_the_schema_itself_is_none_of_the_file(validator):
    """`#:schema` is a comment to TOML: a file that names its schema is still a file of the program."""
    text = "#:schema ./scene.schema.json\n" + (CASES / "two_link" / "scene.toml").read_text(encoding="utf-8")
    validator["scene"].validate(tomllib.loads(text))
