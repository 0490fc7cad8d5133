"""Link files for the tests, written as a user would."""

import pytest

LINK = """
name = "{name}"

[material]
youngs_modulus = 2.068427e11
poissons_ratio = 0.3
density = 7850.0

[geometry]
kind = "beam"
length = 1.0
section = {section}

[mesh]
elements = {elements}

[reference]
condition = "{condition}"

[modes]
count = {count}
family = "{family}"
attachment_modes = false
{more}
"""


@pytest.fixture
def link_file(tmp_path):
    """Write a link file, the paper's unless told otherwise, and return its path; `replace` changes lines of it."""

    def write(
        name="link1",
        section='{ shape = "rectangle", height = 0.015, width = 0.025 }',
        elements=20,
        condition="simply-supported",
        count=10,
        family="in-plane-bending",
        more="",
        replace=None,
    ):
        text = LINK.format(**{key: value for key, value in locals().items() if key not in ("replace", "tmp_path")})
        for old, new in (replace or {}).items():
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / f"{name}.toml"
        path.write_text(text)
        return path

    return write


@pytest.fixture(autouse=True)
def cache(request, tmp_path, tmp_path_factory, monkeypatch):
    """A cache folder in place of the user's: empty, or one for all tests of a module with ONE_CACHE."""
    is_shared = hasattr(request.module, "ONE_CACHE")
    folder = tmp_path_factory.getbasetemp() / request.module.__name__ if is_shared else tmp_path / "cache"
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    return folder
