"""Names, files and streams that are out of the ordinary: they work, or one message says why not; never a traceback."""

import csv
import io
import os
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import pytest
from loops import OWN_CONTROLLER

from ffrobot.common.tables import as_csv

SHORT = {"end = 1.0": "end = 0.004"}
NAMES = ["$\\bad{$ $x_1^{", "<b>größe& <script>", "関節 🤖", "[red]{{ 7*7 }}%s", "_a", "e\u0301\u202e"]


@pytest.fixture(scope="module")
def solved(case_copy_of_module, ffrobot):
    """A short run whose names are markup, formulas and letters of other scripts."""
    folder = case_copy_of_module("two_link").parent
    text = (folder / "scene.toml").read_text(encoding="utf-8")
    renamed = dict(zip(('"link1', '"link2', '"A"', '"tip"', '"inverse"', '"two_link"'), NAMES, strict=True))
    for old, new in SHORT.items():
        text = text.replace(old, new)
    text = text.replace('link = "link1.toml"', "LINK1").replace('link = "link2.toml"', "LINK2")
    for old, new in renamed.items():
        quoted = new.replace("\\", "\\\\")
        text = text.replace(old, f'"{quoted}' if not old.endswith('"') else f'"{quoted}"')
    text = text.replace("link1 =", f"'{NAMES[0]}' =").replace("link2 =", f"'{NAMES[1]}' =")
    text = text.replace("LINK1", 'link = "link1.toml"').replace("LINK2", 'link = "link2.toml"')
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    (folder / "figures.toml").unlink()
    ffrobot.ok("solve", "scene.toml", cwd=folder)
    return folder


@pytest.mark.parametrize(
    "command",
    [
        ("info",),
        ("feasibility",),
        ("report",),
        ("plot", "--format", "svg", "--only", "angle_*"),
        pytest.param(("view", "--frames", "2"), marks=pytest.mark.nightly),
    ],
)
def test_names_of_all_kinds(solved, ffrobot, command):
    ffrobot.ok(command[0], "scene.results.h5", *command[1:], cwd=solved)
    if command[0] == "info":
        with h5py.File(solved / "scene.results.h5") as file:
            assert NAMES[4] in file
            assert f"{NAMES[4]}/joints/{NAMES[2]}/moment" in file
    if command[0] == "report":
        page = (solved / "scene.results.html").read_text(encoding="utf-8")
        assert NAMES[1] not in page  # but as text
    if command[0] == "plot":
        assert len(list((solved / "scene.results.figures").iterdir())) == 2


def test_byte_order_mark(case_copy, ffrobot):
    scene = case_copy("two_link")
    text = scene.read_text(encoding="utf-8").replace("end = 1.0", "end = 0.004")
    scene.write_text(text, encoding="utf-8-sig")
    ffrobot.ok("solve", scene)


@pytest.mark.parametrize("command", ["info", "feasibility"])
@pytest.mark.parametrize(
    "settings",
    [
        {"PYTHONIOENCODING": "ascii"},
        {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": ""},
    ],
)
def test_output_of_few_characters(solved, ffrobot, command, settings):
    assert "\\u" in ffrobot.ok(command, "scene.results.h5", cwd=solved, env=settings).stdout


def test_output_that_goes_nowhere(solved, ffrobot):
    def info(how):
        return subprocess.run(
            f"{ffrobot.path} info scene.results.h5 {how}", shell=True, cwd=solved, env=ffrobot.environment,
            capture_output=True, text=True,
        )  # fmt: skip

    full, closed, silent = info("> /dev/full"), info(">&-"), info(">&- 2>&-")
    assert (full.returncode, full.stderr) == (1, "ffrobot: standard output: No space left on device\n")
    assert (closed.returncode, closed.stderr, silent.returncode) == (0, "", 0)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("solve", "a" * 5000), "expected the name of a file, found File name too long"),
        (("solve", "loop"), "loop: expected the name of a file, found links that lead in a circle"),
        (("solve", "scene.toml", "-o", "loop"), "loop: expected the name of a file, found links that lead in a circle"),
        (("info", "a" * 300), "File name too long"),
        (("import", "scene.toml", "-o", "robot"), "found none of these: ffrobot solve takes scenes"),
        (("sweep", "scene.toml", "--vary", "gravity.1=0:1:1000000000"), "expected at most 100000 values"),
        (("sweep", "scene.toml", *("--vary", "gravity.1=0:1:1000", "--vary", "gravity.0=0:1:1000")), "100000 runs"),
        (("sweep", "scene.toml", "--vary", "gravity.1=" + "[" * 3000), "expected FIRST:LAST:COUNT"),
        (("sweep", "scene.toml", "--vary", "gravity.1=" + "1" * 5000), "expected FIRST:LAST:COUNT"),
        (("sweep", "scene.toml", "--vary", "gravity.²=1"), 'found "²"'),
        (("sweep", "scene.toml", "--vary", "gravity.1=0", "-o", "scene.toml"), "scene.toml"),
    ],
)
def test_arguments(two_link_copy, refused, arguments, named):
    folder = two_link_copy()
    os.symlink("loop", folder / "loop")
    assert named in refused(folder, *arguments)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("plot", "--movie", "m.gif", "--seconds", "nan"), "'--seconds': nan is not a finite number"),
        (("view", "--scale", "inf"), "'--scale': inf is not a finite number"),
        (("plot", "--analysis", "none"), "--analysis: expected it with --movie only"),
        (("plot", "--scale", "3"), "--scale: expected it with --movie only"),
    ],
)
def test_options_of_pictures(solved, ffrobot, arguments, named):
    done = ffrobot(arguments[0], solved / "scene.results.h5", *arguments[1:], cwd=solved)
    assert done.returncode == 2
    assert named in done.stderr


