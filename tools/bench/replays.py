"""Forward runs with results of PCID, in the plane and in 3D: time beside that of PCID, and how far off they are."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from statistics import median

import numpy as np

from ffrobot.bench.precision import Row
from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import make_scene
from ffrobot.scene.scene import Scene

from .hand_written import ratios

INTEGRATORS = ("dop853", "auto")
TOLERANCE, TIGHTER, END, OUTPUT_STEP = 1e-4, 1e-6, 1.0, 0.001


def measure_replays(scenes: Iterable[Scene], repeat: int, display: Watcher) -> list[Row]:
    """Rows of each scene by integrator, and by what is applied; with all forces also in steps of a tighter tolerance.

    Raises `SolveError` where one fails.
    """
    rows = []
    for scene in scenes:
        patches = ("joints+pzt",) if scene.pzt else ()
        for integrator in INTEGRATORS:
            for apply in ("trajectory", *patches, "joints"):
                rows.append(_row(scene, apply, integrator, TOLERANCE, repeat, display))
        rows.append(_row(scene, "trajectory", "dop853", TIGHTER, repeat, display))
    return rows


def _row(scene: Scene, apply: str, integrator: str, tolerance: float, repeat: int, display: Watcher) -> Row:
    both, seconds, of_pcid = _scene(scene, apply, integrator, tolerance), [], []
    for repetition in range(repeat):
        display.stage(f"{scene.name}, {apply}, {integrator}: repetition {repetition + 1} of {repeat}")
        outcomes = solve_scene(both, display).outcomes.values()
        for outcome in outcomes:
            outcome.check_completed()
        pcid, forward = outcomes
        of_pcid.append(pcid.statistics.wall_seconds)
        seconds.append(forward.statistics.wall_seconds)
    of_minima, of_neighbours = ratios(seconds, of_pcid)
    return {
        "scene": scene.name,
        "what": apply,
        "integrator": integrator,
        "tolerance": tolerance,
        "seconds": median(seconds),
        "of_pcid": of_minima,
        "of_pcid_median": of_neighbours,
        "steps": forward.statistics.steps,
        "steps_of_pcid": pcid.statistics.steps,
        # largest deviation of a coordinate at the outputs, of the longest way of any
        "off": float(np.abs(forward.q - pcid.q).max() / np.ptp(pcid.q, axis=0).max()),
        "repetitions": repeat,
    }


def _scene(scene: Scene, apply: str, integrator: str, tolerance: float) -> Scene:
    keys = tomllib.loads(scene.text)
    common = {"end": END, "output_step": OUTPUT_STEP, "tolerance": TOLERANCE, "integrator": integrator}
    forward = {"name": "forward", "kind": "forward", "actuation": "inverse", "apply": apply}
    keys["analysis"] = [
        {"name": "inverse", "kind": "pcid", **common},
        {**forward, **common, "tolerance": tolerance},
    ]
    return make_scene(folder=scene.path.parent, **keys)
