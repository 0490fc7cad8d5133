"""How processes end: Ctrl-C and SIGTERM are answered by an exception, later, or at once, by the end of the process."""

import atexit
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import NoReturn

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class EndOfCommand:
    """Signal handler of the command line: raises `KeyboardInterrupt`, keeps the signal's `number`, 0 before one.

    While a module is loaded, the process ends at once, with the exit code of a command that was stopped: Python's
    import system would print stacks, or swallow the exception.
    """

    number = 0

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Raise `KeyboardInterrupt`."""
        self.number, outer = number, frame
        while outer is not None:
            if outer.f_code.co_filename.startswith("<frozen importlib"):
                os._exit(128 + number)
            outer = outer.f_back
        signal.default_int_handler(number, frame)


@contextmanager
def ending_at_once() -> Iterator[None]:
    """Context in which Ctrl-C and SIGTERM end a command (`EndOfCommand`) at once, without a message.

    For work that has nothing to keep before its end, and calls libraries for long: Python answers a signal when such a
    call returns, which may be minutes later. Other signal handlers, as of Python users, stay.
    """
    ours = [number for number in SIGNALS if isinstance(signal.getsignal(number), EndOfCommand)]
    previous = {number: signal.signal(number, signal.SIG_DFL) for number in ours if _in_main_thread()}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


@contextmanager
def deferred_interrupts() -> Iterator[None]:
    """Context in which Ctrl-C and SIGTERM wait; at its end the first of them is answered as usual.

    For loading dolfinx: where Python raises while the compiled modules of version 0.9 load, C++ ends the process.
    Signals reach the main thread only: in any other the context does nothing.
    """
    if not _in_main_thread():
        yield
        return
    arrived: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        arrived.append(number)

    # What Python does not handle itself ends the process at once, or is ignored, without raising anything.
    handled = [number for number in SIGNALS if callable(signal.getsignal(number))]
    previous = {number: signal.signal(number, note) for number in handled}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
        if arrived:
            signal.raise_signal(arrived[0])


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()


def end_with_parent() -> None:
    """End this process as soon as its parent ends, even by SIGKILL (Linux only; elsewhere without effect)."""
    import ctypes  # loaded here: other commands start without it

    with suppress(Exception):
        ctypes.CDLL(None).prctl(1, int(signal.SIGKILL), 0, 0, 0)  # PR_SET_PDEATHSIG


def end_process(code: int) -> NoReturn:
    """Exit with `code` without freeing memory, which takes a twentieth of a short command's time."""
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(code)
