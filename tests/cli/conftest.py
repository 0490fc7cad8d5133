"""Edited copies of the two-link case, and what every refusal has in common."""

import pytest


@pytest.fixture
def two_link_copy(case_copy):
    """A copy of the two-link case with texts replaced: `{file: {old: new}}`; returns its folder."""

    def copy(edits=None):
        folder = case_copy("two_link").parent
        for name, replacements in (edits or {}).items():
            text = (folder / name).read_text(encoding="utf-8")
            for old, new in replacements.items():
                assert old in text, f"{name} has no {old!r}"
                text = text.replace(old, new)
            (folder / name).write_text(text, encoding="utf-8")
        return folder

    return copy


@pytest.fixture
def refused(ffrobot):
    """Run a command that must be refused, and return its message.

    One message without traceback on stderr, nothing on stdout, every file of the folder as it was.
    """

    def run(folder, *arguments, code=2, **options):
        before = _files(folder)
        done = ffrobot(*arguments, cwd=folder, **options)
        assert done.returncode == code, done.stdout + done.stderr
        assert done.stdout == ""
        assert done.stderr.startswith("ffrobot: ")
        assert "Traceback" not in done.stderr
        assert _files(folder) == before
        return done.stderr

    return run


def _files(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
