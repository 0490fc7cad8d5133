"""A sweep from its plan to its table; what is finished is not run again."""

import json
import math
import os
import signal
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import asdict, field, replace
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic

from rich.console import Console

from ..batch.batch import Batch
from ..common.errors import FfrobotWarning, InputError, StoppedError
from ..common.files import check_folder, check_new_folder, write_atomically
from ..common.keys import MOST_RUNS
from ..common.libraries import scipy
from ..common.python_files import allowed_python, python_allowed
from ..common.structs import struct
from ..common.tables import as_csv
from ..common.version import digest_of_content
from ..present.lines import plain_table
from ..run.inputs import PROGRAM
from ..run.watcher import Watcher
from .files import SCENE, RunFiles, Value, Variation, parse_variation, run_files
from .runs import RESULTS, ROW, Row, SweepRun, collected, finished_row, missing_columns, perform

PLAN = "plan.json"
TABLE_SHARE = 0.05  # of the time of a sweep that its table may take: that of 10 000 runs is long

Key = tuple[str, ...]
"""Parts of a key, `("payload", "0", "mass")`."""


@struct
class Sweep:
    """The runs of a scene: `points` are the combinations of the `variations`' values, one run each.

    `collect` names histories whose reductions become columns beside the standard ones; see `runs.REDUCTIONS`. `fixed`
    are changes that all points share, `own` the values that the scene has itself, which change nothing. `growing`: the
    points are of a search with `earlier` rows and maybe later ones; then changes name the folders of runs, and results
    stay, to be read. `wanted`: datasets and groups of the results, with their analysis, where no others are needed.
    """

    scene: Path
    variations: tuple[Variation, ...]
    points: tuple[tuple[Value, ...], ...]
    folder: Path
    collect: tuple[str, ...] = ()
    allow_python: tuple[Path, ...] = ()
    fixed: Mapping[Key, Value] = field(default_factory=dict)
    own: tuple[Value, ...] = ()
    growing: bool = False
    earlier: tuple[Row, ...] = ()
    wanted: tuple[str, ...] = ()

    @property
    def keys(self) -> list[str]:
        """Varied keys as the user writes them."""
        return [variation.name for variation in self.variations]

    @property
    def table(self) -> Path:
        """Path of the table with all rows."""
        return self.folder / "table.csv"

    @property
    def runs(self) -> list[SweepRun]:
        """The runs of `points`, in the order of the table."""
        runs = []
        for k, values in enumerate(self.points, start=len(self.earlier)):
            name = f"{k:04d}"
            if self.growing:
                changes = {".".join(key): value for key, value in self.changes(values).items()}
                name = digest_of_content(changes)[:16]
            folder = self.folder.absolute() / "runs" / name
            runs.append(SweepRun(k, values, folder, self.collect, allow_python=self.allow_python, wanted=self.wanted))
        return runs

    def changes(self, values: Sequence[Value]) -> dict[Key, Value]:
        """Return, by key, how the scene of the point `values` differs from the user's."""
        points = zip(self.variations, values, self.own or (None,) * len(values), strict=True)
        return {**self.fixed, **{key: value for v, value, own in points if value != own for key in v.keys}}


def check_once(keys: Sequence[Key], option: str = "--vary") -> None:
    """Raise `InputError` for a key that the `option` names several times."""
    if twice := next((key for key in keys if keys.count(key) > 1), None):
        raise InputError(f"{option}: expected every key once", f"{'.'.join(twice)} several times")


def plan_sweep(
    scene: Path, vary: Sequence[str], folder: Path, sample: int | None, seed: int, collect: Sequence[str]
) -> Sweep:
    """Plan a run for every combination of the values, the last key fastest, or `sample` points of a Latin hypercube.

    The hypercube spreads values evenly over each range (McKay, Beckman & Conover 1979). Raises `InputError` for a wrong
    `--vary` or `--collect`, a scene or link file that the first point makes wrong, and a folder of another sweep.
    """
    check_folder(folder)
    variations = tuple(parse_variation(text) for text in vary)
    check_once([key for variation in variations for key in variation.keys])
    for request in collect:
        collected(request)
    if sample is None:
        if (count := math.prod(len(variation.values) for variation in variations)) > MOST_RUNS:
            raise InputError(f"--vary: expected at most {MOST_RUNS} runs", f"{count}: --sample takes some of them")
        points = tuple(product(*(variation.values for variation in variations)))
    else:
        draws = scipy.stats.qmc.LatinHypercube(len(variations), seed=seed).random(sample)
        points = tuple(tuple(v.draw(float(u)) for v, u in zip(variations, row, strict=True)) for row in draws)
    allowed = (scene.absolute().parent, *allowed_python())  # runs have folders of their own
    sweep = Sweep(scene, variations, points, folder, tuple(collect), allowed)
    check_point(sweep, points[0])
    claim_folder(sweep)
    return sweep


