"""Run time against error: a reference, and a sweep over integrators and tolerances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import median

import numpy as np

from ..common.arrays import Array
from ..common.errors import SolveError
from ..mbs.scene.analysis import TIGHTEST_TOLERANCE
from ..run.watcher import Watcher
from ..scene.scene import Scene
from .measuring import KINDS, Run, errors, run, with_analysis

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
class Reference:
    """What errors are measured against.

    Attributes:
        error: by kind, the difference from the run with `other`: an estimate of the larger error of the two.
    """

    integrator: str
    tolerance: float
    other: str
    other_tolerance: float
    error: Mapping[str, float]
    histories: Mapping[str, Mapping[str, Array]] = field(repr=False)
    bodies: Mapping[str, str] = field(repr=False)

    def about(self) -> Row:
        """For the record."""
        keys = ("integrator", "tolerance", "other", "other_tolerance")
        return {**{key: getattr(self, key) for key in keys}, "error": dict(self.error)}


@dataclass
class Point:
    """A point of the diagram: an integrator at a tolerance, run several times."""

    integrator: str
    tolerance: float
    first: Run
    error: Mapping[str, float]
    seconds: list[float]

    def row(self) -> Row:
        """For the table."""
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


def find_reference(scene: Scene, name: str, tolerance: float, budget: float, display: Watcher) -> Reference:
    """Solve at `tolerance` with one integrator, and near it with another.

    Raises `SolveError` where fewer than two of them complete.
    """
    tolerance = max(TIGHTEST_TOLERANCE, tolerance)
    done: list[tuple[str, float, Run]] = []
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
    return Reference(integrator, at, other, other_at, error, best.histories, best.bodies)


def measure_points(
    scene: Scene,
    name: str,
    reference: Reference,
    integrators: Sequence[str],
    tolerances: Sequence[float],
    repeat: int,
    budget: float,
    display: Watcher,
) -> list[Point]:
    """Every integrator at every tolerance, `repeat` times in turn, so that a busy machine harms all of them alike.

    What does not complete is kept with its status and tried once. An integrator that took a hundred times as long as
    the best one before it is not asked for tighter tolerances.
    """
    points: list[Point] = []
    for integrator in integrators:
        for tolerance in tolerances:
            if _is_hopeless(points, integrator, tolerance):
                continue
            display.stage(f"{name}: {integrator} at {tolerance:.0e}")
            first = run(at(scene, name, integrator, tolerance), name, budget, display)
            points.append(
                Point(integrator, tolerance, first, errors(first.histories, reference.histories), [first.seconds])
            )
    for repetition in range(1, repeat):
        for point in points:
            if point.first.completed:
                display.stage(f"{name}: {point.integrator} at {point.tolerance:.0e}, repetition {repetition + 1}")
                repeat_point(scene, name, point, budget, display)
    return points


def _is_hopeless(points: Sequence[Point], integrator: str, tolerance: float) -> bool:
    """Whether an integrator was that slow at this tolerance, or a looser one, against others at the same."""
    own = [point for point in points if point.integrator == integrator and point.tolerance >= tolerance]
    return any(
        point.seconds[0]
        > HOPELESS * min((other.seconds[0] for other in points if _rivals(other, point)), default=np.inf)
        for point in own
    )


def _rivals(other: Point, point: Point) -> bool:
    return other.integrator != point.integrator and other.tolerance == point.tolerance and other.first.completed


def repeat_point(scene: Scene, name: str, point: Point, budget: float, display: Watcher) -> float:
    """Run a point once more, however long it takes this time; returns its seconds."""
    again = run(at(scene, name, point.integrator, point.tolerance), name, 10 * budget, display, keep=False)
    point.seconds.append(again.seconds)
    return again.seconds


def at(scene: Scene, name: str, integrator: str, tolerance: float) -> Scene:
    """The scene with the analysis `name` alone, integrated so."""
    return with_analysis(scene, name, integrator=integrator, tolerance=tolerance)


def fastest(points: Sequence[Point], largest: Mapping[str, float]) -> Point | None:
    """The fastest completed point whose errors are at most `largest`, by kind; None where no point is that good."""
    good = [
        point
        for point in points
        if point.first.completed and all(point.error.get(kind, 0.0) <= bound for kind, bound in largest.items())
    ]
    return min(good, key=lambda point: median(point.seconds), default=None)
