"""Time of forward runs that replay PCID of the two-link case, beside that of the PCID which they follow."""

from __future__ import annotations

import tomllib
from statistics import median

from ..common.errors import SolveError
from ..run.solve import solve
from ..run.watcher import Watcher
from ..scene.load import make_scene
from ..scene.scene import Scene
from .precision import Row

APPLIED = ("trajectory", "joints+pzt", "joints")
INTEGRATORS = ("dop853", "auto")
TOLERANCE, END, OUTPUT_STEP = 1e-4, 1.0, 0.001
AIM = 2.0  # times the seconds of PCID


def measure_replays(scene: Scene, repeat: int, display: Watcher) -> list[Row]:
    """Rows by integrator and by what is applied; `scene` is cases/two_link. Raises `SolveError` where one fails."""
    rows = []
    for integrator in INTEGRATORS:
        for apply in APPLIED:
            both = _scene(scene, apply, integrator)
            pairs = []
            for repetition in range(repeat):
                display.stage(f"{apply}, {integrator}: repetition {repetition + 1} of {repeat}")
                pcid, forward = (outcome.statistics for outcome in solve(both, display).outcomes.values())
                for statistics in (pcid, forward):
                    if statistics.status != "completed":
                        raise SolveError(f"replay of {apply} with {integrator}: {statistics.status}")
                pairs.append((forward.wall_seconds, pcid.wall_seconds))
            seconds, of_pcid = zip(*pairs, strict=True)
            rows.append(
                {
                    "what": apply,
                    "integrator": integrator,
                    "seconds": median(seconds),
                    "of_pcid": min(seconds) / min(of_pcid),
                    "of_pcid_median": median(a / b for a, b in pairs),
                    "aim": AIM,
                    "steps": forward.steps,
                    "steps_of_pcid": pcid.steps,
                    "repetitions": repeat,
                }
            )
    return rows


def _scene(scene: Scene, apply: str, integrator: str) -> Scene:
    keys = tomllib.loads(scene.text)
    common = {"end": END, "output_step": OUTPUT_STEP, "tolerance": TOLERANCE, "integrator": integrator}
    keys["analysis"] = [
        {"name": "inverse", "kind": "pcid", **common},
        {"name": "forward", "kind": "forward", "actuation": "inverse", "apply": apply, **common},
    ]
    return make_scene(folder=scene.path.parent, **keys)
