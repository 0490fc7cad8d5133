"""Designs of one scene: values of keys, a run for each (stored and reused as in sweeps), and its responses."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from dataclasses import field, replace
from math import ceil
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ..batch.batch import Batch, batch_of
from ..common.errors import InputError, SolveError
from ..common.files import AnyPath, check_folder
from ..common.outputs import protected
from ..common.parallel import processes as of_mpi
from ..common.python_files import allowed_python, python_allowed
from ..common.structs import struct
from ..common.tables import DEEPEST
from ..mbs.fields.field_types import DATASET
from ..mbs.scene.analysis import IntegratedAnalysis, TimedAnalysis
from ..mbs.tracking.tracking import Tracking
from ..results.file import Results
from ..run.inputs import changed, digest_of_file, files_of
from ..run.watcher import Watcher
from ..scene.load import load_scene
from ..sweep.files import Variation, run_files
from ..sweep.runs import RESULTS, Row
from ..sweep.sweep import Key, Sweep, check_point, claim_folder, forget_failures, number, run_sweep
from .readings import Reading, Response

OUTPUTS = 1000  # at least, if responses depend on histories
ALGEBRAIC = ("static", "pcid")
"""Kinds of analysis that, without time steps, solve equations to round-off at every time."""


def changes_for(
    path: Path, responses: Sequence[Response], tolerance: float | None, *, keep_steps: bool = False
) -> dict[Key, Any]:
    """Return changes of the scene at `path`: only analyses that `responses` need, with `tolerance` (None: own) or less.

    Responses need the analysis that they name, by default the first, and its sources. Checks of inverse analyses are
    omitted; outputs are at least `OUTPUTS`. `keep_steps`: whether results contain the time steps.
    """
    scene = load_scene(path)
    names = [one.name for one in scene.analysis]
    moving = next((one.name for one in scene.analysis if isinstance(one, TimedAnalysis)), names[0])
    needed = {
        one.analysis if one.analysis in names else moving if one.is_of_rest else names[0] for one in responses
    } or {names[0]}
    for record in reversed(scene.analysis):  # each rests on earlier ones only
        if record.name in needed and record.source is not None:
            needed.add(record.source)
    whole = run_files(path, {}, path.parent).scene["analysis"]
    tables = [table for table in whole if table["name"] in needed]
    for table, record in zip(tables, (one for one in scene.analysis if one.name in needed), strict=True):
        table.pop("check", None)
        if tolerance is not None and not isinstance(record, Tracking):  # whose tolerance chooses a mesh
            table["tolerance"] = min(tolerance, record.tolerance)
        if keep_steps and record.is_integrated and isinstance(record, IntegratedAnalysis):
            table["keep_steps"] = True
        if isinstance(record, TimedAnalysis) and any(response.needs_motion for response in responses):
            table["output_step"] = record.output_step / ceil(OUTPUTS * record.output_step / record.end * (1 - 1e-9))
    return {("analysis",): tables}


def may_repeat(keys: Sequence[Key]) -> bool:
    """Whether runs with other values of `keys` can reuse time steps; keys of analyses change them."""
    return not any(key[0] == "analysis" for key in keys)


def repeated_steps(results: Results) -> dict[Key, Any] | None:
    """Return changes of a scene with which its integrations reuse the time steps of the run with these `results`.

    None if an analysis cannot; no changes if none is integrated.
    """
    about = {name: results.attributes(name) for name in results.analyses}
    stepping = [name for name in about if about[name]["steps"]]
    repeated = all(results.has(f"{name}/{DATASET}") for name in stepping)
    smooth = all(about[name]["kind"] in ALGEBRAIC for name in about if name not in stepping)
    if not (repeated and smooth):
        return None
    return {("analysis", name, "repeat_steps"): str(results.path.absolute()) for name in stepping}


Point = tuple[float, ...]
"""A value for each key, or a coordinate of the unit cube for each variable."""


def moved(point: Point, k: int, value: float) -> Point:
    """Return `point` with entry k replaced by `value`."""
    return (*point[:k], value, *point[k + 1 :])


def in_words(keys: Iterable[Key], point: Point) -> str:
    """Return the values of the keys as text: `payload.0.mass = 0.5, …`."""
    return ", ".join(f"{'.'.join(key)} = {number(value)}" for key, value in zip(keys, point, strict=True))


@struct
class Runs:
    """Settings of the runs of designs: scene file, folder (`kept` or temporary), the batch that performs them.

    `retry`: whether to repeat designs that failed before. `watcher` observes progress and can stop the runs.
    """

    path: Path
    folder: Path
    batch: Batch
    kept: bool = True
    retry: bool = False
    watcher: Watcher = field(default_factory=Watcher)


@contextmanager
def runs_of(
    scene: AnyPath,
    output: AnyPath | None,
    *,
    processes: int = 1,
    executor: Executor | Batch | None = None,
    retry: bool = False,
    allow_python: Sequence[AnyPath] = (),
    watcher: Watcher | None = None,
) -> Iterator[Runs]:
    """Context with `Runs` of a scene file in the folder `output`, or a temporary one; inputs cannot be overwritten.

    `executor` performs the runs, else `processes` on this machine. `allow_python`: files and folders whose Python
    files scenes may run. Raises `InputError` under mpirun without `executor`.
    """
    if executor is None and of_mpi() > 1:
        raise InputError("executor: expected one under mpirun, as of mpi4py.futures.MPICommExecutor", "none")
    path = Path(scene)
    with ExitStack() as stack:
        folder = output if output is not None else stack.enter_context(TemporaryDirectory())
        stack.enter_context(protected(files_of(path)))
        stack.enter_context(python_allowed([Path(place) for place in allow_python]))
        if executor is None:
            executor = stack.enter_context(batch_of(processes))
        batch = executor if isinstance(executor, Batch) else stack.enter_context(Batch(lambda: executor))
        yield Runs(path, Path(folder), batch, output is not None, retry, watcher or Watcher())


@struct
class Design:
    """One run: its row in the table, the folder of its results, and the names `asked` of datasets read so far."""

    row: Row
    folder: Path
    asked: set[str]

    @property
    def point(self) -> Point:
        """Values of the keys."""
        return self.row.values

    @property
    def completed(self) -> bool:
        """Whether its results are complete."""
        return self.row.status == "completed"

    @property
    def failure(self) -> str:
        """Reason why its results are incomplete; empty if they are complete."""
        return "" if self.completed else f"{self.row.status}: {self.row.message}"

    def results(self) -> Results:
        """Open the results file of the run, for use in a `with`."""
        results = Results(self.folder / RESULTS)
        results.asked = self.asked
        return results

    def read(self, responses: Iterable[Response]) -> tuple[Reading, ...]:
        """Return responses of a completed design. Raises `InputError` if its results lack them."""
        with self.results() as results:
            return tuple(response.read(results) for response in responses)

    def follow(self, responses: Sequence[Response], readings: Sequence[Reading]) -> tuple[Reading, ...]:
        """Return responses at the time, column or mode of another design's `readings`; empty if the run failed."""
        if not self.completed:
            return ()
        with self.results() as results:
            return tuple(response.follow(results, one) for response, one in zip(responses, readings, strict=True))


