"""The table of campaigns in docs/developer/stress_tests.md: a row for each that has written `records/NAME.json`.

python tests/campaigns/table.py     writes it once more
"""

import json
from pathlib import Path

RECORDS = Path(__file__).with_name("records")
PAGE = Path(__file__).parents[2] / "docs" / "developer" / "stress_tests.md"
HEAD = "| tried | found | command | when |\n|---|---|---|---|\n"


def with_campaigns(page):
    """The text of the page, its last table made of the records."""
    records = (json.loads(path.read_text(encoding="utf-8")) for path in sorted(RECORDS.glob("*.json")))
    rows = ("| {tried} | {found} | `{command}` | {when} |\n".format(**record) for record in records)
    return page[: page.index(HEAD)] + HEAD + "".join(rows)


if __name__ == "__main__":
    PAGE.write_text(with_campaigns(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
