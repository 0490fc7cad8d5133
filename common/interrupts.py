"""Ctrl-C and SIGTERM while nothing may be interrupted."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def deferred_interrupts() -> Iterator[None]:
    """Within its context Ctrl-C and SIGTERM wait; at its end the first of them is answered as it would have been.

    For loading dolfinx: where Python raises while the compiled modules of version 0.9 load, C++ ends the process.
    Signals reach the main thread only: in any other the context does nothing.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    arrived: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        arrived.append(number)

    # What Python does not handle itself ends the process at once, or is ignored, without raising anything.
    handled = [number for number in (signal.SIGINT, signal.SIGTERM) if callable(signal.getsignal(number))]
    previous = {number: signal.signal(number, note) for number in handled}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
        if arrived:
            signal.raise_signal(arrived[0])
