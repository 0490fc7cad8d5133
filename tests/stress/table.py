"""The table of what was tried, the limit found and how failure is reported: rows in a file, and the page of them.

    python tests/stress/table.py     writes the page once more, from table.json and what campaigns have recorded

A campaign of tests/campaigns has a row once it has written `records/NAME.json` there: `record.py` beside it says how.
"""

import json
from pathlib import Path

ROWS = Path(__file__).with_name("table.json")
RECORDS = Path(__file__).parents[1] / "campaigns" / "records"
PAGE = Path(__file__).parents[2] / "docs" / "developer" / "stress_tests.md"

SAME = 0.1  # relative difference within which numbers of another machine count as the same
ROUNDING = 1e-12

HEAD = """# Stress tests

Each row is an input that pushes the solver to its limit, the limit found, and the end of the run. `tests/stress` runs
every row and compares; lengths in m, times in s. The tests write this page:

    pytest tests/stress                        what every change is tested with
    pytest tests/stress --long                 the rows marked with a star as well, some minutes
    pytest tests/stress --long --write-table   writes this page

Units of length, mass and time are the user's: nothing is compared with a meter, a kilogram or a second. A run that does
not reach its end keeps its results up to there; the attributes `status` and `cause` of the results file, and the
message, state how and why it ended.
"""

CAMPAIGNS = """
## Campaigns

Random inputs, damage and signals, started manually with new seeds; no test repeats them. The last run of each, with
its commit:

| tried | found | command | when |
|---|---|---|---|"""


class Table:
    """Rows by what was tried."""

    current = None

    def __init__(self, rows):
        self.rows = rows
        self.recorded = set()
        Table.current = self

    def record(self, group, tried, found, reported, measured, *, is_long, write):
        row = {"group": group, "found": found, "reported": reported, "long": is_long}
        row["measured"] = {key: float(f"{float(value):.2g}") for key, value in measured.items()}
        self.recorded.add(tried)
        if write:
            self.rows[tried] = row
            return
        known = self.rows.get(tried)
        assert known is not None, f"not in {ROWS.name}: {tried}; pytest tests/stress --write-table"
        assert row | {"measured": {}} == known | {"measured": {}}
        for key, value in row["measured"].items():
            assert same(value, known["measured"][key]), (
                f"{tried}: {key}: {value}, in the table {known['measured'][key]}"
            )


def same(one, other):
    size = max(abs(one), abs(other))
    return size <= ROUNDING or abs(one - other) <= SAME * size


def at_most(limit, value):
    """`limit`, to be recorded in place of a value that is rounding, or hangs on where steps happen to fall."""
    assert value <= limit, f"{value} > {limit}"
    return limit


def number(value):
    if value == 0 or 1e-3 <= abs(value) < 1e6:
        return f"{value:.2g}" if abs(value) < 100 else f"{value:.0f}"
    return f"{value:.0e}".replace("e-0", "e-").replace("e+0", "e")


def render(rows):
    groups = dict.fromkeys(row["group"] for row in rows.values())
    page = [HEAD]
    for group in sorted(groups):
        page += [f"\n## {group}\n", "| tried | found | how it ends |", "|---|---|---|"]
        for tried, row in sorted(rows.items()):
            if row["group"] == group:
                found = row["found"].format(**{key: number(value) for key, value in row["measured"].items()})
                page.append(f"| {tried}{' *' if row['long'] else ''} | {found} | {row['reported']} |")
    page.append(CAMPAIGNS)
    for path in sorted(RECORDS.glob("*.json")):
        campaign = json.loads(path.read_text(encoding="utf-8"))
        page.append("| {tried} | {found} | `{command}` | {when} |".format(**campaign))
    return "\n".join(page) + "\n"


if __name__ == "__main__":
    PAGE.write_text(render(json.loads(ROWS.read_text(encoding="utf-8"))), encoding="utf-8")
