"""Run time against error: a reference, and a sweep over integrators and tolerances; where errors come from."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil
from statistics import median
from typing import Any

import numpy as np

from ..common.arrays import Array
from ..common.errors import FfrobotError, InputError, SolveError, check_known, quoted
from ..common.structs import struct
from ..fe_models.link_source import LinkTable, link_keys, link_path
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
    ("points", "position"): "position",  # displacement where nothing bends
}
NEGLIGIBLE_PEAK = 1e-6  # of the largest of a kind: below is round-off, such as deflections at supports

Histories = Mapping[str, Mapping[str, Array]]
"""By kind of quantity and dataset: arrays (T,) or (T, columns), SI units."""


def _histories(results: Results, analysis: str) -> Histories:
    kinds: dict[str, dict[str, Array]] = {}
    for (group, dataset), kind in _KIND_OF.items():
        for member in results.names(f"{analysis}/{group}"):
            name = f"{group}/{member}/{dataset}"
            if results.has(f"{analysis}/{name}"):
                kinds.setdefault(kind, {})[name] = results[f"{analysis}/{name}"]
    for datasets in kinds.values():
        peaks = {name: float(np.abs(values).max(initial=0.0)) for name, values in datasets.items()}
        for name, peak in peaks.items():
            if peak <= NEGLIGIBLE_PEAK * max(peaks.values()):
                del datasets[name]
    position = kinds.pop("position", {})
    kinds["displacement"] = kinds.get("displacement") or position
    return {kind: datasets for kind, datasets in kinds.items() if datasets}


def errors(measured: Histories, reference: Histories) -> dict[str, float]:
    """By kind of quantity, the largest difference at any output, relative to the peak of its dataset in `reference`.

    Kinds and datasets that only one of them has are omitted.
    """
    result = {}
    for kind, datasets in reference.items():
        if common := datasets.keys() & measured.get(kind, {}).keys():
            result[kind] = max(relative(measured[kind][name], datasets[name]) for name in common)
    return result


def error_columns(error: Mapping[str, float]) -> dict[str, float | None]:
    """Entries "error_KIND" of a row of a table; None for kinds without error."""
    return {f"error_{kind}": error.get(kind) for kind in KINDS}


def relative(values: Array, reference: Array) -> float:
    """Return the largest difference of histories (T, …), any unit, over the peak of `reference`, dimensionless."""
    return float(np.abs(values - reference).max() / np.abs(reference).max())


COUNTS = ("steps", "rejected", "evaluations")


@struct
class TimedRun:
    """One solve: how it ended, its cost, and its histories, which are empty unless it completed."""

    integrator: str  # the one that ran; for "auto" the one chosen
    status: str  # "completed", "over budget", "refused", or how the integration failed
    seconds: float = 0.0  # integration and outputs, of the analysis and of those whose actuation it takes
    counts: Mapping[str, int] = field(default_factory=dict)  # `COUNTS` of these analyses
    histories: Histories = field(default_factory=dict, repr=False)
    bodies: Mapping[str, str] = field(default_factory=dict, repr=False)  # SHA-256 of modal body files by flexible body
    why: str | None = None  # reason for "refused"

    @property
    def completed(self) -> bool:
        """Whether it reached its end within the budget."""
        return self.status == "completed"


class _Deadline(Watcher):
    """Stops a solve when its analyses have run for `budget` seconds from their first step; `passed` says so."""

    def __init__(self, budget: float, display: Watcher) -> None:
        self.budget, self.display, self.passed = budget, display, False
        self.began: float | None = None

    def advance(self, t: float, end: float) -> bool:
        self.began = self.began or time.perf_counter()
        self.passed = time.perf_counter() - self.began > self.budget
        return self.display.advance(t, end) and not self.passed


def find_analysis(scene: Scene, name: str | None) -> IntegratedAnalysis:
    """The analysis `name`, by default the first that integrates over time. Raises `InputError` without one."""
    integrated = [a for a in scene.analysis if isinstance(a, IntegratedAnalysis) and a.is_resumable]
    wanted = "expected one that integrates over time, pcid or forward"
    if not integrated:
        kinds = quoted(sorted({analysis.kind for analysis in scene.analysis}))
        raise InputError(f"{scene.path}: analysis: {wanted}", kinds)
    by_name = {analysis.name: analysis for analysis in integrated}
    chosen = integrated[0].name if name is None else name
    if other := next((one for one in scene.analysis if one.name == chosen not in by_name), None):
        raise InputError(f'{scene.path}: analysis "{name}": {wanted}', f'kind = "{other.kind}"')
    check_known(chosen, by_name, f"{scene.path}: analysis: expected one of {quoted(by_name)}")
    return by_name[chosen]


def with_analysis(scene: Scene, name: str, **changes: object) -> Scene:
    """The scene with the analysis `name` alone and those whose actuation it takes, with `changes` of their keys."""
    kept: list[Analysis] = []
    for analysis in reversed(scene.analysis):
        if analysis.name == name or any(later.takes_actuation and later.source == analysis.name for later in kept):
            alike = {"max_steps": 10**12, **changes} if analysis.is_resumable else {}  # the budget ends a run
            kept.append(analysis.model_copy(update=alike))
    return scene.model_copy(update={"analysis": tuple(reversed(kept))})


def run(scene: Scene, name: str, budget: float, display: Watcher, *, keep: bool = True) -> TimedRun:
    """Solve `scene`, whose last analysis is `name`, within `budget` (s). `keep`: return histories, too.

    Raises `InputError` for anything wrong with the scene, `SolveError` where no state is found, `KeyboardInterrupt`
    after Ctrl-C.
    """
    deadline = _Deadline(budget, display)
    solution = solve_scene(scene, deadline)
    runs = [outcome.statistics for outcome in solution.outcomes.values()]
    status = runs[-1].status
    if status == "interrupted":
        if not deadline.passed:
            raise KeyboardInterrupt
        status = "over budget"
    datasets: Histories = {}
    if keep and status == "completed":
        with Results.from_image(results_image(solution), scene.path) as results:
            datasets = _histories(results, name)
    return TimedRun(
        integrator=runs[-1].integrator.name,
        status=status,
        seconds=sum(each.wall_seconds for each in runs),
        counts={key: sum(getattr(each, key) for each in runs) for key in COUNTS},
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


@struct
class Settings:
    """Repetitions of a run, its time limit `budget` (s), names of integrators, tolerances."""

    repeat: int
    budget: float
    integrators: Sequence[str] = INTEGRATORS
    tolerances: Sequence[float] = TOLERANCES

    def __post_init__(self) -> None:
        for name in self.integrators:
            check_known(name, INTEGRATORS, f"--integrators: expected some of {quoted(INTEGRATORS)}")
        for tolerance in self.tolerances:
            if not TIGHTEST_TOLERANCE <= tolerance < 1:
                raise InputError(
                    f"--tolerances: expected numbers from {TIGHTEST_TOLERANCE:g} to below 1", f"{tolerance:g}"
                )


@struct
class ReferenceRun:
    """The run against which errors are measured, and an `other` one, whose difference from it is its `error`.

    `histories`: its motions, forces and torques; `bodies`: hash of each body's modal file, by name.
    """

    integrator: str
    tolerance: float
    other: str
    other_tolerance: float
    # by kind, relative to peaks: an estimate of the larger error of the two
    error: Mapping[str, float]
    histories: Histories = field(repr=False)
    bodies: Mapping[str, str] = field(repr=False)

    def about(self) -> Row:
        """Integrators, tolerances and errors of the reference, for the JSON record."""
        return {key: value for key, value in vars(self).items() if key not in ("histories", "bodies")}

    @property
    def in_words(self) -> str:
        """Reference and error as text, for the title of a table."""
        error = ", ".join(f"{kind} {value:.0e}" for kind, value in self.error.items())
        other = f"which {self.other} at {self.other_tolerance:.0e} agrees with to"
        return f"against {self.integrator} at {self.tolerance:.0e}, {other}: {error}"


@dataclass
class Point:
    """A point of the diagram: integrator, tolerance, `first` run, `seconds` of each run, `error` by kind over peaks."""

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
            **self.first.counts,
            **error_columns(self.error),
        }


def find_reference(scene: Scene, name: str, tolerance: float, budget: float, display: Watcher) -> ReferenceRun:
    """Solve at `tolerance` with one integrator, and near it with another.

    Raises `SolveError` where fewer than two complete within a multiple of `budget` (s).
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
    (_, _, best), (_, _, second) = done
    error = errors(second.histories, best.histories)
    return ReferenceRun(*done[0][:2], *done[1][:2], error, histories=best.histories, bodies=best.bodies)


