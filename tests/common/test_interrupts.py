"""Signals that wait for the end of what may not be interrupted."""

import signal
import threading

import pytest

from ffrobot.common.interrupts import deferred_interrupts


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
