"""What a scene's Python file imports from below its folder counts as part of it: in sweeps, studies, resumes."""

import pytest
import small_robots
import tomli_w
from loops import wheel

import ffrobot as program
from ffrobot.common.python_files import digest_of_function

HERE = "import os, sys\nsys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), {!r}))\n"
CONTROLLER = """
def controller(setup):
    {inside}
    place = setup.columns("joint/O")
    def at_sample(k, y):
        u = np.zeros(len(setup.inputs))
        u[setup.places("joint/O")] = GAIN * (setup.reference[k, place] - y[place] + 0.01)
        return u
    return at_sample
"""
WAYS = {
    "name": ("helper.py", HERE.format("") + "from helper import GAIN\n", "pass"),
    "module of a module": ("deep.py", HERE.format("") + "from helper import GAIN\n", "pass"),
    "folder beside": ("lib/helper.py", HERE.format("lib") + "from helper import GAIN\n", "pass"),
    "package": ("own_parts/inner/gains.py", HERE.format("") + "from own_parts.inner.gains import GAIN\n", "pass"),
    "in words": (
        "helper.py",
        HERE.format("") + "import importlib\nGAIN = importlib.import_module('hel' + 'per').GAIN\n",
        "pass",
    ),
    "later": ("helper.py", HERE.format("") + "GAIN = 0.0\n", "global GAIN; import helper; GAIN = helper.GAIN"),
}


@pytest.fixture
def folder(tmp_path):
    """Writes a wheel, with a controller whose gain comes from elsewhere."""

    def write(way, gain):
        file, head, inside = WAYS[way]
        folder = tmp_path / "scene"
        (folder / file).parent.mkdir(parents=True)
        scene = tomli_w.dumps(wheel("own.py:controller", sensor=[{"joint": "O"}]))
        (folder / "scene.toml").write_text(scene, encoding="utf-8")
        own = "import numpy as np\n" + head + CONTROLLER.format(inside=inside)
        (folder / "own.py").write_text(own, encoding="utf-8")
        if file == "deep.py":
            (folder / "helper.py").write_text("from deep import GAIN\n", encoding="utf-8")
        (folder / file).write_text(f"GAIN = {gain}\n", encoding="utf-8")
        return folder / "scene.toml", folder / file

    return write


def rows(folder):
    table = small_robots.rows(folder / "table.csv")
    return [{key: value for key, value in row.items() if "wall_seconds" not in key} for row in table]


@pytest.mark.parametrize(
    "way",
    ["package", pytest.param("in words", marks=pytest.mark.nightly), pytest.param("later", marks=pytest.mark.nightly)],
)
def test_sweeps(ffrobot, folder, way):
    """Rows of other modules are computed again, and are those of a new folder; rows of the same ones stay."""
    scene, helper = folder(way, 5.0)
    command = ["sweep", scene, "--vary", "gravity.1=-9.81,-1.62", "--collect", "loop/joints/O/moment:rms"]
    assert ffrobot(*command).returncode == 0
    first = rows(scene.with_suffix(".sweep"))
    assert "changed" not in ffrobot(*command).stderr
    helper.write_text("GAIN = 400.0\n", encoding="utf-8")
    done = ffrobot(*command)
    assert f"ffrobot: {helper.name} has changed since: 2 rows computed again" in done.stderr
    again = rows(scene.with_suffix(".sweep"))
    assert ffrobot(*command, "-o", scene.parent / "new").returncode == 0
    assert again == rows(scene.parent / "new")
    assert all(row["status"] == "completed" for row in again)
    assert again != first


def test_failed_imports(ffrobot, folder):
    """A module that could not be imported counts as well: it is mended, and its rows are computed again."""
    scene, helper = folder("module of a module", 5.0)
    helper.write_text("GAIN = 1 / 0\n", encoding="utf-8")
    command = ["sweep", scene, "--vary", "gravity.1=-9.81,-1.62"]
    ffrobot(*command)
    assert all("ZeroDivisionError" in row["message"] for row in rows(scene.with_suffix(".sweep")))
    helper.write_text("GAIN = 5.0\n", encoding="utf-8")
    done = ffrobot(*command)
    assert "deep.py has changed since: 2 rows computed again" in done.stderr
    assert [row["status"] for row in rows(scene.with_suffix(".sweep"))] == ["completed"] * 2


@pytest.mark.nightly
def test_studies(ffrobot, folder):
    scene, helper = folder("name", 5.0)
    command = ["uncertainty", scene, "--of", "peak loop/joints.O.moment", "--by", "gradients"]
    command += ["--spread", "body.w.rigid.inertia=±1%"]
    ffrobot.ok(*command)
    file = scene.with_suffix(".uncertainty") / "uncertainty.csv"
    before = file.read_text()
    helper.write_text("GAIN = 400.0\n", encoding="utf-8")
    assert ffrobot(*command).returncode == 0
    assert ffrobot(*command, "-o", scene.parent / "new").returncode == 0
    assert file.read_text() == (scene.parent / "new/uncertainty.csv").read_text() != before


@pytest.mark.parametrize("moved", [False, True])
def test_resumes(ffrobot, folder, moved):
    """Also in another place than the first run."""
    scene, helper = folder("folder beside", 5.0)
    assert ffrobot("solve", scene).returncode == 0
    if moved:
        place = scene.parent.rename(scene.parent.with_name("moved"))
        scene, helper = place / scene.name, place / helper.relative_to(scene.parent)
    done = ffrobot.ok("solve", scene, "--resume")
    helper.write_text("GAIN = 400.0\n", encoding="utf-8")
    done = ffrobot("solve", scene, "--resume")
    assert done.returncode == 2
    assert "found that the file lib/helper.py, which a Python file imports, has changed" in done.stderr


def test_functions_of_scenes_made_in_python(tmp_path, monkeypatch):
    """Of the modules that they name, what is not installed counts."""
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "own_helper.py").write_text("def load(t):\n    return 3.0 * t\n", encoding="utf-8")
    import own_helper

    def force(t):
        return own_helper.load(t) + program.__version__.count("x")

    before = digest_of_function(force)
    assert digest_of_function(force) == before
    (tmp_path / "own_helper.py").write_text("def load(t):\n    return 4.0 * t\n", encoding="utf-8")
    assert digest_of_function(force) != before
