"""Run time against error: a reference, and a sweep over integrators and tolerances."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import median

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError, SolveError, check_known, did_you_mean, quoted
from ..mbs.scene.analysis import TIGHTEST_TOLERANCE, Analysis, IntegratedAnalysis
from ..results.file import Results
from ..results.write import results_image
from ..run.solve import solve_scene
from ..run.watcher import Watcher
from ..scene.scene import Scene

KINDS = ("displacement", "force", "moment", "voltage")

# Dataset of a results file, as (group, dataset), to the kind of quantity it counts as.
_KIND_OF = {
    ("points", "deflection"): "displacement",
    ("trajectories", "force"): "force",
    ("joints", "reaction"): "force",
    ("joints", "moment"): "moment",
    ("pzt", "required_voltage"): "voltage",
}
_WITHOUT_DEFLECTION = {("points", "position"): "displacement"}  # of scenes in which nothing bends

# Histories whose peak is below this part of the largest of their kind are round-off: deflections at supports.
NEGLIGIBLE_PEAK = 1e-6


def histories(results: Results, analysis: str) -> dict[str, dict[str, Array]]:
    """Return the histories whose errors are measured, by kind and dataset: arrays (T,) or (T, columns), SI units."""
    named = _datasets(results, analysis, _KIND_OF)
    if "displacement" not in named:
        named |= _datasets(results, analysis, _WITHOUT_DEFLECTION)
    return named


def _datasets(results: Results, analysis: str, kinds: Mapping[tuple[str, str], str]) -> dict[str, dict[str, Array]]:
    named: dict[str, dict[str, Array]] = {}
    for (group, dataset), kind in kinds.items():
        for member in results.names(f"{analysis}/{group}"):
            name = f"{group}/{member}/{dataset}"
            if results.has(f"{analysis}/{name}"):
                named.setdefault(kind, {})[name] = results[f"{analysis}/{name}"]
    notable: dict[str, dict[str, Array]] = {}
    for kind, datasets in named.items():
        peaks = {name: float(np.abs(values).max(initial=0.0)) for name, values in datasets.items()}
        least = NEGLIGIBLE_PEAK * max(peaks.values())
        if kept := {name: values for name, values in datasets.items() if peaks[name] > least}:
            notable[kind] = kept
    return notable


def errors(
    measured: Mapping[str, Mapping[str, Array]], reference: Mapping[str, Mapping[str, Array]]
) -> dict[str, float]:
    """Return, by kind, the largest difference at any output, relative to the peak of the same dataset in `reference`.

    Kinds that the reference does not have are left out, and datasets that only one of them has.
    """
    result = {}
    for kind, datasets in reference.items():
        common = datasets.keys() & measured.get(kind, {}).keys()
        if common:
            result[kind] = max(relative(measured[kind][name], datasets[name]) for name in common)
    return result


def relative(values: Array, reference: Array) -> float:
    """Largest difference over the peak of `reference`."""
    return float(np.abs(values - reference).max() / np.abs(reference).max())


UNLIMITED = 10**12  # steps: the budget ends a run


@dataclass(frozen=True)
class TimedRun:
    """One solve: how it ended, its cost, and its histories."""

    integrator: str  # the one that ran; for "auto" the one chosen
    status: str  # "completed", "over budget", or how the integration failed
    seconds: float  # integration and outputs, of the analysis and of those whose actuation it takes
    steps: int
    rejected: int
    evaluations: int
    # by kind of quantity and dataset; empty unless completed
    histories: Mapping[str, Mapping[str, Array]] = field(repr=False)
    bodies: Mapping[str, str] = field(repr=False)  # SHA-256 of the modal body file of each flexible body

    @property
    def completed(self) -> bool:
        """Whether it reached its end within the budget."""
        return self.status == "completed"


class Deadline(Watcher):
    """Stops a solve when its analyses have run for `budget` seconds, and shows how far it is."""

    def __init__(self, budget: float, display: Watcher) -> None:
        self.budget, self.display = budget, display
        self.began: float | None = None

    @property
    def passed(self) -> bool:
        """Whether the budget is exceeded; time counts from the first step."""
        return self.began is not None and time.perf_counter() - self.began > self.budget

    def advance(self, t: float, end: float) -> bool:
        """Return False if the budget is exceeded."""
        self.began = self.began or time.perf_counter()
        return self.display.advance(t, end) and not self.passed


def find_analysis(scene: Scene, name: str | None) -> IntegratedAnalysis:
    """The analysis of that name, or the first that integrates. Raises `InputError` where there is none."""
    integrated = [a for a in scene.analysis if isinstance(a, IntegratedAnalysis) and a.is_resumable]
    if not integrated:
        kinds = quoted(sorted({analysis.kind for analysis in scene.analysis}))
        raise InputError(f"{scene.path}: analysis: expected one that integrates over time, pcid or forward", kinds)
    for one in integrated:
        if name in (None, one.name):
            return one
    if other := next((analysis for analysis in scene.analysis if analysis.name == name), None):
        raise InputError(
            f'{scene.path}: analysis "{name}": expected one that integrates over time, pcid or forward',
            f'kind = "{other.kind}"',
        )
    names = [analysis.name for analysis in integrated]
    raise InputError(
        f"{scene.path}: analysis: expected one of {quoted(names)}", f'"{name}"{did_you_mean(name or "", names)}'
    )


def with_analysis(scene: Scene, name: str, **changes: object) -> Scene:
    """The scene with one analysis only, and the one whose actuation it takes; `changes` of keys concern both."""
    kept: list[Analysis] = []
    for analysis in reversed(scene.analysis):
        if analysis.name == name or any(later.takes_actuation and later.source == analysis.name for later in kept):
            alike = {"max_steps": UNLIMITED, **changes} if analysis.is_resumable else {}
            kept.append(analysis.model_copy(update=alike))
    return scene.model_copy(update={"analysis": tuple(reversed(kept))})


def run(scene: Scene, name: str, budget: float, display: Watcher, *, keep: bool = True) -> TimedRun:
    """Solve `scene`, which has the analysis `name` last, within `budget` (s). Histories only where `keep`.

    Raises `InputError` for anything wrong with the scene, `SolveError` where no state is found, `KeyboardInterrupt`
    after Ctrl-C.
    """
    deadline = Deadline(budget, display)
    solution = solve_scene(scene, deadline)
    outcomes = list(solution.outcomes.values())
    last = outcomes[-1]
    status, runs = last.status, [outcome.statistics for outcome in outcomes]
    if status == "interrupted":
        if not deadline.passed:
            raise KeyboardInterrupt
        status = "over budget"
    datasets: dict[str, dict[str, Array]] = {}
    if keep and status == "completed":
        with Results.from_image(results_image(solution), scene.path) as results:
            datasets = histories(results, name)
    return TimedRun(
        integrator=last.statistics.integrator.name,
        status=status,
        seconds=sum(each.wall_seconds for each in runs),
        steps=sum(each.steps for each in runs),
        rejected=sum(each.rejected for each in runs),
        evaluations=sum(each.evaluations for each in runs),
        histories=datasets,
        bodies={name: body.file_hash for name, body in solution.bodies.items() if body.path},
    )


INTEGRATORS = ("dopri5", "dop853", "radau", "generalized-alpha", "auto")
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)

# The reference is this much tighter than the tightest run, and takes at most so many budgets.
TIGHTER, PATIENCE = 1e-2, 20
# In this order, with their tolerance over that of the reference: the first that completes is the reference, the
# difference of the second is its error.
CANDIDATES = (("dop853", 1.0), ("radau", 10.0), ("dopri5", 10.0), ("dop853", 10.0))

HOPELESS = 100.0  # times as long as the best at the same tolerance

Row = dict[str, object]


@dataclass(frozen=True)
class Settings:
    """Settings: names of integrators, tolerances, repetitions, time limit of a run (s)."""

    integrators: Sequence[str]
    tolerances: Sequence[float]
    repeat: int
    budget: float

    def __post_init__(self) -> None:
        for name in self.integrators:
            check_known(name, INTEGRATORS, f"--integrators: expected some of {quoted(INTEGRATORS)}")
        for tolerance in self.tolerances:
            if not TIGHTEST_TOLERANCE <= tolerance < 1:
                raise InputError(
                    f"--tolerances: expected numbers from {TIGHTEST_TOLERANCE:g} to below 1", f"{tolerance:g}"
                )
        if not self.integrators or not self.tolerances:
            raise InputError("--integrators, --tolerances: expected one at least", "none")


@dataclass(frozen=True)
class ReferenceRun:
    """The run against which errors are measured."""

    integrator: str
    tolerance: float
    other: str
    other_tolerance: float
    # by kind, the difference from the run with `other`: an estimate of the larger error of the two
    error: Mapping[str, float]
    histories: Mapping[str, Mapping[str, Array]] = field(repr=False)
    bodies: Mapping[str, str] = field(repr=False)

    def about(self) -> Row:
        """Integrators, tolerances and errors of the reference, for the JSON record."""
        keys = ("integrator", "tolerance", "other", "other_tolerance")
        return {**{key: getattr(self, key) for key in keys}, "error": dict(self.error)}

    @property
    def in_words(self) -> str:
        """The reference and its error as text, for the title of a table."""
        error = ", ".join(f"{kind} {value:.0e}" for kind, value in self.error.items())
        other = f"which {self.other} at {self.other_tolerance:.0e} agrees with to"
        return f"against {self.integrator} at {self.tolerance:.0e}, {other}: {error}"


@dataclass
class Point:
    """A point of the diagram: an integrator at a tolerance, run several times."""

    integrator: str
    tolerance: float
    first: TimedRun
    error: Mapping[str, float]
    seconds: list[float]

    def row(self) -> Row:
        """Row of the table: integrator, tolerance, least and median run time (s), steps, errors by kind."""
        return {
            "integrator": self.integrator,
            "ran": self.first.integrator,
            "tolerance": self.tolerance,
            "status": self.first.status,
            "seconds": median(self.seconds),
            "seconds_min": min(self.seconds),
            "repetitions": len(self.seconds),
            "steps": self.first.steps,
            "rejected": self.first.rejected,
            "evaluations": self.first.evaluations,
            **{f"error_{kind}": self.error.get(kind) for kind in KINDS},
        }


def find_reference(scene: Scene, name: str, tolerance: float, budget: float, display: Watcher) -> ReferenceRun:
    """Solve at `tolerance` with one integrator, and near it with another.

    Raises `SolveError` where fewer than two of them complete.
    """
    tolerance = max(TIGHTEST_TOLERANCE, tolerance)
    done: list[tuple[str, float, TimedRun]] = []
    for integrator, looser in CANDIDATES:
        display.stage(f"reference: {integrator} at {looser * tolerance:.0e}")
        tight = with_analysis(scene, name, integrator=integrator, tolerance=looser * tolerance)
        attempt = run(tight, name, PATIENCE * budget, display)
        if attempt.completed:
            done.append((integrator, looser * tolerance, attempt))
        if len(done) == 2:
            break
    else:
        raise SolveError(
            f'{scene.path}: analysis "{name}": no reference at tolerance = {tolerance:g}: two integrators have to'
            f" finish within {PATIENCE * budget:g} s; raise --budget or leave out tight --tolerances"
        )
    (integrator, at, best), (other, other_at, second) = done
    error = errors(second.histories, best.histories)
    return ReferenceRun(integrator, at, other, other_at, error, histories=best.histories, bodies=best.bodies)


def measure_points(
    scene: Scene, name: str, reference: ReferenceRun, settings: Settings, display: Watcher
) -> list[Point]:
    """Time every integrator at every tolerance, repetitions in turn, so that disturbances affect all equally.

    What does not complete is kept with its status and tried once. An integrator that took a hundred times as long as
    the best one before it is not asked for tighter tolerances.
    """
    points: list[Point] = []
    for integrator in settings.integrators:
        for tolerance in settings.tolerances:
            if _is_hopeless(points, integrator, tolerance):
                continue
            display.stage(f"{name}: {integrator} at {tolerance:.0e}")
            first = run(at(scene, name, integrator, tolerance), name, settings.budget, display)
            points.append(
                Point(integrator, tolerance, first, errors(first.histories, reference.histories), [first.seconds])
            )
    for repetition in range(1, settings.repeat):
        for point in points:
            if point.first.completed:
                display.stage(f"{name}: {point.integrator} at {point.tolerance:.0e}, repetition {repetition + 1}")
                repeat_point(scene, name, point, settings.budget, display)
    return points


def _is_hopeless(points: Sequence[Point], integrator: str, tolerance: float) -> bool:
    for point in (one for one in points if one.integrator == integrator and one.tolerance >= tolerance):
        alike = [one for one in points if one.tolerance == point.tolerance and one.first.completed]
        rivals = [one.seconds[0] for one in alike if one.integrator != integrator]
        if point.seconds[0] > HOPELESS * min(rivals, default=np.inf):
            return True
    return False


def repeat_point(scene: Scene, name: str, point: Point, budget: float, display: Watcher) -> float:
    """Run a point once more, however long it takes this time; returns its seconds."""
    again = run(at(scene, name, point.integrator, point.tolerance), name, 10 * budget, display, keep=False)
    point.seconds.append(again.seconds)
    return again.seconds


def at(scene: Scene, name: str, integrator: str, tolerance: float) -> Scene:
    """The scene with the analysis `name` alone, integrated so."""
    return with_analysis(scene, name, integrator=integrator, tolerance=tolerance)
