"""Runs that fail on the way: exit code 1, a message, what was computed kept, no half-written file."""

import os
import pty
import resource
import shutil
import signal
import subprocess
import threading
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from loops import OWN_CONTROLLER
from tables_3d import pin, planar

import ffrobot
from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher

SHORT = {"end = 1.0": "end = 0.02"}
ENDLESS = {
    "end = 1.0": "end = 1000.0",
    "output_step = 0.001": "output_step = 0.1",
    'x = "1.5*cos(pi*t/4)"': 'x = "1.5 - 0.1*sin(t)"',
    'y = "sqrt(3)/2*cos(pi*t/4)"': 'y = "sqrt(3)/2"',
}

SOLID = Path(__file__).parents[2] / "cases" / "two_link_solid" / "link1.toml"  # stage 1 of beams is over at once


def _limit_files():
    """As on a full disk: nothing larger than 20 kB can be written (the results take about 100 kB)."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))


def test_disk_full_while_writing_results(two_link_copy, ffrobot):
    folder = two_link_copy({"scene.toml": SHORT})
    results = folder / "scene.results.h5"
    assert ffrobot("solve", "scene.toml", cwd=folder).returncode == 0
    assert len(content := results.read_bytes()) > 20_000
    before = sorted(folder.iterdir())
    done = ffrobot("solve", "scene.toml", cwd=folder, preexec_fn=_limit_files)
    assert done.returncode == 1
    assert done.stderr.splitlines() == ["ffrobot: scene.results.h5: cannot write the results file: File too large"]
    assert sorted(folder.iterdir()) == before
    assert results.read_bytes() == content


@pytest.mark.parametrize("command", [("link", "link1.toml"), ("solve", "scene.toml")])
def test_full_disk(two_link_copy, ffrobot, small_disk, command):
    folder, small_disk = two_link_copy({"scene.toml": SHORT}), small_disk("16k")
    done = ffrobot(*command, "-o", small_disk / "out.h5", cwd=folder)
    assert done.returncode == 1
    (message,) = done.stderr.splitlines()
    assert message.startswith(f"ffrobot: {small_disk / 'out.h5'}: cannot write the ")
    assert message.endswith(": No space left on device")
    assert list(small_disk.iterdir()) == []


@pytest.mark.parametrize(
    ("command", "output", "named"),
    [
        ("solve", "nowhere/r.h5", "found no folder nowhere"),
        ("solve", ".", "found a folder"),
        ("solve", "/proc/r.h5", "expected a writable folder"),  # not even for root
        ("bench", "/proc/bench", "expected a writable folder"),
        ("solve", "/dev/null", "expected a regular file, found a device"),  # a rename would replace it
        ("solve", "link1.toml", "another file than the input"),
    ],
)
def test_output_that_cannot_be_written(two_link_copy, refused, command, output, named):
    assert named in refused(two_link_copy(), command, "scene.toml", "-o", output)


def test_too_many_steps(two_link_copy, ffrobot):
    folder = two_link_copy({"scene.toml": SHORT | {"tolerance = 1e-7": "tolerance = 1e-7\nmax_steps = 500"}})
    done = ffrobot("solve", "scene.toml", cwd=folder)
    assert done.returncode == 1
    assert 'analysis "inverse" ended at t = 0.00' in done.stderr
    assert "raise max_steps" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    with h5py.File(folder / "scene.results.h5") as file:
        assert set(file) == {"inverse"}
        assert file["inverse"].attrs["status"] == "too many steps"
        assert file["inverse"].attrs["cause"] in done.stderr
        assert 1 < len(file["inverse/time"]) < 21


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_keeps_what_was_computed(two_link_copy, ffrobot, number):
    """On a terminal, where the progress says when the analysis runs; and SIGTERM, with which clusters end a job."""
    folder = two_link_copy({"scene.toml": ENDLESS})
    try:
        terminal, end = pty.openpty()
    except OSError:
        pytest.skip("no pseudo-terminal here, as in a bare chroot")
    process = subprocess.Popen(
        [ffrobot.path, "solve", "scene.toml"], cwd=folder, env=ffrobot.environment | {"TERM": "xterm"}, stderr=end,
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    os.close(end)
    shown = _read_until(terminal, b"inverse")
    time.sleep(0.5)
    process.send_signal(number)
    began = time.monotonic()
    shown += _read_until(terminal, b"--resume")
    summary, _ = process.communicate(timeout=30)
    assert time.monotonic() - began < 5.0
    assert process.returncode == 128 + number
    assert b"Traceback" not in shown
    assert b"(interrupted): stopped on request" in shown
    assert b"ffrobot solve scene.toml --resume" in shown
    assert " of 1000 " in summary
    with h5py.File(folder / "scene.results.h5") as file:
        group = file["inverse"]
        assert group.attrs["status"] == "interrupted"
        assert np.all(np.isfinite(group["joints/O/moment"]))
        assert len(group["joints/O/moment"]) == len(group["time"]) >= 1


def _read_until(terminal, text):
    """What the terminal shows, up to and with `text`; a process that ends closes it."""
    shown = b""
    while text not in shown:
        try:
            shown += os.read(terminal, 4096)
        except OSError:
            break
    assert text in shown, shown
    return shown


def test_ctrl_c_before_any_analysis_writes_nothing(two_link_copy, ffrobot, tmp_path):
    """Stage 1 takes seconds; nothing is worth keeping then."""
    folder = two_link_copy()
    shutil.copy(SOLID, folder)
    before = sorted(folder.iterdir())
    process = subprocess.Popen(
        [ffrobot.path, "solve", "scene.toml"], cwd=folder, env=ffrobot.environment | {"XDG_CACHE_HOME": str(tmp_path)},
        stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    while "libdolfinx" not in _mapped(process.pid):  # stage 1 has begun
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    summary, message = process.communicate(timeout=60)
    assert process.returncode == -signal.SIGINT, message  # which shells show as 130
    assert message == ""
    assert summary == ""
    assert sorted(folder.iterdir()) == before


def _mapped(pid):
    with open(f"/proc/{pid}/maps") as maps:
        return maps.read()


def test_reader_that_goes_away_is_no_error(ffrobot, two_link):
    """`ffrobot info … | head -1`."""
    read, write = os.pipe()
    os.close(read)
    process = subprocess.run(
        [ffrobot.path, "info", "scene.results.h5"], cwd=two_link.folder, env=ffrobot.environment, stdout=write,
        stderr=subprocess.PIPE, text=True, timeout=60,
    )  # fmt: skip
    os.close(write)
    assert process.stderr == ""


LARGE = {"end = 1.0": "end = 0.1", "output_step = 0.001": "output_step = 2e-6"}


@pytest.mark.parametrize("times", [1, pytest.param(2, marks=pytest.mark.nightly)])
def test_ctrl_c_while_results_are_written(two_link_copy, ffrobot, times):
    """Once keeps what was computed, twice leaves nothing half-written."""
    folder = two_link_copy({"scene.toml": LARGE})
    log = folder / "log"
    process = subprocess.Popen(
        [ffrobot.path, "solve", "scene.toml", "--log-file", log], cwd=folder, env=ffrobot.environment,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    while not log.exists() or 'analysis "inverse": completed' not in log.read_text(encoding="utf-8"):
        assert process.poll() is None
        time.sleep(0.01)
    for _ in range(times):
        process.send_signal(signal.SIGINT)
        time.sleep(0.3)
    _, message = process.communicate(timeout=60)
    assert process.returncode == 130, message
    assert "stopping, and keeping what was computed" in message
    assert "Traceback" not in message
    names = {path.name for path in folder.iterdir()}
    assert not any(".tmp" in name for name in names)
    if times == 1:
        with h5py.File(folder / "scene.results.h5") as file:
            assert file["inverse"].attrs["status"] == "completed"
    elif "scene.results.h5" in names:  # the second came too late
        h5py.File(folder / "scene.results.h5").close()


def test_an_error_later_keeps_the_analyses_before(two_link_copy, ffrobot):
    folder = two_link_copy({"scene.toml": SHORT})
    scene = folder / "scene.toml"
    scene.write_text(scene.read_text(encoding="utf-8") + OWN_CONTROLLER, encoding="utf-8")
    (folder / "own.py").write_text("def controller(setup):\n    return lambda k, y: 1 / 0\n", encoding="utf-8")
    done = ffrobot("solve", "scene.toml", cwd=folder)
    assert done.returncode == 1
    assert "ZeroDivisionError" in done.stderr
    with h5py.File(folder / "scene.results.h5") as file:
        assert file["inverse"].attrs["status"] == "completed"
        assert "loop" not in file


def test_python_files_run_from_below_the_scene_only(two_link_copy, ffrobot, refused, tmp_path):
    """By their true place: symbolic links and `..` lead nowhere else."""
    folder, elsewhere = two_link_copy({"scene.toml": SHORT}), tmp_path / "elsewhere"
    elsewhere.mkdir()
    ran = elsewhere / "ran"
    (elsewhere / "own.py").write_text(
        f"open({str(ran)!r}, 'w')\ndef controller(setup):\n    return lambda k, y: 0 * setup.feed_forward[0]\n"
    )
    (folder / "link.py").symlink_to(elsewhere / "own.py")
    scene = folder / "scene.toml"
    text = scene.read_text(encoding="utf-8")
    for name in (str(elsewhere / "own.py"), "../elsewhere/own.py", "link.py"):
        scene.write_text(text + OWN_CONTROLLER.replace("own.py", name), encoding="utf-8")
        message = refused(folder, "solve", "scene.toml")
        assert "expected a Python file below the scene's folder" in message
        assert f"--allow-python {elsewhere}" in message
        assert not ran.exists()
    ffrobot.ok("solve", "scene.toml", "--allow-python", elsewhere, cwd=folder)
    assert ran.exists()


@pytest.mark.parametrize("kept", [True, False])
def test_an_analysis_without_outputs_stops_at_once(kept):
    """Newton's method on a chain of 150 soft joints: what came before is kept, if anything did."""
    names = [f"b{k}" for k in range(150)]
    rigid = {"mass": 1.0, "center": [0.05, 0.0], "inertia": 1e-3, "points": {"root": [0.0, 0.0], "tip": [0.1, 0.0]}}
    ends = ["ground", *(f"{name}.tip" for name in names)]
    drive = {"motor": True, "stiffness": 1e3, "rotor_inertia": 1e-4}
    joints = [pin(f"j{name}", end, f"{name}.root", **drive) for end, name in zip(ends, names, strict=False)]
    analyses = [{"name": "fall", "kind": "forward", "end": 1e-9, "output_step": 1e-9}] if kept else []
    analyses += [{"name": "sag", "kind": "static"}]
    chain = planar([{"name": name, "rigid": rigid} for name in names], joints, *analyses)
    scene = ffrobot.make_scene(**chain)

    class Stops(Watcher):
        def stage(self, title):
            if "sag" in title:
                threading.Timer(0.5, os.kill, [os.getpid(), signal.SIGINT]).start()

    began = time.monotonic()
    if kept:
        assert list(solve_scene(scene, Stops()).analyses) == ["fall"]
    else:
        with pytest.raises(KeyboardInterrupt):
            solve_scene(scene, Stops())
    assert time.monotonic() - began < 20.0
