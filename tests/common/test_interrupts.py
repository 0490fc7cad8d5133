"""Signals that wait for the end of what may not be interrupted, or end a process at once; what MPI leaves of one."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from ffrobot.common.interrupts import deferred_interrupts, ending_at_once


@pytest.fixture(autouse=True)
def usual_answer():
    """Python's own: a test run in the background of a shell ignores Ctrl-C."""
    previous = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, previous)


def test_ctrl_c_waits_for_the_end():
    done = []

    def work():
        with deferred_interrupts():
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
            done.append("still here")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done
    with pytest.raises(KeyboardInterrupt):  # at once again
        signal.raise_signal(signal.SIGINT)


def test_an_ignored_signal_stays_ignored():
    previous = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with deferred_interrupts():
            signal.raise_signal(signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, previous)


def test_an_error_within_comes_through():
    with pytest.raises(ModuleNotFoundError), deferred_interrupts():
        import no_such_module  # noqa: F401


def test_other_threads_change_no_handler():
    before, seen = signal.getsignal(signal.SIGINT), []

    def work():
        with deferred_interrupts():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [before]


def test_users_of_the_library_keep_their_answer():
    with pytest.raises(KeyboardInterrupt), ending_at_once():
        signal.raise_signal(signal.SIGINT)


COMMAND = """
import ctypes, signal
from ffrobot.common.interrupts import SIGNALS, EndOfCommand, ending_at_once
for number in SIGNALS:
    signal.signal(number, EndOfCommand())
with ending_at_once():
    print("begins", flush=True)
    ctypes.PyDLL(None).sleep({seconds})  # a call that holds the interpreter, as those of PETSc do
try:
    signal.raise_signal(signal.SIGTERM)
except KeyboardInterrupt:
    print("kept")
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_long_call_of_a_library_is_ended_at_once(number):
    command = [sys.executable, "-c", COMMAND.format(seconds=60)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "begins\n"
        began = time.monotonic()
        process.send_signal(number)
        _, told = process.communicate(timeout=90)
    assert time.monotonic() - began < 10.0
    assert process.returncode == -number
    assert told == ""


def test_afterwards_signals_are_answered_as_before():
    done = subprocess.run([sys.executable, "-c", COMMAND.format(seconds=0)], capture_output=True, text=True)
    assert done.stdout == "begins\nkept\n", done.stderr


KILLED = """
import os
from ffrobot.common.parallel import without_daemon
without_daemon()
from mpi4py import MPI
print(MPI.COMM_WORLD.size, flush=True)
os._exit(0)
"""


def test_a_process_that_is_killed_leaves_no_folder_of_open_mpi(tmp_path):
    environment = {name: value for name, value in os.environ.items() if not name.startswith("OMPI_")}
    done = subprocess.run(
        [sys.executable, "-c", KILLED], env=environment | {"TMPDIR": str(tmp_path)}, capture_output=True, text=True
    )
    assert (done.returncode, done.stdout) == (0, "1\n")
    assert not list(tmp_path.iterdir())
