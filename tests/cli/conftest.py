"""Edited copies of the two-link case, and what every refusal has in common."""

import subprocess

import pytest
from mistakes import edited


@pytest.fixture
def two_link_copy(case_copy):
    """A copy of the two-link case with texts replaced: `{file: {old: new}}`; returns its folder."""

    def copy(edits=None):
        folder = case_copy("two_link").parent
        for name, replacements in (edits or {}).items():
            edited(folder, name, replacements)
        return folder

    return copy


@pytest.fixture
def small_disk(tmp_path):
    """Make a folder on a disk of a size; skips where this user may not mount one."""
    folder = tmp_path / "disk"

    def mount(size):
        folder.mkdir()
        if subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder], check=False).returncode:
            pytest.skip("mounting a small file system needs root")
        return folder

    yield mount
    subprocess.run(["umount", folder], check=False)
