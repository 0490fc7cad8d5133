"""Processes that perform the runs of sweeps one after the other: what a run does to its process is gone with it."""

import os
import platform
import signal
import subprocess
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import tomli_w
from datasets import datasets
from loops import wheel
from small_robots import rows

import ffrobot
from ffrobot.batch.worker import Done, Worker, own_worker
from ffrobot.sweep.runs import SweepRun, perform

CONTROLLER = '''
"""A motor's constant command, by functions that do much else to their process."""

import os
import random
import signal
import sys
import time
import warnings
from pathlib import Path

import numpy as np

NOTES = Path(__file__).with_name("notes.txt")
traces = [name for name in ("mark", "numpy.marked") if name in sys.modules]
traces += ["folder"] * (Path.cwd().name == "elsewhere") + ["environment"] * ("FFROBOT_MARK" in os.environ)
traces += ["warnings"] * (warnings.filters[0][0] == "error") + ["NumPy"] * (np.geterr()["over"] == "raise")
DRAWN = f"{np.random.random()} {random.random()}"


def note(text):
    with NOTES.open("a") as file:
        print(os.getppid(), os.getpid(), text, file=file)


def constant(setup):
    note(" ".join(traces) or "clean")
    return lambda k, y: np.full(len(setup.inputs), 0.1)


def careless(setup):
    elsewhere = Path(__file__).with_name("elsewhere")
    elsewhere.mkdir(exist_ok=True)
    os.chdir(elsewhere)
    os.environ["FFROBOT_MARK"] = "1"
    sys.modules["mark"] = sys.modules["numpy.marked"] = sys
    warnings.simplefilter("error")
    np.seterr(over="raise")
    np.random.seed(0)
    random.seed(0)
    return constant(setup)


def drawing(setup):
    note(DRAWN)
    return lambda k, y: np.full(len(setup.inputs), 0.1)


def killed(setup):
    os.kill(os.getpid(), signal.SIGKILL)


def aborting(setup):
    os.abort()


def waiting(setup):
    def act(k, y):
        if k == 0:
            note("waits")
        time.sleep(0.05)
        return np.full(len(setup.inputs), 0.1)

    return act
'''


@pytest.fixture
def scene(tmp_path):
    """A wheel with a controller of the user's."""
    (tmp_path / "mine.py").write_text(CONTROLLER, encoding="utf-8")
    path = tmp_path / "scene.toml"
    path.write_text(tomli_w.dumps(wheel("mine.py:constant")), encoding="utf-8")
    return path


@pytest.fixture
def sweep(ffrobot, scene):
    """The table of a sweep over functions of that file."""

    def run(*functions, options=()):
        listed = ",".join(f'"{scene.parent}/mine.py:{name}"' for name in functions)
        vary = f"analysis.loop.controller.0.python={listed}"
        ffrobot.ok("sweep", scene, "--vary", vary, "--collect", "loop/joints/O/coordinate:last", "-j", 1, *options)
        return rows(scene.with_suffix(".sweep") / "table.csv")

    return run


def notes(scene):
    """(worker, process, text) of every run that told."""
    lines = scene.with_name("notes.txt").read_text(encoding="utf-8").splitlines()
    return [(int(worker), int(process), text) for worker, process, text in (line.split(" ", 2) for line in lines)]


def test_random_numbers_are_others_in_every_run(sweep, scene):
    """As of single runs: where nobody seeds them, the system does."""
    sweep("careless", "drawing", "drawing")
    drawn = [number for _, _, text in notes(scene)[1:] for number in text.split()]
    assert len(set(drawn)) == 4


def test_results_are_those_of_single_runs(sweep, scene, ffrobot, tmp_path):
    """To the last bit, and of a run after another one."""
    sweep("careless", "constant")
    run = scene.with_suffix(".sweep") / "runs" / "0001"
    single = tmp_path / "single.h5"
    ffrobot.ok("solve", run / "scene.toml", "-o", single, "--allow-python", scene.parent)
    with h5py.File(single) as alone, h5py.File(run / "results.h5") as after:
        expected, found = datasets(alone), datasets(after)
        assert set(found) == set(expected)
        assert len(expected) > 10
        for name, values in expected.items():
            np.testing.assert_array_equal(found[name], values, err_msg=name)


def test_crashes_cost_their_own_run(sweep, scene):
    found = sweep("constant", "killed", "aborting", "constant")
    assert [row["status"] for row in found] == ["completed", "crashed", "crashed", "completed"]
    assert [row["message"] for row in found[1:3]] == ["ended by SIGKILL", "ended by SIGABRT"]
    assert len({worker for worker, _, _ in notes(scene)}) == 1


