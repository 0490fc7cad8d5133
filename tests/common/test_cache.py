"""The user's cache is of this user alone, whatever the umask, and what others may have written in it is not used."""

import os
import stat

import pytest

from ffrobot import FfrobotWarning
from ffrobot.common.cache import cache_folder, is_own
from ffrobot.common.files import write_atomically


@pytest.fixture
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.mark.parametrize("umask", [0o022, 0o002, 0o000])
def test_folders_and_files_are_private(umask, home):
    before = os.umask(umask)
    try:
        folder = cache_folder("links")
        write_atomically(folder / "one.h5", b"x", "entry", ours=True, private=True)
    finally:
        os.umask(before)
    assert folder == home / "ffrobot" / "links"
    modes = [stat.S_IMODE(path.stat().st_mode) for path in (home, home / "ffrobot", folder, folder / "one.h5")]
    assert modes == [0o700, 0o700, 0o700, 0o600]
    assert is_own(folder / "one.h5")


@pytest.mark.parametrize("wide", ["cache", "cache/ffrobot", "cache/ffrobot/links"])
def test_a_folder_that_others_may_write_is_not_used(wide, home):
    folder = cache_folder("links")
    (home.parent / wide).chmod(0o777)
    with pytest.warns(FfrobotWarning, match=f"{home}.*: not used as cache, since others may write to"):
        assert cache_folder("links") != folder
    (home.parent / wide).chmod(0o1777 if wide == "cache" else 0o755)  # as /tmp
    assert cache_folder("links") == folder


def test_files_that_others_may_write_or_own_are_not_used(home):
    file = cache_folder("links") / "one.h5"
    assert not is_own(file)
    file.write_bytes(b"x")
    for mode, own in ((0o600, True), (0o644, True), (0o664, False), (0o602, False)):
        file.chmod(mode)
        assert is_own(file) == own
    if os.geteuid() == 0:
        file.chmod(0o600)
        os.chown(file, 65534, 65534)
        assert not is_own(file)
        os.chown(home / "ffrobot", 65534, 65534)
        with pytest.warns(FfrobotWarning, match="it belongs to another user"):
            assert cache_folder("links") != file.parent


def test_a_cache_that_cannot_be_made(home):
    home.write_text("a file in the way")
    assert cache_folder("links").is_dir()
