"""The option of stress tests, and beams of the paper's material."""

import pytest
from beam_links import modal_body, paper_link, rectangle

from ffrobot.mbs.model.body import from_modal_body


def pytest_addoption(parser):
    parser.addoption("--long", action="store_true", help="run stress tests that take minutes as well")


def pytest_collection_modifyitems(config, items):
    if not config.getoption("--long", default=False):
        skip = pytest.mark.skip(reason="takes minutes: pytest tests/stress --long")
        for item in items:
            if item.get_closest_marker("long"):
                item.add_marker(skip)


@pytest.fixture(scope="session")
def beam():
    """A beam of stage 1, without geometric stiffening."""

    def make(name, condition, modes=6, height=0.015):
        geometry = {"kind": "beam", "length": 1.0, "section": rectangle(height, 0.025)}
        keys = paper_link(condition, modes, mesh={"elements": max(20, 2 * modes)}, geometry=geometry)
        return from_modal_body(name, modal_body(keys), is_planar=True)

    return make


@pytest.fixture(scope="session")
def beams(beam):
    """The two links of the paper's arm, in other proportions."""
    return lambda **keys: [beam("link1", "simply-supported", **keys), beam("link2", "cantilever", **keys)]
