"""One run of a sweep: a process of its own, and the row of the table that it leaves."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError
from ..common.files import write_atomically
from ..common.parallel import environment_without_mpi
from ..results.file import Results

ROW, SCENE, RESULTS = "row.json", "scene.toml", "results.h5"

REDUCTIONS: Mapping[str, Callable[[Array], Any]] = {
    "max": lambda values: np.abs(values).max(),
    "rms": lambda values: np.sqrt(np.mean(values**2)),
    "first": lambda values: values[0],
    "last": lambda values: values[-1],
}
"""What becomes of a history (T,), by the word behind the colon of `--collect`."""

STANDARD = ("joints/{}/moment", "pzt/{}/required_voltage", "pzt/{}/voltage", "points/{}/deflection")
"""Histories of which the largest value is in every table."""


@dataclass(frozen=True)
class Run:
    """One combination of values: where its files are and what is collected of its results."""

    number: int
    values: tuple[Any, ...]
    folder: Path
    collect: tuple[str, ...] = ()


@dataclass(frozen=True)
class Row:
    """What a run left: `status` is "completed", "wrong input", "failed" or "crashed", with the program's message."""

    number: int
    values: tuple[Any, ...]
    status: str
    message: str = ""
    quantities: dict[str, float] = field(default_factory=dict)


def perform(run: Run) -> Row:
    """Solve the scene in the run's folder; the row is kept there, so that the sweep can be taken up again."""
    results = run.folder / RESULTS
    command = [sys.executable, "-m", "ffrobot", "solve", str(run.folder / SCENE), "-o", str(results)]
    threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, env=environment_without_mpi() | threads, capture_output=True, text=True)
    status = {0: "completed", 1: "failed", 2: "wrong input"}.get(done.returncode, "crashed")
    message = "" if done.returncode == 0 else _last_message(done.stderr, run.folder)
    quantities = _quantities(results, run.collect) if results.exists() else {}
    row = Row(run.number, run.values, status, message, quantities)
    write_atomically(run.folder / ROW, json.dumps(asdict(row)).encode(), "row of the sweep", ours=True)
    return row


def finished_row(folder: Path) -> Row | None:
    """The row that an earlier run left in `folder`, if it came to its end."""
    path = folder / ROW
    if not path.exists():
        return None
    data = json.loads(path.read_text(encoding="utf-8"))
    return Row(**(data | {"values": tuple(data["values"])}))


def _last_message(text: str, folder: Path) -> str:
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1].removeprefix("ffrobot: ").replace(f"{folder}{os.sep}", "") if lines else "no message"


def _quantities(path: Path, collect: Sequence[str]) -> dict[str, float]:
    with Results(path) as results:
        found: dict[str, float] = {}
        for analysis in results.analyses:
            about = results.attributes(analysis)
            found |= {f"{analysis} {key}": float(about[key]) for key in ("steps", "wall_seconds")}
            for name in _standard(results, analysis):
                found[f"{name} max"] = _reduce(results, name, "max")
        for request in collect:
            name, reduction = collected(request)
            found[f"{name} {reduction}"] = _reduce(results, name, reduction)
    return found


def _standard(results: Results, analysis: str) -> Iterator[str]:
    for pattern in STANDARD:
        group = pattern.partition("/")[0]
        for member in results.names(f"{analysis}/{group}"):
            name = f"{analysis}/{pattern.format(member)}"
            if results.has(name):
                yield name


def _reduce(results: Results, name: str, reduction: str) -> float:
    """Of a history, of the lengths of planar vectors (T, 2), or of the largest of several columns; NaN if absent."""
    try:
        values = results.data(name)
    except InputError:
        return float("nan")
    is_vector = values.shape[1] == 2 and "pzt" not in name.split("/")
    history = np.linalg.norm(values, axis=1) if is_vector else values[:, 0]
    if values.shape[1] > 1 and not is_vector:
        history = np.abs(values).max(axis=1)
    return float(REDUCTIONS[reduction](history))


def collected(request: str) -> tuple[str, str]:
    """Dataset and reduction of a `--collect`. Raises `InputError` where the word behind the colon is unknown."""
    name, _, reduction = request.partition(":")
    if not name or reduction not in ("", *REDUCTIONS):
        raise InputError(f'--collect: expected DATASET or DATASET:{"|".join(REDUCTIONS)}, found "{request}"')
    return name, reduction or "max"
