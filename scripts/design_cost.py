#!/usr/bin/env python3
"""What designs cost, in wall and CPU times of one `ffrobot solve` of the same scene.

    .venv/bin/python scripts/design_cost.py                     # all of it, half an hour
    .venv/bin/python scripts/design_cost.py sensitivity         # eight derivatives of PCID, in the plane and in space
    .venv/bin/python scripts/design_cost.py optimise            # eight variables, of short and of long runs
    .venv/bin/python scripts/design_cost.py uncertainty 1000    # samples, against single runs and bands by gradients

Processes side by side with others take more CPU time each: solves are measured before and after, and their mean counts.
"""

from __future__ import annotations

import argparse
import gc
import resource
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np
import tomli_w

import ffrobot
from ffrobot.common.parallel import processors
from ffrobot.sweep.files import run_files

COMMAND = Path(sys.executable).parent / "ffrobot"
CASES = Path(__file__).parents[1] / "cases"
SOLVES = 2  # before, and as many after
T = TypeVar("T")


class Time(NamedTuple):
    """Seconds."""

    wall: float
    cpu: float


def measured(work: Callable[[], T]) -> tuple[T, Time]:
    """What `work` returns, and its time, that of processes which it has waited for included."""

    def cpu() -> float:
        return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))

    wall, begun = time.perf_counter(), cpu()
    found = work()
    gc.collect()  # ends workers
    return found, Time(time.perf_counter() - wall, cpu() - begun)


def against_solves(scene: Path, work: Callable[[], T]) -> tuple[T, str]:
    """What `work` returns, and what it costs in times of `ffrobot solve`."""

    def solve() -> None:
        out = scene.with_suffix(".h5")
        subprocess.run([COMMAND, "solve", scene, "-o", out], check=True, stdout=subprocess.DEVNULL)

    solve()  # and modal bodies
    solves = [measured(solve)[1] for _ in range(SOLVES)]
    found, spent = measured(work)
    solves += [measured(solve)[1] for _ in range(SOLVES)]
    wall, cpu = np.mean(solves, axis=0)
    words = (
        f"{spent.wall / wall:.1f} times its wall time ({wall:.2f} s), {spent.cpu / cpu:.1f} its CPU time ({cpu:.2f} s)"
    )
    return found, words


def pcid_of(case: str, folder: Path, changes: Mapping[str, object] | None = None) -> Path:
    """The scene of a case with its first analysis alone, and tables changed; its link files stay where they are."""
    scene = run_files(CASES / case / "scene.toml", {}, folder).scene
    scene |= {"analysis": scene["analysis"][:1], **(changes or {})}
    file = folder / f"{case}.toml"
    file.write_text(tomli_w.dumps(scene), encoding="utf-8")
    return file


# --- eight derivatives ---

PLANE_KEYS = (
    "gravity.1",
    *(f"links.{link}.geometry.section.height" for link in ("link1", "link2")),
    *(f"links.{link}.material.{key}" for link in ("link1", "link2") for key in ("density", "youngs_modulus")),
    "links.link1.geometry.section.width",
)
SPACE_KEYS = (
    "gravity.2",
    *(f"links.{link}.geometry.section.{key}" for link in ("upper", "fore") for key in ("outer", "inner")),
    *(f"links.{link}.material.density" for link in ("upper", "fore")),
    "links.upper.material.youngs_modulus",
)


def sensitivities(folder: Path) -> None:
    """Of two_link and arm_3r: a line for each."""
    for case, keys, joints in (
        ("two_link", PLANE_KEYS, ("O", "A")),
        ("arm_3r", SPACE_KEYS, ("shoulder", "elbow")),
    ):
        scene = pcid_of(case, folder)
        responses = [f"{what} joints.{joint}.moment" for joint in joints for what in ("rms", "peak")]
        derivatives = partial(ffrobot.sensitivity, scene, responses, keys, folder / case, processes=processors())
        found, cost = against_solves(scene, derivatives)
        scale = np.abs(found.values) / np.abs(found.value)[:, None]
        error = (found.error * scale).max(axis=1) / np.maximum(1.0, np.abs(found.logarithmic).max(axis=1))
        print(
            f"{case}: eight derivatives, {found.runs} runs: {cost}; estimated errors {error.max():.1e} of the largest"
        )


# --- the best of eight variables ---

HEIGHTS = "links.{}.geometry.section.height=0.004:0.04:log"


def segment(name: str, length: float) -> dict[str, object]:
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


JOINTS = [
    {"name": f"j{k}", "type": "weld", "between": [f"s{k - 1}.tip" if k else "ground", f"s{k}.root"]} for k in range(8)
]
CANTILEVER: dict[str, object] = {
    "name": "stepped",
    "gravity": [0.0, 0.0],
    "body": [{"name": f"s{k}", "link": segment(f"s{k}", 0.1)} for k in range(8)],
    "joint": JOINTS,
    "load": [{"point": "s7.tip", "y": "1.0"}],
    "initial": {"state": "static"},
    "analysis": [{"name": "still", "kind": "static"}],
}