def run_sweep(sweep: Sweep, batch: Batch, watcher: Watcher) -> list[Row]:
    """Do the runs of a sweep by `batch`, and return their rows, failures too; the table grows with every run.

    Raises `InputError` where files change meanwhile, `StoppedError` after a signal.
    """
    rows, waiting = _rows_and_runs(sweep)
    asked = sweep.collect

    def tabulate() -> None:
        nonlocal asked
        known = [*sweep.earlier, *(rows[k] for k in sorted(rows))]
        done = (run for run in sweep.runs if run.number in rows and rows[run.number].status == "completed")
        if asked and (first := next(done, None)):
            for line in missing_columns(rows[first.number], asked, first.folder / RESULTS):
                warnings.warn(line, FfrobotWarning, stacklevel=1)
            asked = ()
        quantities = _quantities(known)
        lines: list[list[object]] = [["run", *sweep.keys, "status", *quantities, "message"]]
        for row in known:
            values = [row.quantities.get(name, "") for name in quantities]
            lines.append([row.number, *row.values, row.status, *values, row.message])
        write_atomically(sweep.table, as_csv(lines).encode(), "table of the sweep", ours=True)

    if rows or sweep.table.exists():
        tabulate()
    watcher.stage(f"{len(waiting)} runs" + (f", {len(rows)} done before" if rows else ""))
    due = 0.0  # s, when the table is written next
    try:
        for _, row in batch.results(perform, list(waiting.values())):
            if row is None:
                raise StoppedError(f"{sweep.folder}: stopped; the same command resumes it", signal.SIGINT)
            run = waiting[row.number]
            if what := row.changes(_files(sweep, run).inputs):
                raise InputError(
                    f"{sweep.folder}: {' and '.join(what)} changed while the sweep ran, and the runs under way with it;"
                    " the same command resumes it, and computes what is out of date"
                )
            write_atomically(run.folder / ROW, json.dumps(asdict(row)).encode(), "row of the sweep", ours=True)
            rows[row.number] = row
            watcher.advance(len(sweep.earlier) + len(rows), len(sweep.earlier) + len(sweep.points))
            if (now := monotonic()) >= due:
                tabulate()
                due = now + (monotonic() - now) / TABLE_SHARE
    finally:
        if rows:
            tabulate()
    return [rows[k] for k in sorted(rows)]


def stale_rows(sweep: Sweep) -> str:
    """Delete rows of runs whose input has changed since; returns a line on the changes, empty if none."""
    stale: dict[str, None] = {}
    count = 0
    for run in sweep.runs:
        if (row := finished_row(run.folder)) and (what := row.changes(_files(sweep, run).inputs)):
            stale |= dict.fromkeys(what if row.inputs else [PROGRAM])
            count += 1
            (run.folder / ROW).unlink()
    names = " and ".join(stale)
    return f"{names} {'have' if len(stale) > 1 else 'has'} changed since: {count} rows computed again" if stale else ""


def _rows_and_runs(sweep: Sweep) -> tuple[dict[int, Row], dict[int, SweepRun]]:
    """By number: the rows of finished runs of the same input, and the runs that are left, their files written."""
    rows, waiting = {}, {}
    for run in sweep.runs:
        files, row = _files(sweep, run), finished_row(run.folder)
        is_read = sweep.growing and row and row.status == "completed"
        is_whole = row and (not is_read or ((run.folder / RESULTS).exists() and row.has(sweep.wanted)))
        if row and is_whole and not row.changes(files.inputs):
            rows[run.number] = replace(row, number=run.number, values=run.values)
        else:
            files.write(run.folder)
            waiting[run.number] = replace(run, inputs=files.inputs)
    return rows, waiting


