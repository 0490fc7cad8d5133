"""What was measured as files: a CSV of the rows, and a JSON of the same with machine, versions and inputs."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..files import write_atomically
from .sweep import Row

FORMAT, FORMAT_VERSION = "ffrobot-bench", 1


def write_record(folder: Path, name: str, rows: Sequence[Row], about: Mapping[str, object]) -> list[Path]:
    """Write NAME.csv and NAME.json into `folder`, which is made where absent. Returns the two paths.

    Columns are those of all rows; cells are empty where a row has no such value. `about` goes into the JSON only.
    """
    columns = list(dict.fromkeys(key for row in rows for key in row))
    table = io.StringIO(newline="")
    writer = csv.DictWriter(table, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: _short(value) for key, value in row.items()} for row in rows)
    record = {"format": FORMAT, "format_version": FORMAT_VERSION, "part": name, **about, "rows": rows}
    texts = {"csv": table.getvalue(), "json": json.dumps(record, indent=1, ensure_ascii=False) + "\n"}
    paths = [folder / f"{name}.{extension}" for extension in texts]
    for path, text in zip(paths, texts.values(), strict=True):
        write_atomically(path, text.encode(), "record", make_folder=True)
    return paths


def _short(value: object) -> object:
    """Five digits: more are noise here."""
    return f"{value:.5g}" if isinstance(value, float) else value
