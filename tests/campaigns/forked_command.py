"""Commands of ffrobot in forked processes with limits of time and memory, and what becomes of them."""

import os
import re
import resource
import signal
import sys
import time
from importlib import import_module
from pathlib import Path

CPU_TIME = 60  # s for one command
PATIENCE = 600  # s of wall time: something waits for ever
MEMORY = 8 << 30  # bytes of address space
GOOD = ("solved", "rejected", "stopped")
BAD = ("traceback", "crash", "hang", "no file named", "noise")
PROGRESS = re.compile(r"ffrobot: .* \(\d+ s\)")  # what commands tell of long work, now and then
LOADED_ONCE = (
    "h5py", "scipy.linalg", "scipy.optimize", "scipy.interpolate", "ffrobot.run.solve", "ffrobot.results.write",
    "ffrobot.results.solving", "matplotlib.backends.backend_agg", "ffrobot.cli", "ffrobot.pictures.figures.plot",
    "ffrobot.pictures.report", "ffrobot.present.summary",
)  # fmt: skip


def load_once() -> None:
    """What commands import, so that forked processes have it."""
    for module in LOADED_ONCE:
        import_module(module)


def run(arguments: list[str], folder: Path, cpu_time: int = CPU_TIME) -> tuple[int, str]:
    """`ffrobot ARGUMENTS` in a forked process: exit code, negative for a signal, and what it wrote to stderr."""
    told = folder / "stderr.txt"
    child = os.fork()
    if child == 0:
        code = 70
        try:
            os.chdir(folder)
            os.setsid()
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            resource.setrlimit(resource.RLIMIT_CPU, (cpu_time, cpu_time))
            os.dup2(os.open(told, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            sys.argv = ["ffrobot", *arguments]
            from ffrobot.cli import main

            try:
                main()
                code = 0
            except SystemExit as end:
                code = end.code if isinstance(end.code, int) else int(end.code is not None)
            sys.stderr.flush()
        except BaseException as error:
            os.write(2, f"Traceback of the campaign: {type(error).__name__}: {error}".encode())
        finally:
            os._exit(code)
    began = time.monotonic()
    while time.monotonic() - began < PATIENCE:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            text = told.read_text(encoding="utf-8", errors="replace") if told.exists() else ""
            return os.waitstatus_to_exitcode(status), text
        time.sleep(0.005)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return -signal.SIGKILL, "no end"


def outcome(code: int, told: str, files: list[str]) -> str:
    """What became of one command."""
    lines = [line for line in told.splitlines() if line.strip() and not PROGRESS.fullmatch(line)]
    if "Traceback" in told:
        return "traceback"
    if told == "no end" or code == -signal.SIGXCPU or (code == -signal.SIGKILL and not told):
        return "hang"
    if code < 0 or code not in (0, 1, 2):
        return "crash"
    if code == 0:
        return "noise" if lines else "solved"
    if not any(name in told for name in files):
        return "no file named"
    if not lines[0].startswith("ffrobot: "):
        return "noise"
    return "rejected" if code == 2 else "stopped"
