"""Reading a part in a process of its own: crashes, endless loops and words on stdout end with it, in one message."""

import re
from pathlib import Path

import libraries
import pytest

from ffrobot.common.errors import InputError
from ffrobot.mesh.part_reader import SECONDS, read_apart
from ffrobot.mesh.source import source_from


def test_what_is_read_comes_back():
    assert read_apart(libraries.loud, 0, "part.step", "part.step") == ("part.step", [])  # in an empty folder


@pytest.mark.parametrize(
    ("read", "says"),
    [
        (libraries.crash, "expected an undamaged file; the reader crashed with SIGABRT"),
        (libraries.failing, "expected an undamaged file; the reader reports: KeyError: 'part.step'"),
    ],
)
def test_crashes_are_errors_of_the_input(read, says):
    with pytest.raises(InputError, match=rf"part\.step: {says}"):
        read_apart(read, 0, "part.step", "part.step")


def test_reading_ends(monkeypatch):
    monkeypatch.setenv(SECONDS, "0.5")
    expected = f"part.step: expected a part that is read and meshed within . s of processor time, .*{SECONDS}=SECONDS"
    with pytest.raises(InputError, match=expected):
        read_apart(libraries.endless, 0, "part.step", "part.step")


def test_errors_come_back():
    from ffrobot.mesh.mesh_files import read_foreign

    with pytest.raises(InputError, match=re.escape("nothing.vtk: expected a mesh that meshio can read")):
        source_from(
            read_apart(read_foreign, 0, "nothing.vtk", Path("/nowhere/nothing.vtk"), "nothing.vtk"), "nothing.vtk"
        )
