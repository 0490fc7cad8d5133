"""Times of one evaluation of all accelerations and multipliers in joint coordinates, in the plane and in space.

All are measured in turn, in one run, beside the two-link case written by hand. A round of each lasts about a
millisecond, so that many of them are undisturbed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from ffrobot.bench.precision import Row
from ffrobot.mbs.model.build import build_model
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.run.bodies import load_bodies
from ffrobot.run.solve import prepare_scene
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import load_scene, make_scene

from .growth import LINKS, chain
from .hand_written import TIME, HandWritten, evaluation_seconds, general_state, ratios, start_at_rest

ROUNDS = 30
SECONDS = 1e-3  # of a round, about
MODES = 10
TUBE = {
    "material": {"youngs_modulus": 70e9, "poissons_ratio": 0.33, "density": 2700.0},
    "geometry": {"kind": "beam", "length": 0.4, "section": {"shape": "tube", "outer": 0.04, "inner": 0.036}},
    "mesh": {"elements": 12},
    "reference": {"condition": "cantilever"},
    "modes": {
        "family": ["in-plane-bending", "out-of-plane-bending", "torsion"],
        "count": MODES,
        "attachment_modes": False,
    },
}
RIGID = {
    "mass": 2.0,
    "center": [0.2, 0.0, 0.0],
    "inertia": [0.01, 0.03, 0.03],
    "points": {"root": [0.0, 0.0, 0.0], "tip": [0.4, 0.0, 0.0]},
}
AXES = ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
"""Of the joints of arms in space, one after the other."""


@dataclass(frozen=True)
class Timed:
    """What is evaluated, the seconds of one of so many evaluations, and those aimed at."""

    what: str
    seconds: Callable[[int], float]
    aim: float | None = None


def measure_evaluations(repository: Path, folder: Path, display: Watcher) -> list[Row]:
    """A row for each mechanism; those of the two-link case and the one written by hand come first."""
    display.stage("bodies, and compiling the hand-written version")
    two_link, slider_crank = (
        prepare_scene(load_scene(repository / "cases" / name / "scene.toml"), display).model
        for name in ("two_link", "slider_crank")
    )
    hand_written = HandWritten(repository, two_link, folder)
    timed = [
        Timed("two links × 10 modes, hand-written", hand_written.evaluation_seconds),
        Timed("two links × 10 modes, 2 constraints", partial(evaluation_seconds, general_state(two_link), TIME)),
        *(
            Timed(
                f"chain of {n} links × {MODES} modes, 2 constraints",
                partial(evaluation_seconds, start_at_rest(chain(n, MODES)), 0.0),
                55e-9 * n,
            )
            for n in LINKS
        ),
        Timed("slider-crank, 3 constraints", partial(evaluation_seconds, start_at_rest(slider_crank), 0.0), 0.15e-6),
        Timed(f"arm of 3 links × {MODES} modes in 3D, 3 constraints", _arm_3d(3, TUBE), 1.4e-6),
        Timed(f"arm of 6 links × {MODES} modes in 3D, 6 constraints", _arm_3d(6, TUBE), 3e-6),
        Timed("arm of 6 rigid links in 3D, 6 constraints", _arm_3d(6, RIGID)),
        Timed("arm of 6 rigid links in 3D, free", _arm_3d(6, RIGID, rows=0)),
    ]
    counts = [max(1, int(SECONDS / one.seconds(100))) for one in timed]
    measured: list[list[float]] = [[] for _ in timed]
    for repetition in range(ROUNDS):
        display.stage(f"evaluations: repetition {repetition + 1} of {ROUNDS}")
        for one, count, seconds in zip(timed, counts, measured, strict=True):
            seconds.append(one.seconds(count))
    by_hand = measured[0]
    return [_row(one, seconds, by_hand) for one, seconds in zip(timed, measured, strict=True)]


def _arm_3d(links: int, link: Mapping[str, Any], rows: int | None = None) -> Callable[[int], float]:
    """Measures an evaluation of an arm whose tip follows a path, by default with all its joints; bent, in motion."""
    rows = links if rows is None else rows
    names = [f"link{k}" for k in range(links)]
    inner = ["ground", *(f"{name}.tip" for name in names[:-1])]
    kind = "link" if "geometry" in link else "rigid"
    scene = make_scene(
        name="arm",
        space="spatial",
        gravity=[0.0, 0.0, -9.81],
        body=[{"name": name, kind: link} for name in names],
        joint=[
            {"name": f"joint{k}", "type": "revolute", "between": [before, f"{name}.root"], "axis": axis}
            for k, (before, name, axis) in enumerate(zip(inner, names, AXES[:links], strict=True))
        ],
        trajectory=_path(f"{names[-1]}.tip", rows),
        analysis=[{"name": "moves", "kind": "pcid" if rows else "forward", "end": 1.0, "output_step": 1.0}],
    )
    model = build_model(scene, [body.spatial for body in load_bodies(scene, lambda _: None).values()])
    core, rng = MultibodySystem(model).core, np.random.default_rng(1)
    q, v = rng.uniform(-1.0, 1.0, (2, core.n_v))
    for node in model.tree.nodes:
        q[node.p_q] *= 1e-3
    return partial(core.time_evaluations, q, v, np.zeros(len(model.rows)))


def _path(tip: str, rows: int) -> list[dict[str, object]]:
    """Of a point, with six `rows` of its orientation, too."""
    place = {"name": "path", "point": tip, "x": "0.6", "y": "0.1*t", "z": "0.5"}
    return [place | ({"rotation_vector": ["0.3", "0.1*t", "0.2"]} if rows == 6 else {})] if rows else []


def _row(one: Timed, seconds: list[float], by_hand: list[float]) -> Row:
    of_minima, of_neighbours = ratios(seconds, by_hand)
    row: Row = {
        "what": one.what,
        "seconds": median(seconds),
        "seconds_min": min(seconds),
        "of_hand_written": of_minima,
        "of_hand_written_median": of_neighbours,
        "repetitions": len(seconds),
    }
    return row if one.aim is None else row | {"aim": one.aim}