@pytest.mark.parametrize(
    ("code", "named"),
    [
        (
            "def controller(setup):\n    return 1 / 0\n",
            "ZeroDivisionError: division by zero (line 2 of own.py, in contr",
        ),
        ("def controller(setup):\n    pass\n", "expected it to return a function (k, y) → u, found None"),
        ("def controller(setup):\n    return lambda k, y: [][k]\n", "sample 0, t = 0 s: IndexError: list index out of"),
        ("raise SystemExit(0)\n", "own.py: controller: SystemExit: 0 (line 1 of own.py"),
    ],
)
def test_controllers_that_fail(two_link_copy, ffrobot, code, named):
    folder = two_link_copy({"scene.toml": SHORT})
    with (folder / "scene.toml").open("a", encoding="utf-8") as scene:
        scene.write(OWN_CONTROLLER)
    (folder / "own.py").write_text(code, encoding="utf-8")
    done = ffrobot("solve", "scene.toml", cwd=folder)
    assert done.returncode in (1, 2)
    (message,) = done.stderr.splitlines()
    assert "own.py" in message
    assert named in message


@pytest.mark.nightly
def test_sample_of_the_campaign():
    """tests/campaigns/mutations.py, a few changes of one case; others each time it is run by hand."""
    script = Path(__file__).parents[1] / "campaigns" / "mutations.py"
    done = subprocess.run(
        [sys.executable, script, "--seed", "1", "--count", "12", "--case", "slider_crank"],
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    assert "solve: rejected" in done.stdout


def test_a_cache_without_room_does_no_harm(two_link_copy, ffrobot, small_disk):
    """Forms are compiled elsewhere; where there is no room at all, one message names the folder."""
    folder, small_disk = two_link_copy(), small_disk("300k")
    shutil.copy(Path(__file__).parents[2] / "cases" / "two_link_solid" / "link1.toml", folder)
    link, cache = ("link", "link1.toml", "-o", "one.h5"), {"XDG_CACHE_HOME": str(small_disk)}
    assert ffrobot.ok(*link, cwd=folder, env=cache).stderr == ""
    (folder / "one.h5").unlink()
    done = ffrobot(*link, cwd=folder, env=cache | {"TMPDIR": str(small_disk)})
    assert done.returncode == 1
    message = done.stderr.splitlines()[-1]  # the compiler may have complained before
    assert "cannot compile finite elements: No space left on device" in message
    assert str(small_disk) in message


@pytest.mark.parametrize(
    "arguments",
    [
        ("solve", "pipe"),
        ("link", "pipe"),
        ("info", "pipe"),
        ("report", "pipe"),
        ("import", "pipe", "-o", "out"),
        ("solve", "/dev/zero"),
    ],
)
def test_pipes_and_devices_are_refused(refused, two_link_copy, arguments):
    """Reading them may never end."""
    folder = two_link_copy()
    os.mkfifo(folder / "pipe")
    what = "pipe: expected a regular file, found a pipe (FIFO)" if "pipe" in arguments else "found a device"
    assert what in refused(folder, *arguments, timeout=60)


def test_cells_that_spreadsheets_would_run():
    """They are text to them, and numbers stay numbers."""
    cells = ["=cmd|' /C calc'!A0", "+1+cmd|'x'", "-2-1", "@SUM(1)", "\t=1", "arm", "-", -1.5, "-1.5", 'a"b', ""]
    (found,) = csv.reader(io.StringIO(as_csv([cells]), newline=""))
    assert found == [*("'" + str(cell) for cell in cells[:5]), *map(str, cells[5:])]
