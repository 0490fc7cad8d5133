"""The program as a user runs it: the installed command, the cases of the repository, a cache folder of its own."""

import ctypes
import fcntl
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
import tomli_w
from beam_links import link_keys, rectangle
from forked_commands import LIMIT, READING, Commands
from tables_3d import pin, planar

from ffrobot.batch import batch
from ffrobot.common.cache import cache_folder
from ffrobot.common.parallel import environment_without_mpi
from ffrobot.mesh import form_cache, part_reader

pytest_plugins = ["costs"]
MANY_SEEDS = 6
NIGHTLY = Path(__file__).with_name("nightly.txt")
TOGETHER = {  # files that set up the same: all cases, a browser
    "cases": ("tests/references/test_references", "tests/results/test_summary"), "browser": ("tests/report/",)
}  # fmt: skip
CASES = Path(__file__).parent.parent / "cases"
STUDIES = ("sweep", "sensitivity", "uncertainty", "optimise")
OTHER_COMMAND = os.environ.get("FFROBOT_COMMAND")  # an older version's, to see whether a test fails there


@dataclass(frozen=True)
class Command:
    """Runs `ffrobot` in a process of its own; links are cached in a folder of the test run, empty at its start.

    The process is a fork of one that has loaded the program. Where there are options of `subprocess.run`, or variables
    of the environment beside its own, it is one that starts anew. A test of how a process ends uses `path`.
    """

    cache: Path
    path: Path
    forks: Commands = field(default_factory=Commands)

    @property
    def environment(self):
        """Without what MPI leaves behind in a process that has loaded dolfinx: a nested mpirun trips over it."""
        own = {"XDG_CACHE_HOME": str(self.cache), "TERM": "dumb", "COLUMNS": "120"}  # readline sets the last one to 80
        return environment_without_mpi() | own

    def __call__(self, *arguments, cwd=None, timeout=LIMIT, env=None, **options):
        arguments = [str(argument) for argument in arguments]
        if arguments and arguments[0] in STUDIES and "-j" not in arguments:  # as `own_cache`
            arguments += ["-j", "1"]
        if not options and env is None and OTHER_COMMAND is None:
            return self.forks.run(arguments, self.environment, cwd, timeout)
        options |= {"env": self.environment | (env or {}), "cwd": cwd, "timeout": timeout}
        return subprocess.run([self.path, *arguments], capture_output=True, text=True, **options)

    def ok(self, *arguments, **options):
        """As called; a command that does not end with 0 fails the test with what it wrote to stderr."""
        done = self(*arguments, **options)
        assert done.returncode == 0, done.stderr
        return done


@dataclass(frozen=True)
class SolvedCase:
    """A case of the repository after `ffrobot solve scene.toml --verbose`."""

    folder: Path
    stdout: str
    stderr: str
    file: h5py.File

    def rows(self, analysis, times):
        """Where in the outputs the given times are."""
        output = self.file[analysis]["time"][()]
        rows = np.abs(output[:, None] - times).argmin(axis=0)
        np.testing.assert_allclose(output[rows], times, rtol=0, atol=1e-12)
        return rows


def pytest_addoption(parser):
    parser.addoption("--nightly", action="store_true", help="all seeds of random inputs, and tests marked nightly")


def pytest_collection_modifyitems(config, items):
    """Of many seeds of a test every fifth, and none of the night, unless all are asked for (scripts/nightly.sh).

    Of the night are tests with that mark and those of nightly.txt.
    """
    beside = dict(line.split(" | ") for line in NIGHTLY.read_text(encoding="utf-8").splitlines()[4:])
    of_night = {f"tests/{name}" for name in beside}
    seeds = defaultdict(set)
    for item in items:
        seeds[_function(item)].add(_seed(item))
    many = {name for name, of_name in seeds.items() if len(of_name) >= MANY_SEEDS}
    left_out = {item for item in items if item.get_closest_marker("nightly")
                or of_night & {item.nodeid, _function(item)}
                or (_function(item) in many and (_seed(item) or 0) % 5)}  # fmt: skip
    by_day = {_function(item) for item in items if item not in left_out}
    names = seeds.keys() | {item.nodeid for item in items}
    config.wrong_nights = [name for name, day in beside.items()
                           if f"tests/{name}" not in names or f"tests/{day}" not in by_day]  # fmt: skip
    if left_out and not config.getoption("--nightly"):
        config.hook.pytest_deselected(items=list(left_out))
        items[:] = [item for item in items if item not in left_out]