def measure_points(
    scene: Scene, name: str, reference: ReferenceRun, settings: Settings, display: Watcher
) -> list[Point]:
    """Time every integrator at every tolerance, repetitions in turn, so that disturbances affect all equally.

    Runs that do not complete are not repeated. An integrator that took a hundred times as long as the best of the
    others is not run at tighter tolerances.
    """
    points: list[Point] = []
    for integrator in settings.integrators:
        for tolerance in settings.tolerances:
            if _is_hopeless(points, integrator, tolerance):
                continue
            display.stage(f"{name}: {integrator} at {tolerance:.0e}")
            timed = with_analysis(scene, name, integrator=integrator, tolerance=tolerance)
            first = run(timed, name, settings.budget, display)
            error = errors(first.histories, reference.histories)
            points.append(Point(integrator, tolerance, first, error, [first.seconds]))
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
    """Run a point once more, within ten times the `budget` (s); returns its run time, s."""
    timed = with_analysis(scene, name, integrator=point.integrator, tolerance=point.tolerance)
    again = run(timed, name, 10 * budget, display, keep=False)
    point.seconds.append(again.seconds)
    return again.seconds


Keys = dict[str, Any]


def _refined(scene: Scene, elements: float, modes: float) -> Scene | None:
    """The scene with `elements` and `modes` times as many of them in every link that is given by its link file.

    None where neither changes anything: no link files, or none with such keys.
    """
    changed = False
    bodies = []
    for body in scene.body:
        if body.link is not None:
            keys = link_keys(body.link)
            changed |= elements != 1 and _scale_mesh(keys, elements)
            changed |= modes != 1 and _scale_modes(keys, modes)
            body = body.model_copy(update={"link": LinkTable(keys, link_path(body.link))})
        bodies.append(body)
    update: Keys = {"body": tuple(bodies)}
    if modes != 1:  # patches that fit the modes of the scene need not fit others; where they do, nothing changes
        any_number = {"allocation": "least-squares", "mode_weights": None}
        update["pzt"] = tuple(layout.model_copy(update=any_number) for layout in scene.pzt)
    return scene.model_copy(update=update) if changed else None