SHAKEN = CANTILEVER | {
    "name": "shaken",
    "joint": [JOINTS[0] | {"type": "revolute"}, *JOINTS[1:]],
    "trajectory": [{"name": "held", "joint": "j0", "value": "0"}],
    "load": [{"point": "s7.tip", "y": "sin(10*pi*t)"}],
    "analysis": [
        {
            "name": "inverse",
            "kind": "pcid",
            "end": 0.3,
            "output_step": 0.001,
            "integrator": "dop853",
            "tolerance": 1e-8,
        }
    ],
}
"""The same cantilever, held by a motor and shaken at 5 Hz: a second of integration."""


def optima(folder: Path) -> None:
    """Of the stepped cantilever: runs are short where it is at rest, and long where it is shaken."""
    for keys, limit in (
        (CANTILEVER, "peak points.s7.tip.position[1] <= 2e-4"),
        (SHAKEN, "rms points.s7.tip.position[1] <= 2e-4"),
    ):
        scene = folder / f"{keys['name']}.toml"
        scene.write_text(tomli_w.dumps(keys), encoding="utf-8")
        search = partial(
            ffrobot.optimise, scene, [HEIGHTS.format(f"s{k}") for k in range(8)], folder / scene.stem, minimise="mass",
            subject_to=[limit], processes=processors(),
        )  # fmt: skip
        found, cost = against_solves(scene, search)
        ending = "" if found.converged else ", not converged"
        print(f"{keys['name']} cantilever: the lightest of eight heights, {found.runs} runs{ending}: {cost}")


# --- spreads ---

SPREADS = tuple(
    f"links.{link}.{key}=±2%"
    for link in ("link1", "link2")
    for key in ("geometry.section.height", "material.density", "material.youngs_modulus")
)
HISTORIES = ("joints.O.moment", "joints.A.moment")
FROM_REST = {"state": "static", "angles": {"link1": 0.0, "link2": np.pi / 3}}
ROWS = 3  # that are solved again by themselves


def uncertainties(folder: Path, count: int = 1000) -> None:
    """Samples of two_link from rest, 20 ms of them, and of its motion from rest to rest: see `spread`."""
    begun = run_files(CASES / "two_link" / "scene.toml", {}, folder).scene["analysis"][0] | {"end": 0.02}
    spread("two_link", pcid_of("two_link", folder, {"initial": FROM_REST, "analysis": [begun]}), count)
    spread("two_link_rest_to_rest", pcid_of("two_link_rest_to_rest", folder), count // 10)


def spread(name: str, scene: Path, count: int) -> None:
    """Samples against single runs, and bands by gradients against theirs."""
    folder = scene.with_suffix(".uncertainty")
    study = partial(ffrobot.uncertainty, scene, HISTORIES, SPREADS, processes=processors())
    sampled, cost = against_solves(scene, partial(study, folder / "samples", samples=count))
    print(f"{name}: {sampled.runs} runs of samples: {cost}")
    linear, cost = against_solves(scene, partial(study, folder / "gradients", by="gradients"))
    print(f"{name}: {linear.runs} runs of gradients: {cost}")
    for one, other in zip(linear.bands, sampled.bands, strict=True):
        off = np.abs(one.statistics.deviation - other.statistics.deviation).max() / other.statistics.deviation.max()
        print(f"{name}: {one.name}: deviations by gradients are off by {100 * off:.2g} % of the largest")
    print(f"{name}: {ROWS} samples solved by themselves: off by {rows_alone(folder / 'samples'):.1e} of the peaks")


def rows_alone(folder: Path) -> float:
    """How far moments of a few samples are off those of `ffrobot.solve` of the same scene, of their peaks."""
    off = 0.0
    warnings.simplefilter("ignore", ffrobot.FfrobotWarning)
    for run in sorted((folder / "runs").iterdir())[:ROWS]:
        with ffrobot.solve(run / "scene.toml") as alone, ffrobot.Results(run / "results.h5") as sample:
            for name in HISTORIES:
                dataset = f"inverse/{name.replace('.', '/')}"
                off = max(off, float(np.abs(alone[dataset] - sample[dataset]).max() / np.abs(alone[dataset]).max()))
    return off


def main() -> None:
    """What is asked for."""
    parts = {"sensitivity": sensitivities, "optimise": optima, "uncertainty": uncertainties}
    parser = argparse.ArgumentParser(description="What designs cost, in times of one solve.")
    parser.add_argument("part", nargs="?", choices=parts)
    parser.add_argument("samples", nargs="?", type=int, default=1000)
    chosen = parser.parse_args()
    for name, part in parts.items():
        if chosen.part in (None, name):
            with tempfile.TemporaryDirectory() as folder:
                part(Path(folder), *([chosen.samples] if part is uncertainties else []))


if __name__ == "__main__":
    main()
