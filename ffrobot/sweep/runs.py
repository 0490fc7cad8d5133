"""One run of a sweep and the row that it leaves."""

import json
import os
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np

from ..batch.worker import own_worker
from ..common.arrays import Array
from ..common.errors import InputError, did_you_mean
from ..common.locks import is_running, this_process
from ..common.meanings import meaning
from ..common.peaks import root_mean_square
from ..common.structs import struct
from ..results.file import Results
from ..run.inputs import changed, digest_of_file
from .files import SCENE

ROW, RESULTS = "row.json", "results.h5"
MAKING = "results.of-"  # begins the names of results that a process is about to write

STOPPED = [code for number in (signal.SIGINT, signal.SIGTERM) for code in (-number, 128 + number)]
"""Exit codes of a run that was asked to end: nothing of the run itself."""

REDUCTIONS: Mapping[str, Callable[[Array, Array], Any]] = {
    "max": lambda _, values: np.abs(values).max(),
    "rms": root_mean_square,
    "first": lambda _, values: values[0],
    "last": lambda _, values: values[-1],
    "lowest": lambda _, values: values.min(),
}
"""What becomes of times and a history (T,), by the word behind the colon of `--collect`."""

STANDARD = ("joints/{}/moment", "pzt/{}/required_voltage", "pzt/{}/voltage", "points/{}/deflection")
"""Histories of which the largest value is in every table."""

SETTLING = {"residual": "residual", "settling": "time_to"}
"""Attributes of `settling/POINT` by the word before the point in `--collect`."""

PER_MODE = ("frequency", "damping_ratio")
OF_MODES = {"linear", "joints_locked", "joints_compliant"}
"""Groups with datasets `PER_MODE` whose columns are the robot's vibrations, the lowest first, no vector."""


@struct
class SweepRun:
    """Run of one combination of `values`: its number in the table and its `folder`.

    `collect`: `--collect` requests; `inputs`: fingerprints of files it is made from; `allow_python`: folders with
    allowed Python files; `wanted`: the only datasets needed (empty: all).
    """

    number: int
    values: tuple[Any, ...]
    folder: Path
    collect: tuple[str, ...] = ()
    inputs: dict[str, str] = field(default_factory=dict)
    allow_python: tuple[Path, ...] = ()
    wanted: tuple[str, ...] = ()


@struct
class Row:
    """Row of a run: `status` "completed", "wrong input", "failed" or "crashed", with the program's message.

    `inputs` are fingerprints of the files it was made from: see `run.inputs`; among them of those `imported` by the
    scene's Python files, known after the run only. `wanted`: the only datasets in its results (empty: all).
    """

    number: int
    values: tuple[Any, ...]
    status: str
    message: str = ""
    quantities: dict[str, float] = field(default_factory=dict)
    inputs: dict[str, str] = field(default_factory=dict)
    imported: tuple[str, ...] = ()
    wanted: tuple[str, ...] = ()

    def has(self, wanted: tuple[str, ...]) -> bool:
        """Whether the run's results have all `wanted` datasets (empty: all of a solve)."""
        return not self.wanted or (bool(wanted) and set(wanted) <= set(self.wanted))

    def changes(self, inputs: Mapping[str, str]) -> list[str]:
        """Return names of files, or `PROGRAM`, changed since the run; `inputs`: fingerprints now; see `run.inputs`."""
        return changed(self.inputs, {**inputs, **{name: digest_of_file(Path(name)) for name in self.imported}})


def perform(run: SweepRun) -> Row | None:
    """Solve the scene in the run's folder by this thread's worker; None where a signal interrupted it.

    Earlier results are replaced in one step: another command in the same folder may be reading them.
    """
    results, made = run.folder / RESULTS, run.folder / f"{MAKING}{this_process()}.{run.number}.h5"
    for left in run.folder.glob(f"{MAKING}*.h5"):
        if not is_running(left.name.removeprefix(MAKING).rsplit(".", 2)[0]):
            left.unlink(missing_ok=True)
    arguments = ["solve", str(run.folder / SCENE), "-o", str(made)]
    arguments += [f"--allow-python={path}" for path in run.allow_python]
    arguments += [f"--wanted={name}" for name in run.wanted]
    code, printed, imported = own_worker().perform(arguments)
    if made.exists():
        made.replace(results)
    else:  # earlier ones are of other input, maybe
        results.unlink(missing_ok=True)
    if code in STOPPED:
        return None
    status = {0: "completed", 1: "failed", 2: "wrong input"}.get(code, "crashed")
    message = "" if code == 0 else _message(printed, run.folder, code)
    quantities = _quantities(results, run) if results.exists() else {}
    inputs, others = run.inputs | imported, tuple(imported)
    return Row(run.number, run.values, status, message, quantities, inputs, imported=others, wanted=run.wanted)


def finished_row(folder: Path) -> Row | None:
    """Return the row that an earlier run, of any status, left in `folder`; None if there is none."""
    with suppress(OSError, ValueError, TypeError, KeyError, RecursionError):
        data = json.loads((folder / ROW).read_text(encoding="utf-8"))
        return Row(**(data | {key: tuple(data.get(key, ())) for key in ("values", "imported", "wanted")}))
    return None


