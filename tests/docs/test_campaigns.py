"""The table of campaigns is what their records make of it; deliberate faults stand in today's source."""

from faults import FAULTS, ROOT
from record import PAGE, with_campaigns


def test_the_page_is_current():
    page = PAGE.read_text(encoding="utf-8")
    assert with_campaigns(page) == page, "python tests/campaigns/record.py"


def test_faults_are_in_the_source_once():
    counts = {fault.old: (ROOT / fault.file).read_text(encoding="utf-8").count(fault.old) for fault in FAULTS}
    assert set(counts.values()) == {1}, [
        ("tests/campaigns/faults.py", old) for old, count in counts.items() if count != 1
    ]
