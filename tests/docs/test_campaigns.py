"""The table of campaigns is what their records make of it."""

from table import PAGE, with_campaigns


def test_the_page_is_current():
    page = PAGE.read_text(encoding="utf-8")
    assert with_campaigns(page) == page, "python tests/campaigns/table.py"
