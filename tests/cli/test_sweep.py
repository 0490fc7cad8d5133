"""`ffrobot sweep`: grids and samples over any key, failures as rows, taken up again, several processes."""

import math
import tomllib
from math import prod

import pytest
import tomli_w
from small_robots import rows
from tables_3d import pin, planar

HEIGHTS = "links.rod.geometry.section.diameter=0.004:0.008:3"
MASSES = "body.crank.rigid.mass=0.03,0.04"

ROD = {"mass": 1.0, "inertia": 1e-9, "center": [0.5, 0.0], "points": {"root": [0.0, 0.0], "tip": [0.5, 0.0]}}
PENDULUM = planar(
    [{"name": name, "rigid": ROD} for name in ("upper", "lower")],
    [pin("A", "ground", "upper.root"), pin("B", "upper.tip", "lower.root")],
    {"name": "at_rest", "kind": "linear"},
    initial={"angles": {"upper": "-90*deg", "lower": "-90*deg"}},
)


@pytest.fixture
def short_scene(case_copy):
    """The slider-crank's inverse analysis, a fifth of a turn."""
    scene = case_copy("slider_crank")
    head, _, _ = scene.read_text(encoding="utf-8").partition("[[analysis]]")
    analysis = '[[analysis]]\nname = "inverse"\nkind = "pcid"\nend = 0.01\noutput_step = 0.001\ntolerance = 1e-4\n'
    scene.write_text(head + analysis, encoding="utf-8")
    return scene


def table(scene):
    return rows(scene.with_suffix(".sweep") / "table.csv")


def deflections(scene):
    return [float(row["inverse/points/rod.mid/deflection max"]) for row in table(scene)]


def test_what_is_varied_is_what_is_solved(ffrobot, short_scene):
    """A grid over link and scene; a row equals a solve of the scene with its values written in by hand."""
    ffrobot.ok("sweep", short_scene, "--vary", HEIGHTS, "--vary", MASSES)
    found = table(short_scene)
    assert [(row["links.rod.geometry.section.diameter"], row["body.crank.rigid.mass"]) for row in found] == [
        (diameter, mass) for diameter in ("0.004", "0.006", "0.008") for mass in ("0.03", "0.04")
    ]
    thin, *_, as_it_is, _, thick = deflections(short_scene)
    assert thin > 2 * thick  # inertia loads go as d², stiffness as d⁴
    text = short_scene.read_text(encoding="utf-8")
    assert "mass = 0.03308" in text
    by_hand = short_scene.with_name("by_hand.toml")
    by_hand.write_text(text.replace("mass = 0.03308", "mass = 0.04"), encoding="utf-8")
    assert ffrobot("sweep", by_hand, "--vary", 'name="same"').returncode == 0
    assert deflections(by_hand) == [as_it_is]


def test_failures_are_rows(ffrobot, short_scene):
    vary = ["--vary", "body.crank.rigid.mass=0.03,-1", "--vary", "analysis.inverse.max_steps=5,99999"]
    ffrobot.ok("sweep", short_scene, *vary)
    found = table(short_scene)
    assert [row["status"] for row in found] == ["failed", "completed", "wrong input", "wrong input"]
    assert "too many steps" in found[0]["message"]
    assert "expected a number greater than 0, found -1" in found[2]["message"]
    ended = ffrobot("sweep", short_scene, "--vary", "analysis.inverse.max_steps=5", "-o", short_scene.with_name("none"))
    assert ended.returncode == 1
    assert "no run completed" in ended.stderr


def test_taken_up_again(ffrobot, short_scene):
    assert ffrobot("sweep", short_scene, "--vary", MASSES).returncode == 0
    folders = short_scene.with_suffix(".sweep") / "runs"
    first, second = (folders / name / "row.json" for name in ("0000", "0001"))
    before, expected = first.stat().st_mtime_ns, deflections(short_scene)
    second.unlink()
    assert ffrobot("sweep", short_scene, "--vary", MASSES, "--no-keep").returncode == 0
    assert first.stat().st_mtime_ns == before
    assert second.exists()
    assert not list(folders.glob("*/results.h5"))
    assert deflections(short_scene) == expected


