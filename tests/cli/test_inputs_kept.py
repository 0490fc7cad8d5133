"""No output replaces an input of its command, or a file of another kind, by whatever name."""

import os
from pathlib import Path

import pytest

KINDS = {"a.png": b"\x89PNG\r\n", "notes.txt": b"years of work", "own.h5": b"\x89HDF\r\n\x1a\n damaged"}


@pytest.fixture
def folder(two_link_copy):
    """With files of other kinds, and other names of the inputs."""
    folder = two_link_copy()
    for name, content in KINDS.items():
        (folder / name).write_bytes(content)
    (folder / "soft.h5").symlink_to("link1.toml")
    os.link(folder / "link1.toml", folder / "hard.h5")
    (folder / "round").symlink_to("about")
    (folder / "about").symlink_to("round")
    return folder


@pytest.mark.parametrize(
    ("command", "output"),
    [
        *((("link", "link1.toml", "--force"), name) for name in ("link1.toml", "soft.h5", "hard.h5", "scene.toml")),
        (("link", "link1.toml", "--force"), "notes.txt"),
        (("link", "link1.toml"), "notes.txt"),
        (("link", "link1.toml"), "round"),
        *((("solve", "scene.toml"), name) for name in ("scene.toml", "link2.toml", "soft.h5", "hard.h5", "round")),
        (("sweep", "scene.toml", "--vary", "gravity.1=0"), "notes.txt"),
        (("sweep", "scene.toml", "--vary", "gravity.1=0"), "round"),
        (("bench", "scene.toml"), "notes.txt"),
        (("plot", "own.h5"), "notes.txt"),
        (("view", "own.h5"), "notes.txt"),
        (("linear", "own.h5"), "own.h5"),
        (("report", "own.h5"), "notes.txt"),
    ],
)
def test_outputs(folder, refused, command, output):
    refused(folder, *command, "-o", output)


@pytest.mark.parametrize("name", ["link1.toml", "scene.toml", "soft.h5", "notes.txt", "a.png", "round"])
def test_log_files(folder, ffrobot, name):
    before = {path: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    done = ffrobot("solve", "scene.toml", "--log-file", name, cwd=folder)
    assert done.returncode == 2
    assert "expected a new file or a log" in done.stderr
    assert {path: path.read_bytes() for path in folder.iterdir() if path.is_file()} == before


def test_writing_itself_refuses(tmp_path):
    """For outputs whose names are known only when they are written."""
    from ffrobot.common.errors import InputError
    from ffrobot.common.files import write_atomically
    from ffrobot.common.outputs import protected

    source, alias = tmp_path / "grid.vtkhdf", tmp_path / "alias"
    source.write_bytes(b"input")
    alias.hardlink_to(source)
    for path in (source, alias):
        with protected([source]), pytest.raises(InputError, match="which would be lost"):
            write_atomically(path, b"output", "grid")
    write_atomically(tmp_path / "page", b"<!doctype html><p>", "page")
    write_atomically(tmp_path / "page", b"<html lang='en'>", "page")
    for content in (b"a,b\n1,2\n", b"<svg>", b"\x89PNG", b'{"a": 1}', b"\x89HDF\r\n\x1a\n"):
        with pytest.raises(InputError, match="found one of kind html"):
            write_atomically(tmp_path / "page", content, "other")
    assert source.read_bytes() == b"input"


def test_a_folder_that_is_gone_takes_no_output(tmp_path, monkeypatch):
    from ffrobot.common.errors import InputError
    from ffrobot.common.outputs import check_not_an_input, protected

    monkeypatch.chdir(tmp_path)
    tmp_path.rmdir()
    with protected([Path("scene.toml")]), pytest.raises(InputError, match="expected a file name, found No such file"):
        check_not_an_input(Path("out.h5"))
