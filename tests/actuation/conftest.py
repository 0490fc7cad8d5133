"""Links of the paper's manipulator, computed by stage 1."""

import pytest
from beam_links import modal_body, paper_link


@pytest.fixture(scope="session")
def cantilever():
    """The modal body of a cantilever with `count` bending modes."""
    return lambda count: modal_body(paper_link(count=count))


@pytest.fixture(scope="session")
def all_modes():
    """A cantilever with the lowest modes of every kind, one axial mode among those that move in the plane."""
    return modal_body(paper_link(count=18, family="all"))