def _sizes(scene: Scene) -> dict[str, str]:
    """Numbers of elements and modes in the link files: "20", or "20, 40" where they differ."""
    links = [link_keys(body.link) for body in scene.body if body.link is not None]
    meshes = (item for keys in links for item in keys.get("mesh", {}).items())
    elements = [str(value) for key, value in meshes if key not in ("cell", "order")]
    modes = [str(keys.get("modes", {}).get("count", "")) for keys in links]
    return {"elements": ", ".join(dict.fromkeys(elements)), "modes": ", ".join(dict.fromkeys(modes))}


def _scale_mesh(keys: Keys, factor: float) -> bool:
    """Whether the mesh table has what can be scaled: elements of a beam, size or divisions of a solid."""
    mesh = keys.get("mesh", {})
    if isinstance(mesh.get("elements"), int):
        mesh["elements"] = ceil(factor * mesh["elements"])
    elif "size" in mesh:
        mesh["size"] /= factor
    elif "divisions" in mesh:
        mesh["divisions"] = [ceil(factor * count) for count in mesh["divisions"]]
    else:
        return False
    return True


def _scale_modes(keys: Keys, factor: float) -> bool:
    """Whether there is a number of modes to scale, and damping that fits any number."""
    modes = keys.get("modes", {})
    if not isinstance(modes.get("count"), int) or isinstance(keys.get("damping", {}).get("ratio"), list):
        return False
    modes["count"] = ceil(factor * modes["count"])
    return True