class SpentError(Exception):
    """The allowed number of designs has been run."""


class Designs:
    """All designs so far of the scene of `runs`, by values of `keys`; `own`: the values in the scene itself.

    `fixed`: changes of the scene in all designs. `most`: largest number of designs.
    """

    def __init__(
        self, runs: Runs, keys: Sequence[Key], own: Point, fixed: Mapping[Key, Any], most: float = np.inf
    ) -> None:
        check_folder(runs.folder)
        allowed = (runs.path.absolute().parent, *allowed_python())
        variations = tuple(Variation((key,), ()) for key in keys)
        self._sweep = Sweep(
            runs.path, variations, (), runs.folder, allow_python=allowed, fixed=fixed, own=own, growing=True
        )
        self._runs, self.most = runs, most
        self._designs: dict[Path, Design] = {}
        self._inputs = _digests(runs.path)
        self._asked = set[str]()

    @property
    def table(self) -> Path | None:
        """The file with a row for every design; None where they are not kept."""
        return self._sweep.table if self._runs.kept else None

    @property
    def count(self) -> int:
        """Number of designs run so far."""
        return len(self._designs)

    @property
    def failures(self) -> dict[Point, str]:
        """Messages of failed designs by their points."""
        return {one.point: one.failure for one in self._designs.values() if not one.completed}

    def problem(self, *points: Point) -> str:
        """Return an input error, found without a run, if all `points` have one; "" otherwise."""
        text = ""
        for point in points:
            try:
                check_point(self._sweep, point)
                return ""
            except InputError as error:
                text = str(error)
        return text

    def run_first(self, point: Point) -> Design:
        """Run the design at `point`. Raises `InputError` or `SolveError` if it does not complete."""
        (design,) = self.run([point])
        if not design.completed:
            error = InputError if design.row.status == "wrong input" else SolveError
            raise error(f"{self._runs.path}: {design.failure}")
        return design

    def run(self, points: Sequence[Point], changes: Mapping[Key, Any] | None = None) -> list[Design]:
        """Return designs at `points` with `changes` in addition, failed ones included; each is run once.

        Later results contain only datasets that were read from the first ones. Raises `InputError` if the scene or
        its files have changed since, `SpentError` for too many designs.
        """
        claim_folder(self._sweep)
        imported = {name: one.row.inputs[name] for one in self._designs.values() for name in one.row.imported}
        now = _digests(self._sweep.scene) | {name: digest_of_file(Path(name)) for name in imported}
        if what := changed(self._inputs | imported, now):
            raise InputError(f"{self._sweep.folder}: {' and '.join(what)} changed while designs were run")
        wanted = replace(self._sweep, points=tuple(points), fixed={**self._sweep.fixed, **(changes or {})})
        folders = [run.folder for run in wanted.runs]
        new = {folder: point for folder, point in zip(folders, points, strict=True) if folder not in self._designs}
        if len(new) > self.most - self.count:
            raise SpentError(f"ended after {self.count} runs, as many as were allowed")
        if new:
            earlier = tuple(design.row for design in self._designs.values())
            lot = replace(wanted, points=tuple(new.values()), earlier=earlier, wanted=tuple(sorted(self._asked)))
            if self._runs.retry:
                forget_failures(lot)
            for folder, row in zip(new, run_sweep(lot, self._runs.batch, self._runs.watcher), strict=True):
                self._designs[folder] = Design(row, folder, self._asked)
        return [self._designs[folder] for folder in folders]

    def whole(self, design: Design) -> Design:
        """Return a completed design with all results; solved again if it has only some datasets."""
        if not design.row.wanted:
            return design
        earlier = tuple(one.row for one in self._designs.values() if one is not design)
        lot = replace(self._sweep, points=(design.point,), earlier=earlier)
        (row,) = run_sweep(lot, self._runs.batch, self._runs.watcher)
        return replace(design, row=row)


def _digests(path: Path) -> dict[str, str]:
    return {str(file): digest_of_file(file) for file in files_of(path)}


def parse_key(text: str, option: str) -> Key:
    """Return the parts of a key such as `payload.0.mass`. Raises `InputError` on `option` for other text."""
    parts = tuple(text.strip().split("."))
    if not all(parts) or len(parts) > DEEPEST:
        raise InputError(f"{option}: expected a key such as payload.0.mass", f'"{text[:100]}"')
    return parts
