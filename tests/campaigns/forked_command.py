"""Commands of ffrobot in forked processes with limits of time and memory, and what becomes of them."""

import os
import re
import resource
import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1]))
from forked_commands import Commands

PATIENCE = 300  # s for one command
MEMORY = 8 << 30  # bytes of address space
GOOD = ("solved", "rejected", "stopped")
BAD = ("traceback", "crash", "hang", "no file named", "noise")
PROGRESS = re.compile(r"ffrobot: .* \(\d+ s\)")  # what commands tell of long work, now and then
COMMANDS = Commands()


def run(arguments: list[str], folder: Path) -> tuple[int, str]:
    """`ffrobot ARGUMENTS` in a forked process: exit code, negative for a signal, and what it wrote to stderr."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))  # also of what it starts
    try:
        done = COMMANDS.run(arguments, dict(os.environ), folder, PATIENCE)
    except subprocess.TimeoutExpired:
        return -signal.SIGKILL, "no end"
    return done.returncode, done.stderr


def outcome(code: int, told: str, files: list[str]) -> str:
    """What became of one command."""
    lines = [line for line in told.splitlines() if line.strip() and not PROGRESS.fullmatch(line)]
    if "Traceback" in told:
        return "traceback"
    if told == "no end":
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


class Outcomes:
    """Counts of what became of commands, and what is to be mended."""

    def __init__(self) -> None:
        self.counts, self.bad = Counter[str](), list[str]()

    def add(self, what: str, kind: str, label: str, code: int, told: str) -> str:
        """Count `what` became of a command, and show it where that is bad."""
        self.counts[f"{what}: {kind}"] += 1
        if kind in BAD:
            lines = told.strip().splitlines()
            shown = " | ".join(lines[-3:] if kind == "traceback" else lines[:3])
            self.bad.append(f"{kind}, {what}, exit code {code}: {label}: {shown[:600]}")
            print(self.bad[-1], flush=True)
        return kind

    def show(self) -> None:
        for name, count in sorted(self.counts.items()):
            print(f"{count:6d} {name}")
