"""`modes = "auto"` of bodies: how many modes a scene needs for its tolerance, of which more and more are tried.

The first solves are cheap: few modes leave out the high frequencies, which hold the steps down.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..common.arrays import Array
from ..mbs.model.body import Body
from ..mbs.model.truncation import loaded_points, with_fewer_modes
from ..mbs.quantities.motion import deflection
from ..mbs.quantities.supply import followed_trajectories, motor_moments, path_force
from ..scene.scene import Scene
from .bodies import LoadedBody
from .result import AnalysisResult, Errors, ModeChoice

Reported = Mapping[str, Mapping[str, Array]]
"""Quantities of an analysis by kind and name, (T, …)."""

GROWTH = 1.5  # of the number of modes from one solve to the next
ALIKE = 1e-9  # of ω²: of a round link, both planes of bending
LEAST_RATIO = 0.1  # of two differences one after the other: better ones are luck
MARGIN = 0.5  # part of the tolerance that an estimate has to meet: it may be too small
SMALLEST = 1e-3  # of the largest peak of its kind: quantities below are measured against that


def reported_modes(result: AnalysisResult) -> Reported:
    """Return the quantities (T, …) that `modes = "auto"` compares, by kind and name.

    Deflections (m), forces (N), motor torques (N·m), voltages (V). Moments on joints and paths are divided by the
    largest length of links.
    """
    run = result.run
    nodes = [node for node in run.model.tree.nodes if node.body.n_modes]
    size = max((node.body.length or 0.0 for node in nodes), default=0.0) or 1.0
    forces: dict[str, Array] = {}
    for trajectory in followed_trajectories(run):
        force, places = path_force(run, trajectory.name), len(trajectory.components)
        forces[f"trajectory {trajectory.name}"] = force[:, :places]
        forces[f"trajectory {trajectory.name}, moment"] = force[:, places:] / size
    for joint, acting in result.reactions.items():
        forces[f"joint {joint}"], forces[f"joint {joint}, moment"] = acting.force, acting.moment / size
    points = [f"{node.body.name}.{label}" for node in nodes for label in node.body.points]
    voltages = {} if result.actuation is None else result.actuation.voltages
    found_by_kind = {
        "deflections": {point: deflection(run, point) for point in points},
        "forces": {name: values for name, values in forces.items() if values.size},
        "motors": motor_moments(run),
        "voltages": {name: of.required for name, of in voltages.items()},
    }
    return {kind: quantities for kind, quantities in found_by_kind.items() if quantities}


def mode_levels(scene: Scene, bodies: Mapping[str, LoadedBody]) -> list[dict[str, Body]]:
    """Levels of the flexible bodies with a key `modes`, each with more modes where that is "auto"; the last has all.

    A level has the modes of all bodies up to one frequency: 1, 2, 3, 5, 8 … of each on average, counted in the family
    with most modes, so that both planes of bending come at once. In a planar scene all modes count. `bodies` may have
    fewer modes already.
    """
    wanted = {body.name: body.modes for body in scene.body if body.modes is not None}
    whole = {name: bodies[name].spatial.whole for name in wanted}
    loaded = {name: loaded_points(scene, name) for name in wanted}
    fixed = {
        name: with_fewer_modes(whole[name], modes, loaded[name])
        for name, modes in wanted.items()
        if isinstance(modes, int)
    }
    auto = {name: whole[name] for name, modes in wanted.items() if modes == "auto"}
    if not auto:
        return [fixed]
    counted: dict[str, list[float]] = {}  # ω² by family
    for name, body in auto.items():
        modal = bodies[name].modal
        assert modal is not None
        families = [""] * body.n_eigenmodes if scene.is_planar else modal.family  # attachment modes come after them
        for family, square in zip(families, body.stiffness[: body.n_eigenmodes], strict=False):
            counted.setdefault(family, []).append(square)
    squares, each = np.sort(max(counted.values(), key=len, default=[])), 1
    levels: list[dict[str, Body]] = []
    while each * len(auto) < len(squares):
        cut = squares[each * len(auto) - 1] * (1 + ALIKE)
        level = {
            name: with_fewer_modes(body, int(np.count_nonzero(body.stiffness <= cut)), loaded[name])
            for name, body in auto.items()
        }
        if all(body.reduction is None for body in level.values()):
            break
        levels.append(fixed | level)
        each = int(np.ceil(GROWTH * each))
    return [*levels, fixed | auto]


@dataclass
class ErrorEstimate:
    """Relative `errors` of the `last` of several solves with more and more modes, by analysis and kind of quantity.

    Where `differences` of two solves shrink by a `ratio` ρ, the last is off by ρ/(1 − ρ) times the last difference. The
    largest ratio of any kind counts for all kinds of an analysis. No error exceeds the difference.
    """

    last: Mapping[str, Reported] = field(default_factory=dict)
    differences: Errors = field(default_factory=dict)
    errors: Errors = field(default_factory=dict)
    ratio: float | None = None

    def add(self, reported: Mapping[str, Reported]) -> None:
        """Add the results of the next solve, by analysis."""
        before, self.differences = self.differences, {}
        if self.last:
            self.differences = {name: difference(of, self.last[name]) for name, of in reported.items()}
        self.last = reported
        errors: dict[str, dict[str, float]] = {}
        ratios: list[float] = []
        for name, of in self.differences.items():
            left = 1.0  # to come, of the last difference: a geometric series
            if name in before:
                ratios.append(_ratio(of, before[name]))
                ratio = max(ratios[-1], LEAST_RATIO)
                left = min(1.0, ratio / (1.0 - ratio)) if ratio < 1.0 else 1.0
            errors[name] = {kind: d * left for kind, d in of.items()}
        self.errors, self.ratio = errors, max(ratios, default=None)

    def meets(self, tolerances: Mapping[str, float]) -> bool:
        """Whether all errors, by analysis, are well within tolerance; needs at least two differences."""
        return self.ratio is not None and self._excess(tolerances) <= MARGIN

    def is_hopeless(self, tolerances: Mapping[str, float], more: int) -> bool:
        """Whether `more` further solves are not expected to meet the tolerances at the pace so far."""
        return self.ratio is not None and self._excess(tolerances) * self.ratio**more > MARGIN

    def _excess(self, tolerances: Mapping[str, float]) -> float:
        return max(max(of.values(), default=0.0) / tolerances[name] for name, of in self.errors.items())


def _ratio(now: Mapping[str, float], before: Mapping[str, float]) -> float:
    """Of two differences one after the other, the largest of all kinds."""
    return max((now[kind] / max(before[kind], 1e-300) for kind in now if now[kind] > 0.0), default=LEAST_RATIO)


def difference(now: Reported, before: Reported) -> dict[str, float]:
    """Return, by kind, the largest difference of two solves relative to the peak of the quantity in `now`."""
    errors = {}
    for kind, quantities in now.items():
        peaks = {name: np.abs(values).max(initial=0.0) for name, values in quantities.items()}
        floor = max(SMALLEST * max(peaks.values(), default=0.0), 1e-300)
        changes = [
            float(np.abs(values - before[kind][name]).max(initial=0.0) / max(peaks[name], floor))
            for name, values in quantities.items()
        ]
        errors[kind] = max(changes, default=0.0)
    return errors


class ModeSearch:
    """Search for the number of modes that keeps the error tolerance of each analysis of a scene.

    Algebraic analyses have by default the tightest tolerance of integrated ones. `bodies` have all modes, or fewer.
    """

    def __init__(self, scene: Scene, bodies: Mapping[str, LoadedBody]) -> None:
        tightest = min((analysis.tolerance for analysis in scene.analysis if analysis.is_resumable), default=None)
        self._tolerances = {
            analysis.name: tightest
            if tightest is not None and not analysis.is_resumable and "tolerance" not in analysis.model_fields_set
            else analysis.tolerance
            for analysis in scene.analysis
        }
        self._levels = mode_levels(scene, bodies)
        self._estimate, self._tried = ErrorEstimate(), list[int]()
        self.is_over = False  # whether the last solve is the one to keep
        self._level, self._completed = 0, False
        self._began = self._last = time.perf_counter()

    @property
    def bodies(self) -> Mapping[str, Body]:
        """The bodies of the next solve; after the search, those of the solve to keep."""
        return self._levels[self._level]

    def add(self, reported: Mapping[str, Reported] | None, *, last: bool) -> None:
        """Add the results, by analysis, of a solve with `bodies`; None where an analysis did not complete.

        `last`: the search ends with it in any case.
        """
        self._tried.append(sum(body.n_modes for body in self.bodies.values()))
        self._completed = reported is not None
        if reported is not None:
            self._estimate.add(reported)
        enough = self._completed and self._estimate.meets(self._tolerances)
        self.is_over = not self._more or last or enough
        if not self.is_over:
            hopeless = not self._completed or self._estimate.is_hopeless(self._tolerances, self._more - 1)
            self._level = len(self._levels) - 1 if hopeless else self._level + 1
            self._last = time.perf_counter()

    @property
    def _more(self) -> int:
        return len(self._levels) - 1 - self._level

    def choice(self) -> ModeChoice:
        """Return numbers of modes tried, the kept ones and their estimated errors."""
        errors = self._estimate.errors if self._completed else {}
        if not self._more:
            errors = {name: dict.fromkeys(of, 0.0) for name, of in errors.items()}
        kept, every = (
            max(float(np.sqrt(b.stiffness.max(initial=0.0))) for b in level.values())
            for level in (self._levels[self._level], self._levels[-1])
        )
        seconds = self._last - self._began
        return ModeChoice(errors, self._estimate.differences, tuple(self._tried), seconds, (kept, every))
