"""The page of the docs is what the rows make of it, and every row has a test."""

import pytest
from table import PAGE, Table, render


def test_page_is_current(request, table):
    if request.config.getoption("--write-table", default=False):
        pytest.skip("is being written")
    assert PAGE.read_text() == render(table.rows), "pytest tests/stress --write-table"


def test_every_row_is_still_tried(request, table):
    """Of the rows that this run can have tried; needs the whole suite in one process."""
    others = [item for item in request.session.items if item.fspath.dirname == request.node.fspath.dirname]
    if len({item.fspath for item in others}) < 9:
        pytest.skip("only with all stress tests")
    is_long = request.config.getoption("--long", default=False)
    expected = {tried for tried, row in table.rows.items() if is_long or not row["long"]}
    assert expected <= table.recorded
    assert Table.current is table