def _function(item):
    return item.nodeid.partition("[")[0]


def _seed(item):
    seed = item.callspec.params.get("seed") if hasattr(item, "callspec") else None
    return seed if isinstance(seed, int) else None


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item):
    """Where several processes run tests (pytest -n), one marked "alone" waits for the others, and they for it."""
    run = getattr(item.config, "workerinput", {}).get("testrunuid")
    if run is None:
        return (yield)
    with Path(tempfile.gettempdir(), f"ffrobot-tests-{run}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX if item.get_closest_marker("alone") else fcntl.LOCK_SH)
        return (yield)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """With --dist loadfile some files go as one."""
    from xdist.scheduler import LoadFileScheduling

    class Scheduling(LoadFileScheduling):
        def _split_scope(self, nodeid):
            return next((group for group, names in TOGETHER.items() if nodeid.startswith(names)), nodeid.split("::")[0])

    return Scheduling(config, log) if config.getoption("dist") == "loadfile" else None


@pytest.fixture(scope="session")
def shared_folder(tmp_path_factory):
    """A folder that all processes of the test run share, empty at its start."""
    base = tmp_path_factory.getbasetemp()
    return base.parent if "PYTEST_XDIST_WORKER" in os.environ else base


def own_made(folder):
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


@pytest.fixture(scope="session", autouse=True)
def own_cache(shared_folder):
    """Nothing that tests compute goes to the user's cache or comes from there; returns the cache of the test run.

    Finite element forms are compiled once for all tests, those with caches of their own included. Studies begin one
    process, unless they are told how many.
    """
    cache = shared_folder / "cache"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(cache))
        forms = cache_folder("forms")
        patch.setattr(form_cache, "cache_folder", lambda _, name: own_made(forms / name))
        patch.setattr(batch, "processors", lambda: 1)  # tests go side by side already
        yield cache


@pytest.fixture(scope="session")
def ffrobot(own_cache):
    """The installed command, or that of FFROBOT_COMMAND."""
    command = Command(own_cache, Path(OTHER_COMMAND or Path(sys.executable).with_name("ffrobot")))
    yield command
    command.forks.end()


@pytest.fixture(scope="session", autouse=True)
def forked_readers():
    """Each part is read in a process of its own, a fork of one that has loaded gmsh and meshio."""
    readers = Commands(*READING)

    def run(command, *, input, env, cwd, **options):
        return readers.run([], env, cwd, given=input)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(part_reader, "subprocess", SimpleNamespace(run=run))
        yield
    readers.end()


@pytest.fixture
def refused(ffrobot):
    """Run a command that must be refused, and return its message.

    One message without traceback on stderr, nothing on stdout, every file of the folder as it was.
    """

    def run(folder, *arguments, code=2, **options):
        before = _files(folder)
        done = ffrobot(*arguments, cwd=folder, **options)
        assert done.returncode == code, done.stdout + done.stderr
        assert done.stdout == ""
        assert done.stderr.startswith("ffrobot: ")
        assert "Traceback" not in done.stderr
        assert _files(folder) == before
        return done.stderr

    return run


def _files(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="session")
def mpirun():
    """How a command is started on two processes that share this machine."""
    if shutil.which("mpirun") is None:
        pytest.skip("there is no mpirun")
    as_root = ["env", "OMPI_ALLOW_RUN_AS_ROOT=1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1"]
    return [*as_root, "mpirun", "-n", "2", "--oversubscribe", "--mca", "mpi_yield_when_idle", "1"]


def _as_it_is(text):
    return text


