"""Who does the jobs of a command: processes here, those of mpirun, dask's workers. Equal files, kills, mistakes."""

import csv
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from threading import Timer

import pytest
import small_robots
import tomli_w
from beam_links import beam_link, tube

import ffrobot as library
from ffrobot.batch.batch import Batch, Processes, _done, batch_of
from ffrobot.batch.worker import own_worker
from ffrobot.common.errors import InputError, SolveError
from ffrobot.common.version import VERSION

ARM = small_robots.ARM | {"trajectory": small_robots.SWING["trajectory"]}
BEAM = beam_link(0.6, tube(0.02, 0.016), 10, nu=None, modes={"count": 3, "family": "in-plane-bending"})
OF = "rms joints.shoulder.moment"
STUDIES = {
    "uncertainty": ["--of", OF, "--of", "joints.shoulder.moment", "--spread", "payload.0.mass=±5%", "--samples", "8"],
    "optimise": ["--minimise", OF, "--vary", "payload.0.mass in {0.4, 0.5, 0.6}"],
    "map": ["--over", "shoulder=0:1:130"],
}


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(tomli_w.dumps(ARM), encoding="utf-8")
    return path


@pytest.fixture
def study(ffrobot, scene):
    """Runs a study in a folder, started with `before`; returns the content of its files, without times of runs."""

    def run(name, folder, *options, before=()):
        folder = scene.parent / folder
        arguments = [name, scene, *STUDIES[name], "-o", folder, "--no-figures", *options]
        done = subprocess.run(
            [*before, ffrobot.path, *map(str, arguments)], env=ffrobot.environment, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        return {path.relative_to(folder): _content(path, folder) for path in folder.rglob("*") if _is_compared(path)}

    return run


def _is_compared(path):
    return path.suffix in (".csv", ".npz", ".h5", ".toml") and path.name != "results.h5"


def _content(path, folder):
    if path.name == "table.csv" and "runs" in os.listdir(folder):
        with path.open(encoding="utf-8") as file:
            return [[cell for key, cell in row.items() if "wall" not in key] for row in csv.DictReader(file)]
    return path.read_bytes()


@pytest.mark.parametrize("name", STUDIES)
def test_files_are_the_same_whoever_does_the_jobs(study, mpirun, scene, tmp_path, name):
    """One process, two, three of mpirun; and two that go on where one was stopped. Maps have a flexible link."""
    if name == "map":
        scene.write_text(tomli_w.dumps(ARM | {"body": [{"name": "arm", "link": BEAM}]}), encoding="utf-8")
    one = study(name, "one", "-j", 1)
    assert len(one) >= 2
    assert study(name, "two", "-j", 2) == one
    assert study(name, "three", before=["3" if word == "2" else word for word in mpirun]) == one
    done = sorted((tmp_path / "one").glob("parts/*.npz")) or sorted((tmp_path / "one").glob("runs/*/row.json"))
    for path in done[::2]:
        path.unlink()
    kept = {path: path.stat().st_mtime_ns for path in done[1::2]}
    assert study(name, "one", "-j", 2) == one
    assert {path: path.stat().st_mtime_ns for path in kept} == kept


def _dies_once(marks, number):
    """Ends the process that does the job, the first time that job 3 is begun."""
    mark = marks / "dead"
    if number == 3 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number**2


def _dies(_):
    os.kill(os.getpid(), signal.SIGKILL)


def test_killed_processes_are_replaced(tmp_path):
    with batch_of(2) as batch:
        assert dict(batch.results(partial(_dies_once, tmp_path), range(8))) == {k: k**2 for k in range(8)}
        assert (tmp_path / "dead").exists()
        with pytest.raises(SolveError, match="were ended 3 times"):
            list(batch.results(_dies, range(2)))


@pytest.mark.filterwarnings("error::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("count", [8, 2])
def test_processes_end_with_their_batch(count):
    """After all of 8 jobs, and with most of them waiting, as after Ctrl-C."""
    with Batch(lambda: Processes(2)) as batch:
        processes = {pid for _, (_, pid) in zip(range(count), batch.results(_pid, range(8)), strict=False)}
    for pid in processes:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def _pid(_):
    time.sleep(0.1)
    return os.getpid()


def _told_twice(_):
    """The first SIGTERM asks this process to leave, the second one comes while it waits for its worker to end."""
    worker = own_worker()
    worker.stop = lambda: None
    os.kill(os.getpid(), signal.SIGTERM)
    Timer(0.2, os.kill, (os.getpid(), signal.SIGTERM)).start()


def test_processes_that_are_told_twice_end():
    executor = Processes(1)
    executor.submit(_done, VERSION, _told_twice, None)
    (process,) = executor._processes.values()
    process.join(60.0)
    alive = process.is_alive()
    process.kill()
    assert not alive


def test_an_executor_of_the_users_own_stays(scene):
    with ThreadPoolExecutor(2) as executor:
        found = library.sensitivity(scene, [OF], ["payload.0.mass"], executor=executor)
        assert executor.submit(abs, -1).result() == 1
    expected = library.sensitivity(scene, [OF], ["payload.0.mass"])
    assert found.derivative[0, 0] == expected.derivative[0, 0]


def test_another_version_refuses():
    with pytest.raises(InputError, match=r"expected workers with ffrobot 0\.0, found one with"):
        _done("0.0", abs, 1)


@pytest.mark.parametrize(
    ("options", "under", "message"),
    [
        (["--scheduler", "nowhere"], {}, "--scheduler: expected the address of a dask scheduler"),
        ([], {"FFROBOT_SCHEDULER": "nowhere"}, "--scheduler: expected the address of a dask scheduler"),
        (["--scheduler", "tcp://n:1", "-j", "2"], {}, "--processes: expected none with --scheduler"),
        (["-j", "3"], {"OMPI_COMM_WORLD_SIZE": "2"}, "--processes: expected none under mpirun"),
        (["--scheduler", "tcp://n:1"], {"OMPI_COMM_WORLD_SIZE": "2"}, "--scheduler: expected none under mpirun"),
    ],
)
def test_mistakes(ffrobot, scene, options, under, message):
    if "nowhere" in [*options, *under.values()]:
        pytest.importorskip("distributed")
    done = ffrobot("map", scene, "--over", "shoulder=0:1:3", *options, env=under)
    assert done.returncode == 2
    assert message in done.stderr
    assert not scene.with_suffix(".map").exists()


def test_a_scheduler_without_its_package(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(InputError, match="found none: pip install distributed"),
        batch_of(scheduler="tcp://n:1"),
    ):
        pass


def test_python_under_mpirun_wants_an_executor(scene, monkeypatch):
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "2")
    with pytest.raises(InputError, match="executor: expected one under mpirun"):
        library.sensitivity(scene, [OF], ["payload.0.mass"])


def test_workers_of_a_scheduler(ffrobot, scene, study):
    """Files equal those of one process; a worker is killed in the middle; then the scheduler ends."""
    distributed = pytest.importorskip("distributed")
    table = scene.parent / "sweep" / "table.csv"
    sweep = ["sweep", scene, "--vary", "payload.0.mass=0.1:1:12", "-o", table.parent, "--scheduler"]
    start = partial(
        subprocess.Popen, env=ffrobot.environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        address = cluster.scheduler_address
        for name in ("uncertainty", "map"):
            assert study(name, "by_dask", "--scheduler", address) == study(name, "here", "-j", 1)
            (scene.parent / "by_dask").rename(scene.parent / f"{name} by dask")
            (scene.parent / "here").rename(scene.parent / f"{name} here")
        killed = start([ffrobot.path, *sweep, address])
        _wait_for(table, killed)
        os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)
        _, told = killed.communicate(timeout=300)
        assert killed.returncode == 0, told
        with table.open(encoding="utf-8") as file:
            assert [row["status"] for row in csv.DictReader(file)] == ["completed"] * 12
        table.parent.rename(scene.parent / "whole")
        left = start([ffrobot.path, *sweep, address])
        _wait_for(table, left)
    _, told = left.communicate(timeout=300)
    assert left.returncode in (0, 1), told  # 0: it was done before
    assert "Traceback" not in told
    assert left.returncode == 0 or "the same command resumes what is done" in told
    ffrobot.ok(*sweep[:-1])
    with table.open(encoding="utf-8") as file, (scene.parent / "whole" / "table.csv").open(encoding="utf-8") as whole:
        rows, expected = ([list(row.values())[:3] for row in csv.DictReader(one)] for one in (file, whole))
    assert rows == expected


def _wait_for(path, process):
    while not path.exists():
        assert process.poll() is None, process.communicate()
        time.sleep(0.05)
