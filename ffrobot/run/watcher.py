"""Who follows a solve and may stop it: a watcher, Ctrl-C, a cluster's end of time."""

import signal
import threading
from types import FrameType

from ..common.interrupts import SIGNALS, EndOfCommand


class Watcher:
    """Observes the progress of a solve. The command line shows it; library users may omit it.

    `signal` is the number of the signal that requested an end; 0 without one.
    """

    signal = 0

    def stage(self, title: str) -> None:
        """Called when a step named `title` begins that may take long."""

    def advance(self, t: float, end: float) -> bool:
        """Called when an analysis has reached time t of `end`, s; return False to stop it."""
        return True

    def stopping(self, number: int) -> None:
        """Called when signal `number` requests an end: computed results are kept, unless another signal follows."""
        self.signal = number


class Interruption:
    """Within its context the first Ctrl-C (or SIGTERM) only sets `requested`; the next one interrupts as usual.

    Else `KeyboardInterrupt` would come anywhere and lose the outputs so far. With
    `at_once`, of analyses without outputs yet, the first signal interrupts, too; `keeps`: analyses before have results.
    Signals reach the main thread only: in others the context does nothing.
    """

    at_once = keeps = False

    def __init__(self, watcher: Watcher) -> None:
        self.watcher, self.requested = watcher, False
        self._is_main = threading.current_thread() is threading.main_thread()

    def __enter__(self) -> "Interruption":
        if self._is_main:
            self._previous = {number: signal.signal(number, self._request) for number in SIGNALS}
            for handler in self._previous.values():  # asked before, where Python ignores exceptions
                if isinstance(handler, EndOfCommand) and handler.number and not self.requested:
                    self._request(handler.number, None)
        return self

    def __exit__(self, *error: object) -> None:
        if self._is_main:
            self._restore()

    def advance(self, t: float, end: float) -> bool:
        """Call the watcher's `advance` at time t of `end`, s; False, which stops the analysis, also after a signal."""
        self.at_once = False
        return self.watcher.advance(t, end) and not self.requested

    def _request(self, number: int, frame: FrameType | None) -> None:
        self.requested = True
        self._restore()
        if self.keeps or not self.at_once:
            self.watcher.stopping(number)
        if self.at_once:
            handler = self._previous[signal.Signals(number)]
            if callable(handler):
                handler(number, frame)
            raise KeyboardInterrupt

    def _restore(self) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)
