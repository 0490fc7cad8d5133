"""A sweep from its plan to its table; what is finished is not run again."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Any

from rich.console import Console
from rich.table import Table

from ..batch.batch import Batch
from ..common.errors import InputError, StoppedError
from ..common.files import check_folder, write_atomically
from ..common.python_files import allowed_python, python_allowed
from ..common.tables import as_csv
from ..common.version import digest_of_content
from ..run.inputs import PROGRAM
from ..run.watcher import Watcher
from .files import SCENE, RunFiles, Value, Variation, grid, latin_hypercube, parse_variation, run_files
from .runs import RESULTS, ROW, Row, SweepRun, collected, finished_row, perform

PLAN = "plan.json"
TABLE_SHARE = 0.05  # of the time of a sweep that its table may take: that of 10 000 runs is long

Key = tuple[str, ...]
"""Parts of a key, `("payload", "0", "mass")`."""


@dataclass(frozen=True)
class Sweep:
    """The runs of a scene: `points` are the combinations of the `variations`' values, one run each.

    `collect` names histories whose reductions become columns beside the standard ones; see `runs.REDUCTIONS`. `fixed`
    are changes that all points share, `own` the values that the scene has itself, which change nothing. `growing`: of
    the points of a search, which has `earlier` rows and may have later ones; folders of runs are then named by what
    their scenes have changed, and their results stay, to be read. `wanted`: datasets and groups of the results, with
    their analysis, where no others are needed.
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
    def collected(self) -> list[str]:
        """Names of the table's columns with collected quantities."""
        return [" ".join(collected(request)) for request in self.collect]

    @property
    def table(self) -> Path:
        """Path of the table with all rows."""
        return self.folder / "table.csv"

    @property
    def runs(self) -> list[SweepRun]:
        """Runs in the order of the table."""
        folder = self.folder.absolute() / "runs"
        common: dict[str, Any] = dict(collect=self.collect, allow_python=self.allow_python, wanted=self.wanted)
        return [
            SweepRun(k, values, folder / self._name(k, values), **common)
            for k, values in enumerate(self.points, start=len(self.earlier))
        ]

    def changes(self, values: Sequence[Value]) -> dict[Key, Value]:
        """Return changed values of one run's scene, by key."""
        points = zip(self.variations, values, self.own or (None,) * len(values), strict=True)
        return {**self.fixed, **{key: value for v, value, own in points if value != own for key in v.keys}}

    def _name(self, number: int, values: Sequence[Value]) -> str:
        if not self.growing:
            return f"{number:04d}"
        changes = {".".join(key): value for key, value in self.changes(values).items()}
        return digest_of_content(changes)[:16]


def check_once(keys: Sequence[Key], option: str = "--vary") -> None:
    """Raise `InputError` for a key that the `option` names several times."""
    if twice := next((key for key in keys if keys.count(key) > 1), None):
        raise InputError(f"{option}: expected every key once", f"{'.'.join(twice)} several times")


def plan_sweep(
    scene: Path, vary: Sequence[str], folder: Path, sample: int | None, seed: int, collect: Sequence[str]
) -> Sweep:
    """Every combination of the values, or `sample` points of a Latin hypercube.

    Raises `InputError` for a wrong `--vary` or `--collect`, a scene or link file that its first point makes wrong, and
    a folder that holds another sweep.
    """
    check_folder(folder)
    variations = tuple(parse_variation(text) for text in vary)
    check_once([key for variation in variations for key in variation.keys])
    for request in collect:
        collected(request)
    points = tuple(grid(variations) if sample is None else latin_hypercube(variations, sample, seed))
    allowed = (scene.absolute().parent, *allowed_python())  # runs have folders of their own
    sweep = Sweep(scene, variations, points, folder, tuple(collect), allowed)
    check_point(sweep, points[0])
    claim_folder(sweep)
    return sweep


def run_sweep(sweep: Sweep, batch: Batch, watcher: Watcher) -> list[Row]:
    """The rows of all runs, jobs of `batch`; failures are rows, too. The table in the folder grows with every run."""
    rows, waiting = _rows_and_runs(sweep)
    before = len(sweep.earlier)

    def tabulate() -> None:
        _write_table(sweep.table, sweep.keys, [*sweep.earlier, *(rows[k] for k in sorted(rows))])

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
            watcher.advance(before + len(rows), before + len(sweep.points))
            if (now := monotonic()) >= due:
                tabulate()
                due = now + (monotonic() - now) / TABLE_SHARE
    finally:
        if rows:
            tabulate()
    return [rows[k] for k in sorted(rows)]


def stale_rows(sweep: Sweep) -> str:
    """Drop rows whose input has changed since; returns one line on the changes, empty if none."""
    stale: dict[str, None] = {}
    count = 0
    for run in sweep.runs:
        row = finished_row(run.folder)
        if row is None or not (what := row.changes(_files(sweep, run).inputs)):
            continue
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
        if row is not None and not row.changes(files.inputs) and _is_whole(sweep, run, row):
            rows[run.number] = replace(row, number=run.number, values=run.values)
        else:
            files.write(run.folder)
            waiting[run.number] = replace(run, inputs=files.inputs)
    return rows, waiting


