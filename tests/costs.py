"""What tests cost, for the report of `pytest --junitxml` (scripts/test_costs.py sums it up), and less of it.

Each test has the properties `seconds`, of processors, of the commands it ran, too, and of its process `megabytes`, at
its end, `peak`, the most so far, and `grown`, by how much that is more than before it.
"""

import ctypes
import gc
import resource
from functools import cache

import pytest
from forked_commands import Commands

LIBC = ctypes.CDLL(None)
MEMORY_MAP_THRESHOLD, LARGE = -3, 1 << 20
if hasattr(LIBC, "mallopt"):  # the GNU C library: arrays of that many bytes go back to the system when they are deleted
    LIBC.mallopt(MEMORY_MAP_THRESHOLD, LARGE)
MUCH = 100  # MB
BEGAN = pytest.StashKey[tuple[float, float]]()


def pytest_collection_finish():
    """What is loaded by now stays: no search for unused objects looks at it again."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    item.stash[BEGAN] = processor_time(), peak()


@pytest.hookimpl(wrapper=True, trylast=True)
def pytest_runtest_teardown(item, nextitem):
    try:
        return (yield)
    finally:
        if nextitem is None or nextitem.path != item.path or memory() > least_memory() + MUCH:
            give_back()
        began, before = item.stash.get(BEGAN, (processor_time(), peak()))
        item.user_properties += [
            ("seconds", f"{processor_time() - began:.2f}"),
            ("megabytes", f"{memory():.0f}"),
            ("peak", f"{peak():.0f}"),
            ("grown", f"{peak() - before:.0f}"),
        ]


def give_back():
    """Memory that nothing uses goes back to the system."""
    gc.collect()
    if hasattr(LIBC, "malloc_trim"):
        LIBC.malloc_trim(0)
    least_memory.cache_clear()
    least_memory()


@cache
def least_memory():
    """Megabytes that were left when memory was given back last."""
    return memory()


def processor_time():
    """Seconds of this process, of processes that it started and that have ended, and of all commands."""
    used = [resource.getrusage(of) for of in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used) + Commands.seconds


def peak():
    """The most megabytes that this process has had."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024  # kB on Linux


def memory():
    """Megabytes that this process has now."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 2**20
