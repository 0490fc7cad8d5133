"""Reading a part in a process of its own: crashes, endless loops and words on stdout end with it, in one message."""

import os
import subprocess
from pathlib import Path

import pytest

from ffrobot.common.errors import InputError
from ffrobot.mesh import part_reader
from ffrobot.mesh.part_reader import SECONDS, read_apart

FILE = Path("part.step")


@pytest.fixture(autouse=True)
def started_anew(monkeypatch):
    """No fork of `forked_readers`: the process that the program starts."""
    monkeypatch.setattr(part_reader, "subprocess", subprocess)


def crash(file):
    os.abort()


def endless(file):
    while True:
        pass


def loud(file):
    os.write(1, b"statistics on transfer")
    return file, sorted(os.listdir())


def failing(file):
    raise KeyError(file)


def test_what_is_read_comes_back():
    assert read_apart(loud, FILE) == (FILE, [])  # in an empty folder


@pytest.mark.parametrize(
    ("read", "says"),
    [
        (crash, "^expected an undamaged file; the reader crashed with SIGABRT"),
        (failing, r"^expected an undamaged file; the reader reports: KeyError: PosixPath\('part.step'\)"),
    ],
)
def test_crashes_are_errors_of_the_input(read, says):
    with pytest.raises(InputError, match=says):
        read_apart(read, FILE)


def test_reading_ends(monkeypatch):
    monkeypatch.setenv(SECONDS, "0.5")
    expected = f"^expected a part that is read and meshed within . s of processor time, .*{SECONDS}=SECONDS"
    with pytest.raises(InputError, match=expected):
        read_apart(endless, FILE)


def test_errors_come_back():
    from ffrobot.mesh.mesh_files import read_foreign

    with pytest.raises(InputError, match=r"^expected a mesh that meshio can read"):
        read_apart(read_foreign, Path("/nowhere/nothing.vtk"))