def _files(sweep: Sweep, run: SweepRun) -> RunFiles:
    return run_files(sweep.scene, sweep.changes(run.values), run.folder)


def check_point(sweep: Sweep, values: tuple[Value, ...]) -> None:
    """Raise `InputError`, before any run, if the scene or a link file is invalid with these values.

    Errors that show with modal bodies or results are not found.
    """
    from ..fe_models.link_file import read_link
    from ..scene.load import load_scene

    with TemporaryDirectory() as folder:
        run = SweepRun(0, values, Path(folder))
        try:
            with python_allowed(sweep.allow_python):
                scene = load_scene(_files(sweep, run).write(run.folder))
            for body in scene.body:
                if body.link is not None:
                    read_link(body.link)
        except InputError as error:
            message = str(error).replace(str(Path(folder) / SCENE), str(sweep.scene)).replace(folder + os.sep, "")
            what = ", ".join(f"{name} = {value}" for name, value in zip(sweep.keys, values, strict=True))
            raise InputError(f"with {what}:\n{message}") from None


def claim_folder(sweep: Sweep) -> None:
    """Start or resume the folder of a sweep. Raises `InputError` for a folder of another sweep.

    A sweep that is `growing` may resume with other keys and points.
    """
    scene = str(sweep.scene.absolute())
    of_points = {"keys": sweep.keys, "points": sweep.points, "collect": sweep.collect}
    plan = json.dumps({"scene": scene, **({"growing": True} if sweep.growing else of_points)})
    path = sweep.folder / PLAN
    if path.exists() and path.read_text(encoding="utf-8", errors="replace") != plan:
        raise InputError(f"{sweep.folder}: output: expected a new folder or one of this very sweep", "another's")
    if not path.exists():
        check_new_folder(sweep.folder)
    write_atomically(path, plan.encode(), "plan of the sweep", make_folder=True, ours=True)


def forget_failures(sweep: Sweep) -> int:
    """Delete rows of runs that did not complete, so that they run again; returns their number."""
    failed = [run for run in sweep.runs if (row := finished_row(run.folder)) and row.status != "completed"]
    for run in failed:
        (run.folder / ROW).unlink()
    return len(failed)


def drop_results(sweep: Sweep) -> None:
    """Delete the results files of the runs; the table stays."""
    for run in sweep.runs:
        (run.folder / RESULTS).unlink(missing_ok=True)


SHOWN = 5  # quantities on the screen


def print_table(sweep: Sweep, rows: Sequence[Row], console: Console) -> None:
    """Print keys, status and the collected, or a few default, quantities of each run; the table's file has all."""
    asked = [" ".join(collected(request)) for request in sweep.collect]
    quantities = [name for name in _quantities(rows) if not name.endswith((" steps", " wall_seconds"))]
    shown = [name for name in quantities if name in asked] if asked else quantities[:SHOWN]
    own = ["run", *sweep.keys, "status"]
    widths = [max([8, *map(len, _broken(header).splitlines())]) + 2 for header in (*own, *shown)]
    while len(shown) > 1 and sum(widths[: len(own) + len(shown)]) > console.width:
        shown = shown[:-1]
    cells = (
        (str(row.number), *map(number, row.values), row.status,
         *(f"{row.quantities[name]:.4g}" if name in row.quantities else "" for name in shown))
        for row in rows
    )  # fmt: skip
    console.print(plain_table(map(_broken, (*own, *shown)), cells, names=1), crop=False)
    for row in rows:
        if row.status != "completed":
            console.out(f"run {row.number}: {row.status}: {row.message}")
    more = f", with {len(quantities) - len(shown)} more quantities" if len(quantities) > len(shown) else ""
    console.out(f"table      {sweep.table}{more}")


def number(value: object) -> str:
    """Return the value of a key as text, floats with six digits."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _broken(header: str) -> str:
    return header.replace("/", "/\n").replace(" ", "\n")


def _quantities(rows: Sequence[Row]) -> list[str]:
    """All that is not zero in every row, as points are at which links cannot bend. Of studies what they ask."""
    rows = [row for row in rows if row.wanted] or rows
    return list(dict.fromkeys(name for row in rows for name, value in row.quantities.items() if value != 0.0))