@pytest.mark.parametrize("number", [signal.SIGTERM, pytest.param(signal.SIGINT, marks=pytest.mark.nightly)])
def test_interruptions_leave_no_process(ffrobot, scene, number):
    """As a terminal sends them, to all, and as `kill` does, to the sweep alone."""
    text = scene.read_text(encoding="utf-8").replace("mine.py:constant", "mine.py:waiting").replace("0.1", "100.0")
    scene.write_text(text, encoding="utf-8")
    process = subprocess.Popen(
        [ffrobot.path, "sweep", scene, "--vary", "gravity.1=0,1", "-j", "2"], env=ffrobot.environment,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    while not scene.with_name("notes.txt").exists() or len(notes(scene)) < 2:
        assert process.poll() is None, process.communicate()
        time.sleep(0.05)
    if number == signal.SIGINT:
        os.killpg(process.pid, number)
    else:
        process.send_signal(number)
    began = time.monotonic()
    _, message = process.communicate(timeout=30)
    assert time.monotonic() - began < 10.0  # a second on a machine with nothing else to do
    assert process.returncode == 128 + number, message
    assert "Traceback" not in message
    assert not list(scene.with_suffix(".sweep").glob("runs/*/row.json"))
    for worker, run, _ in notes(scene):
        assert not _is_running(worker)
        assert not _is_running(run)


def test_workers_are_made_anew_where_the_process_has_changed(scene, monkeypatch, tmp_path):
    """Environment and folder are those of the moment, as of a process that is started then."""
    solve = ["solve", str(scene), "-o", str(tmp_path / "results.h5"), f"--allow-python={tmp_path}"]
    assert own_worker().perform(solve)[:2] == (0, "")
    assert own_worker().perform(solve)[:2] == (0, "")
    monkeypatch.setenv("FFROBOT_MARK", "1")
    assert own_worker().perform(solve)[:2] == (0, "")
    first, second, third = notes(scene)
    assert first[0] == second[0] != third[0]
    assert [text for *_, text in notes(scene)] == ["clean", "clean", "environment"]
    assert not _is_running(first[0])
    code, told, _ = own_worker().perform(["solve", str(tmp_path / "none.toml")])
    assert code == 2
    assert told.startswith("ffrobot: ")
    assert _is_running(third[0])


def _is_running(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    with open(f"/proc/{pid}/stat") as file:
        return file.read().rpartition(")")[2].split()[0] != "Z"


def test_results_are_replaced_in_one_step(scene, tmp_path, monkeypatch):
    """Another command in the same folder may read them at any time: two equal studies at once, for one."""
    run = SweepRun(0, (), tmp_path / "run")
    run.folder.mkdir()
    results, seen = run.folder / "results.h5", []

    def watched(_, arguments):
        seen.append(results.read_bytes() if results.exists() else b"")
        Path(arguments[arguments.index("-o") + 1]).write_bytes(image)
        return Done(0, "", {})

    solved = ffrobot.solve(scene, tmp_path / "made.h5", allow_python=[tmp_path])
    solved.close()
    image = (tmp_path / "made.h5").read_bytes()
    (run.folder / f"results.of-{platform.node()}-999999999-0.7.h5").write_bytes(b"left by a process that was killed")
    monkeypatch.setattr(Worker, "perform", watched)
    for _ in range(2):
        assert perform(run).status == "completed"
    assert seen == [b"", image]
    assert [path.name for path in run.folder.iterdir()] == ["results.h5"]


def test_messages_name_files_of_the_run_without_its_folder(tmp_path, monkeypatch):
    """The folder is relative, as `sweep -o DIR` has it, and the message has its whole path."""
    (tmp_path / "sw").mkdir()
    (tmp_path / "sw" / "scene.toml").write_text("nothing = 1\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    row = perform(SweepRun(0, (), Path("sw")))
    assert row.status == "wrong input"
    assert row.message.startswith("scene.toml: ")


def test_messages_of_a_run_are_its_own(tmp_path):
    """A worker that wrote messages of one run begins those of the next at their beginning."""
    first, second = (own_worker().perform(["info", str(tmp_path / f"{name}.h5")]) for name in ("a_long_name", "b"))
    assert first.code == second.code == 2
    assert second.messages.startswith("ffrobot: ")
    assert second.messages == first.messages.replace("a_long_name", "b")
