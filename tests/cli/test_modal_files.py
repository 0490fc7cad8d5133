"""Modal body files on the way to a solve: given by name, made when needed, damaged."""

from pathlib import Path

import h5py
import numpy as np
import pytest

SHORT = {"end = 1.0": "end = 0.01"}
GIVEN = {'link = "link1.toml"': 'modal = "link1.h5"'}


@pytest.fixture
def given(two_link_copy, ffrobot):
    """A folder whose scene takes link1 from a modal body file, which is there."""
    folder = two_link_copy({"scene.toml": SHORT | GIVEN})
    assert ffrobot("link", "link1.toml", cwd=folder).returncode == 0
    return folder


def test_link_is_computed_once(two_link_copy, ffrobot):
    folder = two_link_copy()
    first = ffrobot("link", "link1.toml", cwd=folder)
    content = (folder / "link1.h5").read_bytes()
    assert first.stdout.startswith("link1.h5: computed in ")
    link = folder / "link1.toml"
    link.write_text("# a comment changes nothing\n" + link.read_text(encoding="utf-8"), encoding="utf-8")
    again = ffrobot("link", "link1.toml", cwd=folder)
    assert again.stdout.startswith("link1.h5: up to date")
    assert "10 modes" in again.stdout
    assert "computed" in ffrobot("link", "link1.toml", "--force", cwd=folder).stdout
    assert (folder / "link1.h5").read_bytes() == content
    elsewhere = ffrobot("link", "link1.toml", "-o", "body.h5", cwd=folder)
    assert elsewhere.returncode == 0
    assert (folder / "body.h5").read_bytes() == content


def test_solve_uses_the_cache(two_link_copy, ffrobot, two_link):
    """The links were computed for the session's `two_link`; nothing is written beside the scene but the results."""
    folder = two_link_copy({"scene.toml": SHORT})
    before = {path.name for path in folder.iterdir()}
    done = ffrobot.ok("solve", "scene.toml", "--verbose", cwd=folder)
    assert "link1: stage 1, up to date" in done.stdout
    assert "link2: stage 1, up to date" in done.stdout
    assert {path.name for path in folder.iterdir()} - before == {"scene.results.h5"}


def test_scene_with_a_modal_file_gives_the_same(given, two_link_copy, ffrobot, two_link):
    ffrobot.ok("solve", "scene.toml", "-o", "mine.h5", cwd=given)
    assert not (given / "scene.results.h5").exists()
    with h5py.File(given / "mine.h5") as file:
        name = "inverse/points/link2.tip/deflection"
        expected = two_link.file[name][:11]
        np.testing.assert_allclose(file[name], expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def _truncate(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


@pytest.mark.parametrize(
    ("damage", "named"), [(_truncate, "damaged"), (Path.unlink, 'expected an existing file, found "link1.h5"')]
)
def test_bad_modal_file(given, refused, damage, named):
    """Other damage: tests/test_damaged_files.py."""
    damage(given / "link1.h5")
    message = refused(given, "solve", "scene.toml")
    assert "link1.h5" in message
    assert named in message


def test_a_modal_file_of_another_link_file_is_noted(given, ffrobot):
    link = given / "link1.toml"
    note = "link1.h5 is older than link1.toml, or than the program: ffrobot link link1.toml makes it again"
    assert note not in ffrobot.ok("solve", "scene.toml", cwd=given).stdout
    text = link.read_text(encoding="utf-8")
    link.write_text(text.replace("density = 7850", "density = 7800"), encoding="utf-8")
    assert link.read_text(encoding="utf-8") != text
    assert note in ffrobot.ok("solve", "scene.toml", cwd=given).stdout