def _message(printed: str, folder: Path, code: int) -> str:
    """The last one that a process printed; of one without, the signal that ended it."""
    lines = [line.removeprefix("ffrobot: ") for line in printed.splitlines() if line.strip()]
    with suppress(ValueError):
        lines = lines or [f"ended by {signal.Signals(-code).name}"]
    message = lines[-1] if lines else "no message"
    return message.replace(f"{folder.absolute()}{os.sep}", "").replace(f"{folder}{os.sep}", "")


def _quantities(path: Path, run: SweepRun) -> dict[str, float]:
    """How the analyses went; of whole results also the standard quantities, and those to collect."""
    quantities: dict[str, float] = {}
    with Results(path) as results:
        for analysis in results.analyses:
            about = results.attributes(analysis)
            quantities |= {f"{analysis} {key}": float(about[key]) for key in ("steps", "wall_seconds")}
            if run.wanted:
                continue
            quantities[f"{analysis} warnings"] = float(len(about["warnings"]))
            for pattern in STANDARD:
                for member in results.names(f"{analysis}/{pattern.partition('/')[0]}"):
                    name = f"{analysis}/{pattern.format(member)}"
                    if results.has(name):
                        quantities[f"{name} max"] = _reduce(results, name, "max")
        for request in run.collect:
            name, reduction = collected(request)
            with suppress(InputError):
                if name in SETTLING:
                    value = float(results.settling(reduction)[1][SETTLING[name]])
                else:
                    wanted, bracket, column = name.partition("[")
                    dataset = by_dots(results, list(results)).get(wanted.replace("/", "."), wanted)
                    value = _reduce(results, f"{dataset}{bracket}{column}", reduction)
                quantities[f"{name} {reduction}"] = value
    return quantities


def by_dots(results: Results, datasets: Sequence[str]) -> dict[str, str]:
    """Datasets by their names with dots for slashes; those of the first analysis also without its name."""
    first = f"{results.analyses[0]}/" if results.analyses else "/"
    short = {name.removeprefix(first).replace("/", "."): name for name in datasets if name.startswith(first)}
    return short | {name.replace("/", "."): name for name in datasets}


def missing_columns(row: Row, requests: Sequence[str], results: Path) -> Iterator[str]:
    """Yield a line for each `--collect` request that a completed run with these `results` does not contain."""
    for name, reduction in map(collected, requests):
        what, found, near = "the name of a dataset", name, ""
        if f"{name} {reduction}" in row.quantities:
            continue
        if name in SETTLING:
            what, found = "a point with residual vibration", reduction
        else:
            with suppress(InputError), Results(results) as file:
                near = did_you_mean(name, list(file))
        yield f'--collect: expected {what}, found no "{found}" in run {row.number}{near}'


def _reduce(results: Results, name: str, reduction: str) -> float:
    """Of a history, of the lengths of vectors (T, 2 or 3), or of the largest of several columns.

    Of spectra "max" is that of all vibrations, the others are of the lowest one.
    """
    values = results.data(name)
    dataset, bracket, column = name.partition("[")
    key = {"max": "peak", "rms": "rms"}.get(reduction, "")
    known = np.atleast_1d(results.attributes(dataset).get(key, ()))  # of all times that the run looked at
    if bracket and len(known) == results.data(dataset).shape[1]:
        return float(known[int(column.rstrip("]"))])
    if len(known) and not bracket and (reduction == "max" or len(known) == 1):
        return float(known.max())
    is_spectrum = name.rpartition("/")[2] in PER_MODE and not OF_MODES.isdisjoint(name.split("/"))
    if is_vector(results, name, values):
        history = np.linalg.norm(values, axis=1)
    elif values.shape[1] > 1 and (reduction == "max" or not is_spectrum):
        history = np.abs(values).max(axis=1)
    else:
        history = values[:, 0]
    time = results.time(dataset)
    time = time if len(time) == len(history) else np.arange(float(len(history)))  # of zeros, which have their own
    return float(REDUCTIONS[reduction](time, history))


def is_vector(results: Results, name: str, values: Array) -> bool:
    """Whether columns of the dataset `name`, `values` (T, columns), any unit, are components of one vector."""
    known = meaning(name.partition("/")[2])
    dimension = 3 if results.scene.get("space") == "spatial" else 2
    return known is not None and known.columns in ("axis", "component of {}") and values.shape[1] == dimension


def collected(request: str) -> tuple[str, str]:
    """Split a `--collect` request into dataset and reduction, or "residual" or "settling" and a point.

    Raises `InputError` where the word behind the colon is unknown.
    """
    if len(words := request.split()) == 2 and words[0] in SETTLING:
        return words[0], words[1]
    name, _, reduction = request.partition(":")
    if not name or reduction not in ("", *REDUCTIONS):
        reductions, of_point = "|".join(REDUCTIONS), " or ".join(f"{word} POINT" for word in SETTLING)
        raise InputError(f"--collect: expected DATASET, DATASET:{reductions}, {of_point}", f'"{request}"')
    return name, reduction or "max"