def test_latin_hypercube(ffrobot, short_scene):
    vary = ["--vary", "payload.0.mass=0.01:1:2:log", "--vary", 'trajectory.slider.x="0.35","0.3"']
    text = short_scene.read_text(encoding="utf-8") + '\n[[payload]]\npoint = "rod.mid"\nmass = 0.1\n'
    short_scene.write_text(text, encoding="utf-8")
    ffrobot.ok("sweep", short_scene, *vary, "--sample", 4, "--seed", 7)
    found = table(short_scene)
    decades = sorted(float(row["payload.0.mass"]) for row in found)
    assert all(0.01 * 100 ** (k / 4) <= mass < 0.01 * 100 ** ((k + 1) / 4) for k, mass in enumerate(decades))
    assert prod(row["trajectory.slider.x"] in ("0.35", "0.3") for row in found)


@pytest.mark.parametrize(
    ("vary", "message"),
    [
        ("gravity", "--vary: expected KEY=VALUES"),
        ("gravity.1=", "--vary: expected FIRST:LAST:COUNT"),
        ("gravity.1=1:2:x", "--vary: expected FIRST:LAST:COUNT with two numbers and a count"),
        ("gravity.1=-1:1:3:log", "two ends of one sign"),
        ("gravity.7=1,2", '--vary: expected one of "0", "1" in "gravity.7", found "7"'),
        ("body.cranck.rigid.mass=1,2", 'did you mean "crank"?'),
        ("links.crank.mesh.elements=4,8", 'a body that has a link file ("rod")'),
        ("links.rod.mesh.element=4,8", 'did you mean "elements"?'),
        ("gravitation=1,2", "with gravitation = 1"),
        ("name.first=1,2", '--vary: expected a table or a list at "name"'),
        ("body.0.modes,body.crank.modes=1", "found body.0.modes and body.crank.modes, which are one"),
        ("gravity.1,gravity.1=1,2", "expected every key once, found gravity.1 several times"),
    ],
)  # fmt: skip
def test_wrong_variations(refused, short_scene, vary, message):
    assert message in refused(short_scene.parent, "sweep", "scene.toml", "--vary", vary)


def test_names_of_collected_datasets(ffrobot, short_scene):
    """With dots, without the analysis; of no dataset a message, and NaN."""
    names = ("inverse/points/rod.mid/deflection", "points.rod.mid.deflection", "points.rod.mid.deflektion")
    options = [text for name in names for text in ("--collect", name)]
    done = ffrobot.ok("sweep", short_scene, "--vary", "gravity.1=-9.81", *options)
    (row,) = table(short_scene)
    assert row[f"{names[0]} max"] == row[f"{names[1]} max"] != ""
    assert f"{names[2]} max" not in row
    assert f'found no "{names[2]}" in run 0 (did you mean "inverse/points/rod.mid/deflection"?)' in done.stderr


@pytest.mark.parametrize("column", ["", "[0]"])
def test_what_outputs_miss_is_collected(ffrobot, tmp_path, column):
    """A force of 8 N m for 3 ms between outputs, borne by a motor at rest: its peak and RMS in closed form."""
    run = {"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": 0.1}
    keys = {"gravity": (0.0, 0.0), "trajectory": [{"name": "rest", "joint": "O", "value": "0"}]}
    keys["load"] = [{"joint": "O", "moment": "where(t < 0.5011, 0, where(t < 0.5041, 8, 0))"}]
    scene = planar([{"name": "arm", "rigid": ROD}], [pin("O", "ground", "arm.root")], run, **keys)
    path, names = tmp_path / "scene.toml", [f"joints.O.moment{column}:{one}" for one in ("max", "rms")]
    path.write_text(tomli_w.dumps(scene))
    ffrobot.ok("sweep", path, "--vary", "body.arm.rigid.mass=1,2", *(w for name in names for w in ("--collect", name)))
    for row in table(path):
        found = [float(row[name.replace(":", " ")]) for name in names]
        assert found == pytest.approx([8.0, 8.0 * math.sqrt(3e-3)], rel=1e-5)


