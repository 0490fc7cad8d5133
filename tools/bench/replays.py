"""Time of forward runs with results of PCID of the two-link case, beside that of the PCID which they follow."""

from __future__ import annotations

import tomllib
from statistics import median

from ffrobot.bench.precision import Row
from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import make_scene
from ffrobot.scene.scene import Scene

from .ratio import ratios

APPLIED = ("trajectory", "joints+pzt", "joints")
INTEGRATORS = ("dop853", "auto")
TOLERANCE, END, OUTPUT_STEP = 1e-4, 1.0, 0.001
AIM = 2.0  # times the seconds of PCID


def measure_replays(scene: Scene, repeat: int, display: Watcher) -> list[Row]:
    """Rows by integrator and by what is applied; `scene` is cases/two_link. Raises `SolveError` where one fails."""
    return [
        _row(_scene(scene, apply, integrator), apply, integrator, repeat, display)
        for integrator in INTEGRATORS
        for apply in APPLIED
    ]


def _row(both: Scene, apply: str, integrator: str, repeat: int, display: Watcher) -> Row:
    seconds, of_pcid = [], []
    for repetition in range(repeat):
        display.stage(f"{apply}, {integrator}: repetition {repetition + 1} of {repeat}")
        outcomes = solve_scene(both, display).outcomes.values()
        for outcome in outcomes:
            outcome.check_completed()
        pcid, forward = (outcome.statistics for outcome in outcomes)
        of_pcid.append(pcid.wall_seconds)
        seconds.append(forward.wall_seconds)
    of_minima, of_neighbours = ratios(seconds, of_pcid)
    return {
        "what": apply,
        "integrator": integrator,
        "seconds": median(seconds),
        "of_pcid": of_minima,
        "of_pcid_median": of_neighbours,
        "aim": AIM,
        "steps": forward.steps,
        "steps_of_pcid": pcid.steps,
        "repetitions": repeat,
    }


def _scene(scene: Scene, apply: str, integrator: str) -> Scene:
    keys = tomllib.loads(scene.text)
    common = {"end": END, "output_step": OUTPUT_STEP, "tolerance": TOLERANCE, "integrator": integrator}
    keys["analysis"] = [
        {"name": "inverse", "kind": "pcid", **common},
        {"name": "forward", "kind": "forward", "actuation": "inverse", "apply": apply, **common},
    ]
    return make_scene(folder=scene.path.parent, **keys)
