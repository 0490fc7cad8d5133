"""Links of the paper's manipulator, computed by stage 1."""

import pytest

from ffrobot.fe_models.link import cached_modal_body

LINK = """
name = "{name}"

[material]
youngs_modulus = 2.068427e11
poissons_ratio = 0.3
density = 7850.0

[geometry]
kind = "beam"
length = 1.0
section = {{ shape = "rectangle", height = 0.015, width = 0.025 }}

[mesh]
elements = 20

[reference]
condition = "{condition}"

[modes]
count = {count}
family = "{family}"
attachment_modes = false
"""


@pytest.fixture(scope="session")
def link_file(tmp_path_factory):
    """Write a link file; stage 1 keeps its results in a cache of the test session."""
    folder = tmp_path_factory.mktemp("links")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder / "cache"))

        def write(name, condition="cantilever", count=10, family="in-plane-bending"):
            path = folder / f"{name}.toml"
            path.write_text(LINK.format(name=name, condition=condition, count=count, family=family))
            return path

        yield write


@pytest.fixture(scope="session")
def cantilever(link_file):
    """The modal body of a cantilever with `count` bending modes."""
    return lambda count: cached_modal_body(link_file(f"cantilever{count}", count=count)).body


@pytest.fixture(scope="session")
def all_modes(link_file):
    """A cantilever with the lowest modes of every kind, one axial mode among those that move in the plane."""
    return cached_modal_body(link_file("all_modes", count=18, family="all")).body
