"""Commands of ffrobot, and readers of parts, as forks of one process that has loaded what they need.

`Commands.run` is `subprocess.run`: folder, environment, exit code (negative for a signal) and both streams are of that
command alone, and what it does to its process ends with it. `python forked_commands.py` is the process that forks: it
reads a line of JSON for each command, and answers with the number of its process, then with its exit code and the time
of processors it took (s). With modules as arguments it loads these, and its forks are those of `read_apart`.
"""

import gc
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
from functools import partial
from importlib import import_module
from pathlib import Path

LOADED = (
    "h5py", "scipy.linalg", "scipy.optimize", "scipy.interpolate", "matplotlib.backends.backend_agg",
    "ffrobot.cli", "ffrobot.run.solve", "ffrobot.run.inputs", "ffrobot.results.write", "ffrobot.results.solving",
    "ffrobot.fe_models.link", "ffrobot.present.details", "ffrobot.present.summary",
    "ffrobot.pictures.figures.plot", "ffrobot.pictures.report", "ffrobot.present.console",
    "ffrobot.present.start_postures", "ffrobot.scene.plausibility", "ffrobot.results.judging", "ffrobot.sweep.sweep",
    "ffrobot.actuation.feasibility", "scipy.integrate", "scipy.signal", "email.message", "concurrent.futures.process",
)  # fmt: skip
READING = ("gmsh", "h5py", "meshio", "ffrobot.mesh.mesh_files", "ffrobot.mesh.part")
CASES = Path(__file__).parent.parent / "cases"
LIMIT = 600  # s, of a command: also where much else runs
BEFORE_LOADING = ("PYTHON", "OMP_", "OPENBLAS_", "LD_", "MPL")  # begin variables that are read as a process starts


class Commands:
    """The process that forks, started with the first command."""

    seconds = 0.0  # of processors, of all commands so far

    def __init__(self, *loaded):
        self._loaded = loaded
        self._server = None
        self._seconds = 0.0  # of its commands, which the system counts as its own when it ends
        self._environment = {}

    def run(self, arguments, environment, folder, timeout=LIMIT, *, merged=False, given=b""):
        """As `subprocess.run(["ffrobot", *arguments], …)` with both streams captured as text, `merged` in stdout.

        Of a reader, which is `given` its request, they are bytes.
        """
        with tempfile.TemporaryDirectory(prefix="ffrobot-command-") as streams:
            out, err = (Path(streams, name) for name in ("out", "out" if merged else "err"))
            request = {"arguments": arguments, "environment": environment, "folder": str(folder or Path.cwd())}
            if given:
                request["given"] = str(Path(streams, "in"))
                Path(streams, "in").write_bytes(given)
            server = self._started(environment)
            server.stdin.write(json.dumps(request | {"out": str(out), "err": str(err)}) + "\n")
            server.stdin.flush()
            process = int(server.stdout.readline())
            late = not select.select([server.stdout], [], [], timeout)[0]
            if late:
                os.kill(process, signal.SIGKILL)
            code, seconds = json.loads(server.stdout.readline())
            Commands.seconds += seconds
            self._seconds += seconds
            read = Path.read_bytes if given else partial(Path.read_text, encoding="utf-8")
            told = [read(out), "" if merged else read(err)]
        command = ["ffrobot", *arguments]
        if late:
            raise subprocess.TimeoutExpired(command, timeout, *told)
        return subprocess.CompletedProcess(command, code, *told)

    def end(self):
        """End the process that forks."""
        if self._server is not None:
            self._server.stdin.close()
            self._server.wait()
            self._server.stdout.close()
            self._server = None
            Commands.seconds -= self._seconds
            self._seconds = 0.0

    def _started(self, environment):
        """A process whose environment had the same variables of those that a process reads as it starts."""
        read = {key: value for key, value in environment.items() if key.startswith(BEFORE_LOADING)}
        if self._server is None or read != self._environment:
            self.end()
            self._environment = read
            self._server = subprocess.Popen(
                [sys.executable, __file__, *self._loaded], env=environment, text=True,
                stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            )  # fmt: skip
        return self._server


def main():
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    sys.path.pop(0)  # this folder, which the command does not see
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    for module in sys.argv[1:] or LOADED:
        import_module(module)
    if not sys.argv[1:]:
        from ffrobot.scene.load import load_scene

        for case in ("two_link_closed_loop", "slider_crank_3d"):  # validators of tables are built with a kind's first
            load_scene(CASES / case / "scene.toml")
    gc.freeze()
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            answers.close()
            perform(**json.loads(line))
        print(child, file=answers)
        _, status, used = os.wait4(child, 0)
        print(json.dumps([os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime]), file=answers)


def perform(arguments, environment, folder, out, err, given=os.devnull):
    """Be the command: `ffrobot.__main__.main`, or `part_reader.main`, and the end of the process."""
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    os.dup2(os.open(given, os.O_RDONLY), 0)
    for path, stream in ((out, 1), (err, 2)):
        os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600), stream)
    if given != os.devnull:
        sys.path = environment["PYTHONPATH"].split(os.pathsep)
        from ffrobot.mesh.part_reader import main as command_line
    else:
        sys.argv = ["ffrobot", *arguments]
        from ffrobot.__main__ import main as command_line

    command_line()
    sys.exit()


if __name__ == "__main__":
    main()