def test_wrong_reduction_and_folder(refused, ffrobot, short_scene):
    folder = short_scene.parent
    message = refused(folder, "sweep", "scene.toml", "--vary", MASSES, "--collect", "inverse/time:mean")
    assert "max|rms|first|last|lowest" in message
    assert ffrobot("sweep", "scene.toml", "--vary", MASSES, cwd=folder).returncode == 0
    assert "another's" in refused(folder, "sweep", "scene.toml", "--vary", HEIGHTS)


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        pytest.param("scene.toml", "", "", marks=pytest.mark.nightly),
        ("rod.toml", "youngs_modulus = ", "youngs_modulus = 1"),
        pytest.param("path.csv", "0.01,0.28", "0.01,0.27", marks=pytest.mark.nightly),
    ],
)
def test_rows_of_other_input_are_computed_again(ffrobot, short_scene, name, old, new):
    """All of them, or only those that are stale: what has changed is said."""
    folder = short_scene.parent
    (folder / "path.csv").write_text("t,x\n0,0.35\n0.005,0.31\n0.01,0.28\n", encoding="utf-8")
    scene = tomllib.loads(short_scene.read_text(encoding="utf-8"))
    scene["trajectory"] = [{"name": "slider", "point": "slider.pin", "waypoints": "path.csv"}]
    scene["gravity"] = [0.0, -9.81]
    short_scene.write_text(tomli_w.dumps(scene), encoding="utf-8")
    command = ["sweep", short_scene, "--vary", MASSES]
    assert ffrobot(*command).returncode == 0
    before = table(short_scene)
    again = ffrobot(*command)
    assert "changed" not in again.stderr
    assert table(short_scene) == before
    content = (folder / name).read_text(encoding="utf-8")
    if name == "scene.toml":
        scene["gravity"] = [0.0, -1.62]
        content = tomli_w.dumps(scene)
    else:
        assert old in content
        content = content.replace(old, new)
    (folder / name).write_text(content, encoding="utf-8")
    done = ffrobot(*command)
    assert f"ffrobot: {name} has changed since: 2 rows computed again" in done.stderr
    assert all(row["status"] == "completed" for row in table(short_scene))
    changed = [key for key in before[0] if before[0][key] != table(short_scene)[0][key] and "wall" not in key]
    assert changed


@pytest.mark.parametrize("command", ["sweep", "sensitivity", "uncertainty", "optimise"])
def test_bodies_named_like_paths_write_nothing(ffrobot, short_scene, tmp_path, command):
    """The file that the name leads to stays, and none is made."""
    precious = tmp_path / "precious.toml"
    precious.write_text("mine = 1\n", encoding="utf-8")
    name = str(precious.with_suffix(""))
    scene = tomllib.loads(short_scene.read_text(encoding="utf-8"))
    next(body for body in scene["body"] if body["name"] == "rod")["name"] = name
    short_scene.write_text(tomli_w.dumps(scene), encoding="utf-8")
    key = f"links.{name}.damping.ratio"
    of = ["peak joints.crank.moment"] if command != "sweep" else []
    arguments = {
        "sweep": ["--vary", f"{key}=0.01,0.02"],
        "sensitivity": ["--of", *of, "--to", key],
        "uncertainty": ["--of", *of, "--spread", f"{key}=normal(0.01, 0.001)"],
        "optimise": ["--minimise", *of, "--vary", f"{key}=0.01:0.02"],
    }[command]
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    done = ffrobot(command, short_scene, *arguments)
    assert done.returncode == 2, done.stderr
    assert 'expected a name without "/"' in done.stderr
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_spectra(ffrobot, tmp_path):
    """`first` is the lowest frequency, not the largest of all: of a double pendulum both are known.

    Two point masses m on massless rods l that hang down: ω² = (2 ∓ √2) g/l. Rods of mass would have other numbers.
    """
    (tmp_path / "scene.toml").write_text(tomli_w.dumps(PENDULUM), encoding="utf-8")
    asked = [f"at_rest/linear/frequency{one}" for one in (":first", ":last", ":rms", ":max", "[0]:first", "[1]:first")]
    collect = [word for one in asked for word in ("--collect", one)]
    ffrobot.ok("sweep", tmp_path / "scene.toml", "--vary", "gravity.1=-9.81,-1.62", *collect)
    for row, g in zip(table(tmp_path / "scene.toml"), (9.81, 1.62), strict=True):
        low, high = (math.sqrt((2 + sign * math.sqrt(2)) * g / 0.5) / (2 * math.pi) for sign in (-1, 1))
        found = [float(row[one.replace(":", " ")]) for one in asked]
        assert found == pytest.approx([low, low, low, high, low, high], rel=1e-6)
