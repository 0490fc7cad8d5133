"""Ctrl-C while a scene is solved, or a cluster's end of time: a request to stop that keeps what has been computed."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from types import FrameType, TracebackType

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """Within its context the first Ctrl-C (or SIGTERM) only sets `requested`; the next one interrupts as usual.

    `tell` is called at once with the number of the signal.

    Python would raise `KeyboardInterrupt` anywhere, in the calls from the core too, and the outputs so far were lost.
    Signals reach the main thread only: in any other the context does nothing.
    """

    def __init__(self, tell: Callable[[int], None]) -> None:
        self.requested = False
        self._tell = tell
        self._is_main = threading.current_thread() is threading.main_thread()

    def __enter__(self) -> Interruption:
        if self._is_main:
            self._previous = {number: signal.signal(number, self._request) for number in SIGNALS}
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        if self._is_main:
            self._restore()

    def _request(self, number: int, frame: FrameType | None) -> None:
        self.requested = True
        self._restore()
        self._tell(number)

    def _restore(self) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)