# Times the elements and the modes of the link files; the last of each stands for the exact solution.
ELEMENTS, MODES = (0.5, 1.0, 2.0, 4.0), (0.5, 1.0, 1.5, 2.0)
UNSEEN = 0.1  # of the scene's tolerance, where time integration must not be seen


def measure_axes(scene: Scene, analysis: IntegratedAnalysis, budget: float, display: Watcher) -> list[Row]:
    """Rows of errors along each axis; runs that fail, or take longer than `budget` (s), stay as rows without errors.

    "mesh" compares with four times the elements, "modes" with twice the modes, on that mesh, "time" with a tenth of the
    tolerance (time integration alone), "total" the scene as it is with all three: at most the sum of the others. Axes
    that the link files cannot vary are left out: scenes of rigid or ready-made modal bodies have "time" alone.
    """
    tight = max(TIGHTEST_TOLERANCE, UNSEEN * analysis.tolerance)
    rows: list[Row] = []
    trial = _Trials(scene, analysis.name, budget, display)
    fine = ELEMENTS[-1] if trial(ELEMENTS[-1], 1.0, tight) else 1.0
    axes = {"mesh": [(f, 1.0) for f in ELEMENTS], "modes": [(fine, f) for f in MODES]}
    for axis, factors in axes.items():
        if best := trial(*factors[-1], tight):
            rows += [trial.row(axis, *factor, tight, best) for factor in factors[:-1]]
    rows.append(trial.row("time", 1.0, 1.0, analysis.tolerance, trial(1.0, 1.0, tight)))
    if everything := trial(fine, MODES[-1], tight):
        rows.append(trial.row("total", 1.0, 1.0, analysis.tolerance, everything))
    return rows


class _Trials:
    """Runs of one analysis with links refined; each combination once."""

    def __init__(self, scene: Scene, name: str, budget: float, display: Watcher) -> None:
        self.scene, self.name, self.budget, self.display = scene, name, budget, display
        self.done: dict[tuple[float, float, float], TimedRun] = {}

    def __call__(self, elements: float, modes: float, tolerance: float) -> TimedRun | None:
        """The run; None where the link files do not let elements or modes change."""
        key = (elements, modes, tolerance)
        if key not in self.done:
            if (scene := self._scene(elements, modes)) is None:
                return None
            self.display.stage(f"{elements:g} × elements, {modes:g} × modes, tolerance {tolerance:.0e}")
            try:
                timed = run(with_analysis(scene, self.name, tolerance=tolerance), self.name, self.budget, self.display)
            except FfrobotError as error:  # such as more modes than half the mesh has
                timed = TimedRun("", "refused", why=str(error).splitlines()[0])
            self.done[key] = timed
        return self.done[key]

    def row(self, axis: str, elements: float, modes: float, tolerance: float, best: TimedRun | None) -> Row:
        timed, scene = self(elements, modes, tolerance), self._scene(elements, modes)
        assert timed is not None
        assert scene is not None
        assert best is not None
        return {
            "axis": axis,
            "times": modes if axis == "modes" else elements,
            **_sizes(scene),
            "tolerance": tolerance,
            "status": timed.status,
            "against": best.status,
            "why": timed.why or best.why,
            "integrator": timed.integrator or None,
            "seconds": timed.seconds or None,
            **error_columns(errors(timed.histories, best.histories)),
        }

    def _scene(self, elements: float, modes: float) -> Scene | None:
        return self.scene if elements == modes == 1.0 else _refined(self.scene, elements, modes)
