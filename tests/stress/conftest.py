"""Options of the stress tests, the table they fill, and beams of the paper's material."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from bodies_by_invariants import from_modal_body
from table import PAGE, ROWS, Table, render

from ffrobot.fe_models.link import cached_modal_body

LINK = Path(__file__).parents[2] / "cases" / "two_link" / "link2.toml"


def pytest_addoption(parser):
    group = parser.getgroup("stress tests")
    group.addoption("--long", action="store_true", help="run those that take minutes as well")
    group.addoption("--write-table", action="store_true", help=f"write what is found to {ROWS.name} and {PAGE.name}")


def pytest_collection_modifyitems(config, items):
    if not config.getoption("--long", default=False):
        skip = pytest.mark.skip(reason="takes minutes: pytest tests/stress --long")
        for item in items:
            if item.get_closest_marker("long"):
                item.add_marker(skip)


@pytest.fixture(scope="session")
def table():
    return Table(json.loads(ROWS.read_text()) if ROWS.exists() else {})


@pytest.fixture
def record(request, table):
    """Tell the table what was tried and found; without --write-table it has to say so already."""
    write = request.config.getoption("--write-table", default=False)
    is_long = request.node.get_closest_marker("long") is not None
    return lambda group, tried, found, reported="completed", **measured: table.record(
        group, tried, found, reported, measured, is_long=is_long, write=write
    )


def pytest_sessionfinish(session):
    if session.config.getoption("--write-table", default=False) and Table.current is not None:
        ROWS.write_text(json.dumps(Table.current.rows, indent=1, ensure_ascii=False, sort_keys=True) + "\n")
        PAGE.write_text(render(Table.current.rows))


@pytest.fixture(scope="session")
def beam(tmp_path_factory):
    """The planar body of a beam of stage 1, without geometric stiffening unless asked for."""
    folder = tmp_path_factory.mktemp("beams")

    def make(name, condition, modes=6, height=0.015, *, stiffened=False, modal=False):
        text = LINK.read_text(encoding="utf-8")
        for old, new in {
            "elements = 20": f"elements = {max(20, 2 * modes)}",
            "height = 0.015": f"height = {height}",
            'condition = "cantilever"': f'condition = "{condition}"',
            "count = 10": f"count = {modes}",
        }.items():
            assert old in text
            text = text.replace(old, new)
        path = folder / f"{name}-{modes}-{height}.toml"
        path.write_text(text, encoding="utf-8")
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
            body = cached_modal_body(path).body
        planar = from_modal_body(name, body)
        planar = planar if stiffened else replace(planar, stiffening=None)
        return (body, planar) if modal else planar

    return make


@pytest.fixture(scope="session")
def beams(beam):
    """The two links of the paper's arm, in other proportions."""
    return lambda **keys: [beam("link1", "simply-supported", **keys), beam("link2", "cantilever", **keys)]
