"""Ratios to the two-link case written by hand, in one run on one core."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median

from ffrobot.bench.precision import KINDS, Point, Row, Settings, find_reference, measure_points, repeat_point
from ffrobot.run.solve import prepare_scene
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import make_scene
from ffrobot.scene.scene import Scene

from .hand_written import TIME, HandWritten, State, evaluation_seconds, general_state, ratios

ACCURACY = 1e-4
INTEGRATORS = ("auto", "dop853", "radau")
TOLERANCES = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5)
REFERENCE_TOLERANCE = 1e-8
EVALUATIONS, ROUNDS = 2_000, 30  # a millisecond in one go: many of them are undisturbed

NAME, OUTPUT_STEP = "inverse", 0.01
_SHARE = "1 + (cos(pi/4) - 1)*(10*t**3 - 15*t**4 + 6*t**5)"  # of the way: the ends of the paper's path, at rest there
QUINTIC = {"x": f"1.5*({_SHARE})", "y": f"sqrt(3)/2*({_SHARE})"}


def fastest(points: Sequence[Point], largest: Mapping[str, float]) -> Point | None:
    """The fastest completed point whose errors are at most `largest`, by kind; None where no point is that good."""
    good = [
        point
        for point in points
        if point.first.completed and all(point.error.get(kind, 0.0) <= bound for kind, bound in largest.items())
    ]
    return min(good, key=lambda point: median(point.seconds), default=None)


@dataclass(frozen=True)
class Aim:
    """A second of the two-link case: its start and path, what has to be within 1e-4, and the ratio wanted."""

    title: str
    state: str
    within: Sequence[str]
    ratio: float
    path: Mapping[str, str] = field(default_factory=dict)


AIMS = (
    Aim("undeformed start, paper's path: forces", "undeformed", ("force",), 1.6),
    Aim("static start, quintic path: moments and deflections", "static", ("moment", "displacement"), 0.25, QUINTIC),
    Aim("static start, paper's path: deflections", "static", ("displacement",), 1 / 3),
)


def measure_aims(
    scene: Scene, repository: Path, folder: Path, repeat: int, budget: float, display: Watcher
) -> list[Row]:
    """Rows of the right-hand side and of each aim; `scene` is cases/two_link, `repository` the source tree.

    Raises `InputError` or `SolveError` where the hand-written program is not to be had.
    """
    model = prepare_scene(scene, display).model
    display.stage("compiling the hand-written version")
    hand_written = HandWritten(repository, model, folder)
    rows = [_right_hand_side(hand_written, general_state(model), display)]
    for aim in AIMS:
        rows += _rows(aim, _scene(scene, aim), hand_written, repeat, budget, display)
    return rows


def _right_hand_side(hand_written: HandWritten, state: State, display: Watcher) -> Row:
    display.stage("right-hand side")
    pairs = [
        (evaluation_seconds(state, TIME, EVALUATIONS), hand_written.evaluation_seconds(EVALUATIONS))
        for _ in range(ROUNDS)
    ]
    return {"what": "right-hand side", "within": "", "run": "joint coordinates", **_ratio(pairs, 1.6)}


def _scene(scene: Scene, aim: Aim) -> Scene:
    keys = tomllib.loads(scene.text)
    keys.pop("pzt", None)
    keys["initial"]["state"] = aim.state
    keys["trajectory"][0] |= aim.path
    keys["analysis"] = [{"name": NAME, "kind": "pcid", "end": 1.0, "output_step": OUTPUT_STEP}]
    return make_scene(folder=scene.path.parent, **keys)


def _rows(aim: Aim, scene: Scene, hand_written: HandWritten, repeat: int, budget: float, display: Watcher) -> list[Row]:
    """The run that a user gets who asks for 1e-4, and the fastest of all whose measured error is that small."""
    reference = find_reference(scene, NAME, REFERENCE_TOLERANCE, budget, display)
    points = measure_points(scene, NAME, reference, Settings(2, budget, INTEGRATORS, TOLERANCES), display)
    asked = next(point for point in points if (point.integrator, point.tolerance) == ("auto", ACCURACY))
    chosen = {"requested 1e-4": asked, "fastest within 1e-4": fastest(points, dict.fromkeys(aim.within, ACCURACY))}
    pairs: dict[str, list[tuple[float, float]]] = {label: [] for label in chosen}
    for repetition in range(repeat):
        display.stage(f"{aim.title}: repetition {repetition + 1} of {repeat}")
        by_hand = hand_written.pcid_seconds()
        for label, point in chosen.items():
            if point is not None and point.first.completed:
                pairs[label].append((repeat_point(scene, NAME, point, budget, display), by_hand))
    return [_row(aim, label, point, pairs[label]) for label, point in chosen.items()]


def _row(aim: Aim, label: str, point: Point | None, pairs: Sequence[tuple[float, float]]) -> Row:
    row: Row = {"what": aim.title, "within": ", ".join(aim.within), "run": label}
    if point is None or not pairs:
        return row | {"aim": aim.ratio, "status": "none" if point is None else point.first.status}
    accurate = all(point.error.get(kind, 0.0) <= ACCURACY for kind in aim.within)
    return (
        row
        | _ratio(pairs, aim.ratio)
        | {"accurate": accurate, "integrator": point.first.integrator, "tolerance": point.tolerance}
        | {f"error_{kind}": point.error.get(kind) for kind in KINDS if kind in point.error}
    )


def _ratio(pairs: Sequence[tuple[float, float]], aim: float) -> Row:
    """Medians of interleaved repetitions, (general, by hand) in s; ratio of the minima, and median of ratios."""
    general, by_hand = zip(*pairs, strict=True)
    of_minima, of_neighbours = ratios(general, by_hand)
    return {
        "seconds": median(general),
        "hand_written": median(by_hand),
        "ratio": of_minima,
        "ratio_median": of_neighbours,
        "aim": aim,
        "repetitions": len(pairs),
        "status": "completed",
    }
