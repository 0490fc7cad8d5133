"""EXUDYN on the two-link case with our modal bodies (tools/bench/peers/exudyn_two_link.py): error and time."""

from __future__ import annotations

import json
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from ffrobot.bench.precision import PATIENCE, Point, ReferenceRun, Row, relative, repeat_point
from ffrobot.common.errors import InputError, SolveError
from ffrobot.run.watcher import Watcher
from ffrobot.scene.scene import Scene

from .aims import fastest

SCRIPT = Path("tools/bench/peers/exudyn_two_link.py")
NAME = "EXUDYN generalized-alpha"
STEPS, GRAVITY = (1e-4, 1e-5, 3.125e-6), ("full", "native")
FORCE, DEFLECTION = "trajectories/tip/force", "points/link2.tip/deflection"


class Exudyn:
    """Runs the script with an interpreter that has EXUDYN.

    Raises `InputError` where the script or EXUDYN is missing.
    """

    def __init__(self, repository: Path, python: Path, links: Sequence[Path], budget: float) -> None:
        self._script, self._python, self._links, self._budget = repository / SCRIPT, python, links, PATIENCE * budget
        if not self._script.is_file():
            raise InputError(f"{repository}: source: expected ffrobot's source tree, found no {SCRIPT} in it")
        probe: list[str | Path] = [python, "-c", "import exudyn, h5py"]
        try:
            found = subprocess.run(probe, capture_output=True, text=True, check=False)
        except OSError as error:
            raise InputError(f"--peer-python: expected a Python, found {python}: {error.strerror}") from None
        if found.returncode:
            raise InputError(
                f'--peer: expected EXUDYN in {python}, found none: {python} -m pip install "exudyn==1.13.*", or name'
                " another one with --peer-python"
            )

    def __call__(self, step: float, gravity: str, reference: ReferenceRun) -> Row:
        """One run as a row: seconds and errors; "over budget" without."""
        row: Row = {"integrator": NAME, "step": step, "gravity": gravity}
        with tempfile.TemporaryDirectory(prefix="ffrobot-bench-") as folder:
            path = Path(folder) / "run.csv"
            command: list[str | Path] = [
                self._python,
                self._script,
                *self._links,
                "--step",
                str(step),
                "--gravity",
                gravity,
                "-o",
                path,
            ]
            try:
                done = subprocess.run(command, capture_output=True, text=True, timeout=self._budget, check=False)
            except subprocess.TimeoutExpired:
                return row | {"status": "over budget"}
            if done.returncode:
                raise SolveError(f"{self._script}: ended with an error:\n{done.stderr}")
            about = json.loads(done.stdout.splitlines()[-1])
            if not about["completed"]:
                return row | {"status": "not completed"}
            return row | {"status": "completed", "seconds": about["seconds"], **_errors(path, reference), **about}


def _errors(path: Path, reference: ReferenceRun) -> dict[str, float]:
    """Of the tip; its force without the first output, which EXUDYN gets wrong at any step and reports for itself."""
    values = np.loadtxt(path, delimiter=",", skiprows=1)
    force, deflection = reference.histories["force"][FORCE], reference.histories["displacement"][DEFLECTION]
    return {
        "error_force": float(np.abs(values[1:, 1:3] - force[1:]).max() / np.abs(force).max()),
        "error_displacement": relative(values[:, 3:5], deflection),
        "error_force_at_start": float(np.abs(values[0, 1:3] - force[0]).max() / np.abs(force[0]).max()),
    }


def measure_peer(
    exudyn: Exudyn,
    scene: Scene,
    name: str,
    reference: ReferenceRun,
    points: Sequence[Point],
    repeat: int,
    budget: float,
    display: Watcher,
) -> tuple[list[Row], dict[str, Any]]:
    """EXUDYN's rows, and how much faster our fastest point as accurate as its best is.

    `scene` is cases/two_link, `name` its inverse analysis with outputs every millisecond, `points` our sweep of it.
    Best is its smallest error of the tip force; ours has all forces and all deflections within its errors.
    """
    rows = []
    for gravity in GRAVITY:
        for step in STEPS:
            display.stage(f"EXUDYN: step {step:g}, {gravity} gravity")
            rows.append(exudyn(step, gravity, reference))
    completed: list[dict[str, Any]] = [row for row in rows if row["status"] == "completed"]
    if not completed:
        return rows, {"speed_ratio": None, "why": "no run of the peer completed within the budget"}
    best = min(completed, key=lambda row: row["error_force"])
    bounds = {"force": best["error_force"], "displacement": best["error_displacement"]}
    ours = fastest(points, bounds)
    if ours is None:
        return rows, {"speed_ratio": None, "why": "no point of ours is as accurate", **bounds}
    pairs = [(best["seconds"], repeat_point(scene, name, ours, budget, display))]
    for repetition in range(1, repeat):
        display.stage(f"EXUDYN: step {best['step']:g}, repetition {repetition + 1}")
        again = exudyn(best["step"], best["gravity"], reference)
        if again["status"] == "completed":
            pairs.append((float(str(again["seconds"])), repeat_point(scene, name, ours, budget, display)))
    return rows, {
        "speed_ratio": median(theirs / own for theirs, own in pairs),
        "repetitions": len(pairs),
        "peer": {key: best[key] for key in ("step", "gravity", "error_force", "error_displacement")},
        "peer_seconds": median(theirs for theirs, _ in pairs),
        "ours": {"integrator": ours.integrator, "tolerance": ours.tolerance, "errors": dict(ours.error)},
        "our_seconds": median(own for _, own in pairs),
    }