@pytest.fixture(scope="session")
def solved(ffrobot, shared_folder, tmp_path_factory):
    """Copy a case, edit the text of one of its scenes and of its link files, run it.

    A case as it is runs once for all processes of the test session, in a folder that its tests share.
    """
    shared = shared_folder / "solved"
    shared.mkdir(exist_ok=True)

    def solve(name, edit=_as_it_is, edit_link=_as_it_is, scene="scene.toml"):
        if (edit, edit_link) != (_as_it_is, _as_it_is):
            return run(name, tmp_path_factory.mktemp("solved"), edit, edit_link, scene)
        of = name if scene == "scene.toml" else f"{name} {scene}"
        with (shared / f"{of}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            told = shared / f"{of}.json"
            if not told.exists():
                done = run(name, shared / f"of {of}", edit, edit_link, scene)
                done.file.close()
                told.write_text(json.dumps([str(done.folder), done.stdout, done.stderr]), encoding="utf-8")
        folder, stdout, stderr = json.loads(told.read_text(encoding="utf-8"))
        return SolvedCase(Path(folder), stdout, stderr, h5py.File(results_of(Path(folder, scene)), "r"))

    def run(name, folder, edit, edit_link, scene):
        path = _copy(name, folder).with_name(scene)
        path.write_text(edit(path.read_text(encoding="utf-8")), encoding="utf-8")
        for body in tomllib.loads(path.read_text(encoding="utf-8"))["body"]:
            if "link" in body and edit_link is not _as_it_is:
                link = path.parent / body["link"]
                link.write_text(edit_link(link.read_text(encoding="utf-8")), encoding="utf-8")
        done = ffrobot.ok("solve", scene, "--verbose", cwd=path.parent)
        return SolvedCase(path.parent, done.stdout, done.stderr, h5py.File(results_of(path), "r"))

    def results_of(path):
        return path.with_suffix(".results.h5")

    return solve


def _case(name):
    return pytest.fixture(scope="session", name=name)(lambda solved: solved(name))


two_link, arm_3r, slewing_appendage = (_case(name) for name in ("two_link", "arm_3r", "slewing_appendage"))
slider_crank, slider_crank_3d = (_case(name) for name in ("slider_crank", "slider_crank_3d"))


@pytest.fixture
def case_copy(tmp_path):
    """Copy a case by its name; returns the scene file of the copy."""
    return lambda name: _copy(name, tmp_path)


@pytest.fixture(scope="module")
def case_copy_of_module(tmp_path_factory):
    """As `case_copy`, for fixtures that serve a whole module."""
    return lambda name: _copy(name, tmp_path_factory.mktemp("case"))


def _copy(name, folder):
    """The case, and beside it the links of the others, which it may share."""
    ignored = shutil.ignore_patterns("*.h5", "*.figures")
    copy = folder / name
    shutil.copytree(CASES / name, copy, ignore=ignored)
    for other in set(re.findall(r'"\.\./(\w+)/', (copy / "scene.toml").read_text(encoding="utf-8"))):
        shutil.copytree(CASES / other, folder / other, ignore=ignored)
    return copy / "scene.toml"


@pytest.fixture(scope="session")
def solid_arm(ffrobot, tmp_path_factory):
    """A small soft solid link with stresses on its surface, swung by its tip; its folder, with `scene.results.h5`."""
    folder = tmp_path_factory.mktemp("solid_arm")
    mesh, modes = {"cell": "hexahedron", "order": 2, "divisions": [8, 1, 1]}, {"count": 4, "family": "all"}
    keys = {"name": "arm", "modes": modes, "stress": {"surface": True}}
    link = link_keys("solid", 0.4, rectangle(0.02, 0.03), mesh, E=0.7e9, nu=0.4, rho=1200.0, **keys)
    scene = planar(
        [{"name": "arm", "link": "arm.toml"}], [pin("shoulder", "ground", "arm.root", at=[0.1, 0.2])],
        {"name": "inverse", "kind": "pcid", "end": 0.02, "output_step": 0.002}, name="solid_arm",
        trajectory=[{"name": "tip", "point": "arm.tip", "y": "0.2 + 0.05*t"}],
    )  # fmt: skip
    for name, tables in (("arm", link), ("scene", scene)):
        (folder / f"{name}.toml").write_text(tomli_w.dumps(tables), encoding="utf-8")
    ffrobot.ok("solve", "scene.toml", cwd=folder)
    return folder


@pytest.fixture(scope="session")
def compiled(tmp_path_factory):
    """What `numba.cfunc` returns, as far as it is looked at, of a function in C by its name."""

    def make(name, source):
        folder = tmp_path_factory.mktemp(name)
        (folder / f"{name}.c").write_text(f"#include <math.h>\n{source}\n", encoding="utf-8")
        subprocess.run(["gcc", "-shared", "-fPIC", "-o", "it.so", f"{name}.c", "-lm"], cwd=folder, check=True)
        library = ctypes.CDLL(str(folder / "it.so"))
        return SimpleNamespace(library=library, address=ctypes.cast(library[name], ctypes.c_void_p).value)

    return make


@pytest.fixture(scope="session")
def can_draw():
    """Whether PyVista draws here; only a machine without it, or without OpenGL, may skip."""
    pytest.importorskip("pyvista")
    if not list(Path("/usr/lib").glob("*/libEGL_mesa*")):
        pytest.skip("no EGL on this machine")
