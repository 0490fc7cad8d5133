"""The option of stress tests."""

import pytest


def pytest_addoption(parser):
    parser.addoption("--long", action="store_true", help="run stress tests that take minutes as well")


def pytest_collection_modifyitems(config, items):
    if not config.getoption("--long", default=False):
        skip = pytest.mark.skip(reason="takes minutes: pytest tests/stress --long")
        for item in items:
            if item.get_closest_marker("long"):
                item.add_marker(skip)
