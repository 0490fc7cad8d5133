"""What was measured as files: a CSV of the rows, and a JSON of the same with machine, versions and inputs; no dates."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import os
import platform
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path

from ..common.files import write_atomically
from ..mbs import _core
from .errors import KINDS
from .precision import Row

FORMAT, FORMAT_VERSION = "ffrobot-bench", 1

ERRORS = tuple(f"error_{kind}" for kind in KINDS)
# What is shown of the rows of a part.
COLUMNS = {
    "work-precision": ("integrator", "ran", "tolerance", "status", "seconds_min", "steps", *ERRORS),
    "axes": ("axis", "elements", "modes", "tolerance", "status", "against", "seconds", *ERRORS),
    "growth": ("with", "size", "seconds_min", "order"),
    "evaluations": ("what", "seconds_min", "seconds", "aim", "of_hand_written", "of_hand_written_median"),
    "aims": ("what", "run", "status", "integrator", "tolerance", "ratio", "ratio_median", "aim", "accurate"),
    "replays": ("scene", "what", "integrator", "tolerance", "seconds", "of_pcid", "of_pcid_median", "steps",
                "steps_of_pcid", "off"),
    "peer": ("step", "gravity", "status", "seconds", "error_force", "error_displacement", "error_force_at_start"),
}  # fmt: skip

# The least time of repetitions is what the machine can do: what tables and figures show, and say that they do.
HEADINGS = {"seconds_min": "least seconds"}


def write_record(folder: Path, part: str, rows: Sequence[Row], about: Mapping[str, object]) -> list[Path]:
    """Write PART.csv and PART.json into `folder`, which is made where absent. Returns the two paths.

    Columns are those of all rows; cells are empty where a row has no such value. `about` goes into the JSON only.
    """
    columns = list(dict.fromkeys(key for row in rows for key in row))
    table = io.StringIO(newline="")
    writer = csv.DictWriter(table, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: _short(value) for key, value in row.items()} for row in rows)
    record = {"format": FORMAT, "format_version": FORMAT_VERSION, "part": part, **about, "rows": rows}
    texts = {"csv": table.getvalue(), "json": json.dumps(record, indent=1, ensure_ascii=False) + "\n"}
    paths = [folder / f"{part.replace('-', '_')}.{extension}" for extension in texts]
    for path, text in zip(paths, texts.values(), strict=True):
        write_atomically(path, text.encode(), "record", make_folder=True)
    return paths


def _short(value: object) -> object:
    """Five digits: more are noise here."""
    return f"{value:.5g}" if isinstance(value, float) else value


def as_text(rows: Sequence[Row], part: str) -> tuple[list[str], list[list[str]]]:
    """Headings and cells of what is shown of a part; columns that are empty in all rows are left out."""
    shown = [column for column in COLUMNS[part] if any(row.get(column) is not None for row in rows)]
    headings = [HEADINGS.get(column, column.removeprefix("error_").replace("_", " ")) for column in shown]
    return headings, [[_cell(row.get(column)) for column in shown] for row in rows]


def _cell(value: object) -> str:
    if value is None:
        return ""
    return f"{value:.3g}" if isinstance(value, float) else str(value)


LIBRARIES = ("ffrobot", "numpy", "scipy", "h5py")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")


def about_machine() -> dict[str, object]:
    """Processor, cores, operating system, compiler and flags of the core, versions, threads."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "compiler": _core.build,
        "versions": {"python": platform.python_version(), **{name: _version(name) for name in LIBRARIES}},
        "threads": {name: os.environ.get(name) for name in THREADS},
    }


def load() -> float:
    """Processes that want to run, mean of the last minute: beside the numbers it says how quiet the machine was."""
    return os.getloadavg()[0]


def content_hash(text: str) -> str:
    """SHA-256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()


def _version(library: str) -> str:
    return str(import_module(library).__version__)  # Debian's packages need not have metadata


def _processor() -> str:
    information = Path("/proc/cpuinfo")
    if information.is_file():
        for line in information.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()