def _is_whole(sweep: Sweep, run: SweepRun, row: Row) -> bool:
    """Whether all is there that is read of a finished run."""
    can_be_read = (run.folder / RESULTS).exists() and row.has(sweep.wanted)
    return can_be_read or not sweep.growing or row.status != "completed"


def _files(sweep: Sweep, run: SweepRun) -> RunFiles:
    return run_files(sweep.scene, sweep.changes(run.values), run.folder)


def check_point(sweep: Sweep, values: tuple[Value, ...]) -> None:
    """Raise `InputError`, before any run, if the scene or a link file is invalid with these values.

    What needs the whole scene, or its results, is not seen.
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
            pairs = zip(sweep.variations, values, strict=True)
            what = ", ".join(f"{variation.name} = {value}" for variation, value in pairs)
            raise InputError(f"with {what}:\n{message}") from None


def claim_folder(sweep: Sweep) -> None:
    """Start or resume the folder of a sweep. Raises `InputError` for a folder of another sweep.

    One that grows is the same with whatever keys and points.
    """
    scene = str(sweep.scene.absolute())
    of_points = {"keys": sweep.keys, "points": sweep.points, "collect": sweep.collect}
    plan = json.dumps({"scene": scene, **({"growing": True} if sweep.growing else of_points)})
    path = sweep.folder / PLAN
    if path.exists() and path.read_text(encoding="utf-8", errors="replace") != plan:
        raise InputError(f"{sweep.folder}: output: expected a new folder or one of this very sweep", "another's")
    if not path.exists() and sweep.folder.exists() and any(sweep.folder.iterdir()):
        raise InputError(f"{sweep.folder}: output: expected a new folder", "one that holds other files")
    write_atomically(path, plan.encode(), "plan of the sweep", make_folder=True, ours=True)


def forget_failures(sweep: Sweep) -> int:
    """Let runs that did not complete be run again; how many they are."""
    failed = [run for run in sweep.runs if (row := finished_row(run.folder)) and row.status != "completed"]
    for run in failed:
        (run.folder / ROW).unlink()
    return len(failed)


def drop_results(sweep: Sweep) -> None:
    """Delete the results files of the runs; the table stays."""
    for run in sweep.runs:
        (run.folder / RESULTS).unlink(missing_ok=True)


SHOWN = 5  # quantities on the screen
GAP = 2  # between columns


def _write_table(path: Path, keys: Sequence[str], rows: Sequence[Row]) -> None:
    quantities = _quantities(rows)
    lines: list[list[object]] = [["run", *keys, "status", *quantities, "message"]]
    for row in rows:
        values = [row.quantities.get(name, "") for name in quantities]
        lines.append([row.number, *row.values, row.status, *values, row.message])
    write_atomically(path, as_csv(lines).encode(), "table of the sweep", ours=True)


def print_table(
    path: Path, keys: Sequence[str], rows: Sequence[Row], collected: Sequence[str], console: Console
) -> None:
    """Print keys, status and the collected or a few default quantities; the file at `path` has them all."""
    quantities = [name for name in _quantities(rows) if not name.endswith((" steps", " wall_seconds"))]
    shown = quantities[:SHOWN] if not collected else [name for name in quantities if name in collected]
    while len(shown) > 1 and sum(_width(header) + GAP for header in ("run", *keys, "status", *shown)) > console.width:
        shown = shown[:-1]
    table = Table(box=None, padding=(0, GAP, 0, 0), pad_edge=False)
    for header in ("run", *keys, "status", *shown):
        table.add_column(_broken(header), justify="left" if header == "status" else "right", min_width=_width(header))
    for row in rows:
        values = [f"{value:.6g}" if isinstance(value, float) else str(value) for value in row.values]
        cells = [f"{row.quantities[name]:.4g}" if name in row.quantities else "" for name in shown]
        table.add_row(str(row.number), *values, row.status, *cells)
    console.print(table)
    for row in rows:
        if row.status != "completed":
            console.print(f"run {row.number}: {row.status}: {row.message}", soft_wrap=True)
    more = f", with {len(quantities) - len(shown)} more quantities" if len(quantities) > len(shown) else ""
    console.print(f"table      {path}{more}", soft_wrap=True)


def _broken(header: str) -> str:
    return header.replace("/", "/\n").replace(" ", "\n")


def _width(header: str) -> int:
    return max([8, *(len(line) for line in _broken(header).splitlines())])


def _quantities(rows: Sequence[Row]) -> list[str]:
    """All that is not zero in every row: points at which a link cannot bend are no news. Of studies what they ask."""
    rows = [row for row in rows if row.wanted] or rows
    return list(dict.fromkeys(name for row in rows for name, value in row.quantities.items() if value != 0.0))
