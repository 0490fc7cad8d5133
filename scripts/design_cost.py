#!/usr/bin/env python3
"""What `ffrobot optimise` and `ffrobot sensitivity` cost, in CPU times of one `ffrobot solve` of their scene.

    .venv/bin/python scripts/design_cost.py [NAME …]

Processes side by side with others take more CPU time each: the solve is measured before and after, and the mean counts.
"""

from __future__ import annotations

import gc
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import tomli_w

import ffrobot

COMMAND = Path(sys.executable).parent / "ffrobot"
TWO_LINK = Path(__file__).parents[1] / "cases" / "two_link"
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


def stepped(first: str, length: float, **keys: Any) -> dict[str, Any]:  # noqa: ANN401 (whatever TOML may hold)
    """Eight segments welded in line, the first by a joint of the type `first` to the ground."""
    joints = [
        {"name": f"j{k}", "type": "weld" if k else first, "between": [f"s{k - 1}.tip" if k else "ground", f"s{k}.root"]}
        for k in range(8)
    ]
    bodies = [{"name": f"s{k}", "link": segment(f"s{k}", length)} for k in range(8)]
    return {"name": "stepped", "body": bodies, "joint": joints, **keys}


CANTILEVER = stepped(
    "weld", 0.1, gravity=[0.0, 0.0], load=[{"point": "s7.tip", "y": "1.0"}], initial={"state": "static"},
    analysis=[{"name": "still", "kind": "static"}],
)  # fmt: skip


def optimised(limit: str) -> Callable[[Path], int]:
    """Runs for the lightest one of eight heights within a limit."""

    def find(scene: Path) -> int:
        vary = [HEIGHTS.format(f"s{k}") for k in range(8)]
        found = ffrobot.optimise(scene, vary, scene.parent / "runs", minimise="mass", subject_to=[limit])
        if not found.converged:
            sys.exit(f"not converged:\n{found}")
        return found.runs

    return find


def differentiated(scene: Path) -> int:
    """Runs for eight derivatives of a peak moment."""
    links = [f"links.{link}.{key}" for link in ("link1", "link2") for key in LINK_KEYS]
    found = ffrobot.sensitivity(scene, ["peak inverse.joints.O.moment"], links, scene.parent / "runs")
    return found.runs


LINK_KEYS = ("geometry.section.height", "geometry.section.width", "material.density", "material.youngs_modulus")
TASKS: Mapping[str, tuple[Mapping[str, Any] | Path, Callable[[Path], int]]] = {
    "cantilever": (CANTILEVER, optimised("peak points.s7.tip.position[1] <= 2e-4")),
    "two_link": (TWO_LINK, differentiated),
}


def cpu() -> float:
    """Seconds of this process and of those that it has waited for."""
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def solve(scene: Path) -> float:
    """CPU time of the command."""
    begun = cpu()
    subprocess.run([COMMAND, "solve", scene, "-o", scene.with_suffix(".h5")], check=True, stdout=subprocess.DEVNULL)
    return cpu() - begun


def main() -> None:
    """One line for each task."""
    for name in sys.argv[1:] or TASKS:
        source, task = TASKS[name]
        with tempfile.TemporaryDirectory() as folder:
            scene = Path(folder) / "scene.toml"
            if isinstance(source, Path):
                for file in source.glob("*.toml"):
                    (Path(folder) / file.name).write_bytes(file.read_bytes())
            else:
                scene.write_text(tomli_w.dumps(source), encoding="utf-8")
            solve(scene)  # and modal bodies
            one = [solve(scene) for _ in range(2)]
            begun = cpu()
            runs = task(scene)
            gc.collect()  # ends the workers
            spent = cpu() - begun
            one += [solve(scene) for _ in range(2)]
        mean = sum(one) / len(one)
        print(f"{name}: {runs} runs, {spent / mean:.1f} solves' worth of CPU time ({mean:.2f} s each)", flush=True)


if __name__ == "__main__":
    main()
