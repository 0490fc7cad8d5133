"""Designs of one scene: keys with numbers, a run for each, kept and taken up as those of sweeps, and goals by them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..common.errors import InputError, SolveError
from ..common.files import AnyPath, check_folder
from ..common.outputs import protected
from ..common.parallel import processes as of_mpi
from ..common.python_files import allowed_python, python_allowed
from ..common.tables import DEEPEST
from ..results.file import Results
from ..run.inputs import changed, digest_of_file, files_of
from ..run.watcher import Watcher
from ..sweep import Sweep, forget_failures, run_sweep
from ..sweep.runs import RESULTS, Row
from ..sweep.sweep import Key, check_point, claim_folder
from ..sweep.variation import Variation
from ..sweep.workers import Workers

Point = tuple[float, ...]
"""A value for each key."""


@dataclass(frozen=True)
class Runs:
    """How designs are run: of which scene file, in which folder, whether they are `kept` there, so many in parallel.

    `retry`: whether what failed in an earlier command is run again.
    """

    path: Path
    folder: Path
    kept: bool = True
    processes: int = 1
    retry: bool = False
    watcher: Watcher = field(default_factory=Watcher)


@contextmanager
def runs_of(
    command: str,
    scene: AnyPath,
    output: AnyPath | None,
    allow_python: Sequence[AnyPath],
    processes: int,
    retry: bool,
    watcher: Watcher | None,
) -> Iterator[Runs]:
    """Runs of a scene file in the folder `output`, or in a temporary one; no output replaces an input.

    Raises `InputError` under mpirun.
    """
    if of_mpi() > 1:
        raise InputError(f"{command}: expected one process, found several under mpirun: -j runs designs in parallel")
    path, places = Path(scene), [Path(place) for place in allow_python]
    with ExitStack() as stack:
        folder = output if output is not None else stack.enter_context(TemporaryDirectory())
        stack.enter_context(protected(files_of(path)))
        stack.enter_context(python_allowed(places))
        yield Runs(path, Path(folder), output is not None, processes, retry, watcher or Watcher())


@dataclass(frozen=True)
class Design:
    """One run: its point, its row in the table, and where its results are."""

    point: Point
    row: Row
    folder: Path

    @property
    def completed(self) -> bool:
        """Whether its results are whole."""
        return self.row.status == "completed"

    @contextmanager
    def results(self) -> Iterator[Results]:
        """To be read."""
        with Results(self.folder / RESULTS) as results:
            yield results


class Designs:
    """All designs so far of the scene of `runs`, by the values of `keys`, which the scene has `own` ones of.

    `fixed` are changes that they share.
    """

    def __init__(self, runs: Runs, keys: Sequence[Key], own: Point, fixed: Mapping[Key, Any]) -> None:
        check_folder(runs.folder)
        allowed = (runs.path.absolute().parent, *allowed_python())
        variations = tuple(Variation((key,), ()) for key in keys)
        self._sweep = Sweep(runs.path, variations, (), runs.folder, (), allowed, fixed, own, growing=True)
        self._runs, self._workers = runs, Workers()
        self._designs: dict[Path, Design] = {}
        self._inputs = _digests(runs.path)

    @property
    def table(self) -> Path | None:
        """The file with a row for every design; None where they are not kept."""
        return self._sweep.table if self._runs.kept else None

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self._designs)

    def folders(self, points: Sequence[Point], changes: Mapping[Key, Any] | None = None) -> list[Path]:
        """Of the designs at `points`, with these `changes` beside."""
        return [run.folder for run in self._lot(points, changes).runs]

    def _lot(self, points: Sequence[Point], changes: Mapping[Key, Any] | None) -> Sweep:
        return replace(self._sweep, points=tuple(points), fixed={**self._sweep.fixed, **(changes or {})})

    def problem(self, point: Point) -> str:
        """What is wrong with the scene or a link file at a point, before any run; empty where nothing is seen."""
        try:
            check_point(self._sweep, point)
        except InputError as error:
            return str(error)
        return ""

    def run_first(self, point: Point) -> Design:
        """The design at `point`. Raises `InputError` or `SolveError` where it does not complete."""
        (design,) = self.run([point])
        if not design.completed:
            error = InputError if design.row.status == "wrong input" else SolveError
            raise error(f"{self._runs.path}: {design.row.status}: {design.row.message}")
        return design

    def run(self, points: Sequence[Point], changes: Mapping[Key, Any] | None = None) -> list[Design]:
        """The designs at `points`, failed ones too, with these `changes` beside; none is run twice in one folder.

        Raises `InputError` where the scene or its files are others than at first.
        """
        claim_folder(self._sweep)
        imported = {name: one.row.inputs[name] for one in self._designs.values() for name in one.row.imported}
        now = _digests(self._sweep.scene) | {name: digest_of_file(Path(name)) for name in imported}
        if what := changed(self._inputs | imported, now):
            raise InputError(f"{self._sweep.folder}: {' and '.join(what)} changed while designs were run")
        wanted, folders = self._lot(points, changes), self.folders(points, changes)
        new = {folder: point for folder, point in zip(folders, points, strict=True) if folder not in self._designs}
        if new:
            earlier = tuple(design.row for design in self._designs.values())
            lot = replace(wanted, points=tuple(new.values()), earlier=earlier)
            if self._runs.retry:
                forget_failures(lot)
            rows = run_sweep(lot, self._runs.processes, self._runs.watcher, self._workers)
            triples = zip(new.items(), rows, strict=True)
            self._designs |= {folder: Design(point, row, folder) for (folder, point), row in triples}
        return [self._designs[folder] for folder in folders]


def _digests(path: Path) -> dict[str, str]:
    """Of the scene and the files it is made from, by their names."""
    return {str(file): digest_of_file(file) for file in files_of(path)}


def parse_key(text: str, option: str) -> Key:
    """`payload.0.mass` in parts. Raises `InputError` where that is no key."""
    parts = tuple(text.strip().split("."))
    if not all(parts) or len(parts) > DEEPEST:
        raise InputError(f'{option}: expected a key such as payload.0.mass, found "{text[:100]}"')
    return parts
