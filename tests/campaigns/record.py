"""What a campaign found, for docs/developer/stress_tests.md: a file each in `records/`, written where asked for.

A campaign (a script in this folder, run by hand with seeds of its own) takes an option `--record` and ends with

    record("inputs", tried="300 changed files", found="bag: rejected 27, …")

Counts belong into both texts. The table of the page then takes it in with `python tests/campaigns/record.py`, which
reads all files in `records/`; both are committed. A campaign of several parts has a name for each: "tolerance-radau".
"""

import argparse
import json
import shlex
import subprocess
import sys
from datetime import date
from pathlib import Path

HERE = Path(__file__).parent


def options(doc: str, **defaults: object) -> argparse.ArgumentParser:
    """Options of a campaign: one for each default, of its type, and `--record`."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in defaults.items():
        parser.add_argument(f"--{name}", type=type(default), default=default)
    parser.add_argument("--record", action="store_true", help="keep what was found for docs/developer/stress_tests.md")
    return parser


RECORDS = HERE / "records"
PAGE = HERE.parents[1] / "docs" / "developer" / "stress_tests.md"
HEAD = "| tried | found | command | when |\n|---|---|---|---|\n"


def record(name: str, *, tried: str, found: str) -> None:
    """Write `records/NAME.json`: what was tried, what was found, and the command, date and commit of this run."""
    script = Path(sys.argv[0]).resolve().relative_to(HERE.parents[1])
    arguments = [text for text in sys.argv[1:] if text != "--record"]
    commit = subprocess.run(
        ["git", "describe", "--always", "--dirty=, changed"], cwd=HERE, capture_output=True, text=True, check=True
    )
    entry = {
        "command": shlex.join(["python", str(script), *arguments]),
        "tried": tried,
        "found": found,
        "when": f"{date.today()}, {commit.stdout.strip()}",
    }
    RECORDS.mkdir(exist_ok=True)
    (RECORDS / f"{name}.json").write_text(json.dumps(entry, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def with_campaigns(page: str) -> str:
    """The text of the page, its last table made of the records."""
    records = (json.loads(path.read_text(encoding="utf-8")) for path in sorted(RECORDS.glob("*.json")))
    rows = ("| {tried} | {found} | `{command}` | {when} |\n".format(**record) for record in records)
    return page[: page.index(HEAD)] + HEAD + "".join(rows)


if __name__ == "__main__":
    PAGE.write_text(with_campaigns(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
