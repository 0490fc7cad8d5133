"""Compiled forms: whatever a process that was killed has left, the next one uses or repairs at once."""

import os
import subprocess
import sys
import time

import pytest

from ffrobot.common.locks import held, is_running, this_process
from ffrobot.mesh.form_cache import installed_forms

COMPILE = """
from ffrobot.mesh.compat import MPI, compiled_form, function_space
from ffrobot.mesh.form_cache import form_folder
from dolfinx.mesh import create_unit_cube
import ufl
mesh = create_unit_cube(MPI.COMM_SELF, 1, 1, 1)
{between}
space = function_space(mesh, 1)
compiled_form(ufl.TestFunction(space) * ufl.TrialFunction(space) * ufl.dx)
"""
KILLED = """
with form_folder(MPI.COMM_SELF, "test") as folder:
    (folder / "libffcx_forms_x.c").write_text("")
    print(folder, flush=True)
    import os, signal
    os.kill(os.getpid(), signal.SIGKILL)
"""
HOLD = """
import sys, time
from ffrobot.common.locks import held
with held(sys.argv[1], 1.0):
    print(flush=True)
    time.sleep(60)
"""


def run(cache, between="", code=0):
    done = subprocess.run(
        [sys.executable, "-c", COMPILE.format(between=between)],
        env=os.environ | {"XDG_CACHE_HOME": str(cache)}, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == code, done.stderr
    return done.stdout.strip()


def times(cache):
    return {path.name: path.stat().st_mtime_ns for path in cache.glob("ffrobot/forms/*/libffcx_*")}


def test_kept_for_the_next_run_and_whole(tmp_path):
    run(tmp_path)
    before = times(tmp_path)
    assert before
    run(tmp_path)
    assert times(tmp_path) == before
    installed = {path.name for path in installed_forms().glob("*/*.so")}
    library = next(path for path in tmp_path.glob("ffrobot/forms/*/*.so") if path.name not in installed)
    content = library.read_bytes()
    library.unlink()  # its other names may be in use
    library.write_bytes(content[:1000])
    run(tmp_path)
    assert library.stat().st_size == len(content)
    library.chmod(0o666)  # anybody may have changed it since
    written = library.stat().st_mtime_ns
    run(tmp_path)
    assert library.stat().st_mtime_ns > written
    assert library.stat().st_mode & 0o077 == 0


def test_process_killed_while_it_compiles(tmp_path):
    folder = run(tmp_path, KILLED, code=-9)
    left, lock = (os.path.join(folder, name) for name in ("libffcx_forms_x.c", "compiling.lock"))
    assert os.path.exists(left)
    began = time.monotonic()
    with held(lock, patience=10.0) as had:
        assert had
    assert time.monotonic() - began < 1.0
    run(tmp_path, 'with form_folder(MPI.COMM_SELF, "test"): pass')  # with the same name of the compiler
    assert not os.path.exists(left)


def test_read_only_cache(tmp_path):
    (tmp_path / "ffrobot").write_text("a file in the way")
    run(tmp_path)


def test_locks_wait_for_live_processes_only(tmp_path):
    path = tmp_path / "lock"
    process = subprocess.Popen([sys.executable, "-c", HOLD, path], stdout=subprocess.PIPE)
    process.stdout.readline()
    with held(path, patience=0.1) as had:
        assert not had
    process.kill()
    process.wait()
    with held(path, patience=1.0) as had:
        assert had
    with held(tmp_path / "no" / "folder", patience=1.0) as had:
        assert not had


@pytest.mark.parametrize(("end", "runs"), [("", True), ("0", False)])
def test_processes_by_number_and_start(end, runs):
    assert is_running(this_process() + end) == runs
    assert not is_running("nonsense")
