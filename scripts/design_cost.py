#!/usr/bin/env python3
"""What `ffrobot optimise` costs, in CPU times of one `ffrobot solve`: eight heights of a stepped cantilever.

    .venv/bin/python scripts/design_cost.py

Processes side by side with others take more CPU time each: the solve is measured before and after, and the mean counts.
"""

from __future__ import annotations

import gc
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import tomli_w

import ffrobot

COMMAND = Path(sys.executable).parent / "ffrobot"
HEIGHTS = "links.{}.geometry.section.height=0.004:0.04:log"


def segment(name: str, length: float) -> dict[str, Any]:
    """A link with one element of aluminium."""
    return {
        "name": name,
        "material": {"youngs_modulus": 70e9, "density": 2700.0, "poissons_ratio": 0.3},
        "geometry": {
            "kind": "beam",
            "length": length,
            "section": {"shape": "rectangle", "height": 0.012, "width": 0.02},
        },
        "mesh": {"elements": 1},
        "reference": {"condition": "cantilever"},
        "modes": {"count": 2, "family": "in-plane-bending"},
        "damping": {"ratio": 0.01},
    }


CANTILEVER = {
    "name": "stepped",
    "gravity": [0.0, 0.0],
    "body": [{"name": f"s{k}", "link": segment(f"s{k}", 0.1)} for k in range(8)],
    "joint": [
        {"name": f"j{k}", "type": "weld", "between": [f"s{k - 1}.tip" if k else "ground", f"s{k}.root"]}
        for k in range(8)
    ],
    "load": [{"point": "s7.tip", "y": "1.0"}],
    "initial": {"state": "static"},
    "analysis": [{"name": "still", "kind": "static"}],
}


def optimised(scene: Path) -> int:
    """Runs for the lightest cantilever of eight heights whose tip gives way by 0.2 mm at most."""
    vary = [HEIGHTS.format(f"s{k}") for k in range(8)]
    limits = ["peak points.s7.tip.position[1] <= 2e-4"]
    found = ffrobot.optimise(scene, vary, scene.parent / "runs", minimise="mass", subject_to=limits)
    if not found.converged:
        sys.exit(f"not converged:\n{found}")
    return found.runs


def cpu() -> float:
    """Seconds of this process and of those that it has waited for."""
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def solve(scene: Path) -> float:
    """CPU time of the command."""
    begun = cpu()
    subprocess.run([COMMAND, "solve", scene, "-o", scene.with_suffix(".h5")], check=True, stdout=subprocess.DEVNULL)
    return cpu() - begun


def main() -> None:
    """One line."""
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.toml"
        scene.write_text(tomli_w.dumps(CANTILEVER), encoding="utf-8")
        solve(scene)  # and modal bodies
        one = [solve(scene) for _ in range(2)]
        begun = cpu()
        runs = optimised(scene)
        gc.collect()  # ends the workers
        spent = cpu() - begun
        one += [solve(scene) for _ in range(2)]
    mean = sum(one) / len(one)
    print(f"{runs} runs, {spent / mean:.1f} solves' worth of CPU time ({mean:.2f} s each)")


if __name__ == "__main__":
    main()
