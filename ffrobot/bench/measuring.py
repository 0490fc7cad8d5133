"""One solve within a budget of time: what it took and what came out."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError, did_you_mean, quoted
from ..mbs.scene.analysis import Analysis, IntegratedAnalysis
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

# Histories whose peak is below this part of the largest of their kind are rounding: deflections at supports.
NEGLIGIBLE_PEAK = 1e-6


def histories(results: Results, analysis: str) -> dict[str, dict[str, Array]]:
    """What errors are taken of: by kind of quantity and dataset name, an array (T,) or (T, columns) each."""
    found = _datasets(results, analysis, _KIND_OF)
    if "displacement" not in found:
        found |= _datasets(results, analysis, _WITHOUT_DEFLECTION)
    return found


def _datasets(results: Results, analysis: str, kinds: Mapping[tuple[str, str], str]) -> dict[str, dict[str, Array]]:
    found: dict[str, dict[str, Array]] = {}
    for (group, dataset), kind in kinds.items():
        for member in results.names(f"{analysis}/{group}"):
            name = f"{group}/{member}/{dataset}"
            if results.has(f"{analysis}/{name}"):
                found.setdefault(kind, {})[name] = results[f"{analysis}/{name}"]
    notable: dict[str, dict[str, Array]] = {}
    for kind, datasets in found.items():
        peaks = {name: float(np.abs(values).max(initial=0.0)) for name, values in datasets.items()}
        least = NEGLIGIBLE_PEAK * max(peaks.values())
        if kept := {name: values for name, values in datasets.items() if peaks[name] > least}:
            notable[kind] = kept
    return notable


def errors(found: Mapping[str, Mapping[str, Array]], reference: Mapping[str, Mapping[str, Array]]) -> dict[str, float]:
    """By kind: the largest difference at any output of any dataset, relative to that dataset's peak in `reference`.

    Kinds that the reference does not have are left out, and datasets that only one of them has.
    """
    result = {}
    for kind, datasets in reference.items():
        common = datasets.keys() & found.get(kind, {}).keys()
        if common:
            result[kind] = max(relative(found[kind][name], datasets[name]) for name in common)
    return result


def relative(values: Array, reference: Array) -> float:
    """Largest difference over the peak of `reference`."""
    return float(np.abs(values - reference).max() / np.abs(reference).max())


UNLIMITED = 10**12  # steps: the budget ends a run


@dataclass(frozen=True)
class TimedRun:
    """What a run took and gave.

    Attributes:
        integrator: the one that ran; for "auto" the one chosen.
        status: "completed", "over budget", or how the integration failed.
        seconds: integration and outputs, of the analysis and of those whose actuation it takes.
        histories: by kind of quantity and dataset; empty unless completed.
        bodies: SHA-256 of the modal body file of each flexible body.
    """

    integrator: str
    status: str
    seconds: float
    steps: int
    rejected: int
    evaluations: int
    histories: Mapping[str, Mapping[str, Array]] = field(repr=False)
    bodies: Mapping[str, str] = field(repr=False)

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
        """Whether the time is up; it counts from the first step on."""
        return self.began is not None and time.perf_counter() - self.began > self.budget

    def advance(self, t: float, end: float) -> bool:
        """False when the time is up."""
        self.began = self.began or time.perf_counter()
        return self.display.advance(t, end) and not self.passed


def find_analysis(scene: Scene, name: str | None) -> IntegratedAnalysis:
    """The analysis of that name, or the first that integrates. Raises `InputError` where there is none."""
    integrated = [a for a in scene.analysis if isinstance(a, IntegratedAnalysis) and a.is_resumable]
    if not integrated:
        kinds = quoted(sorted({analysis.kind for analysis in scene.analysis}))
        raise InputError(
            f"{scene.path}: analysis: expected one that integrates over time, pcid or forward, found {kinds}"
        )
    for one in integrated:
        if name in (None, one.name):
            return one
    if other := next((analysis for analysis in scene.analysis if analysis.name == name), None):
        raise InputError(
            f'{scene.path}: analysis "{name}": expected one that integrates over time, pcid or forward, found'
            f' kind = "{other.kind}"'
        )
    names = [analysis.name for analysis in integrated]
    raise InputError(
        f'{scene.path}: analysis: expected one of {quoted(names)}, found "{name}"{did_you_mean(name or "", names)}'
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
    found: dict[str, dict[str, Array]] = {}
    if keep and status == "completed":
        with Results.from_image(results_image(solution), scene.path) as results:
            found = histories(results, name)
    return TimedRun(
        last.statistics.integrator.name,
        status,
        sum(each.wall_seconds for each in runs),
        sum(each.steps for each in runs),
        sum(each.rejected for each in runs),
        sum(each.evaluations for each in runs),
        found,
        {name: body.file_hash for name, body in solution.bodies.items() if body.path},
    )
