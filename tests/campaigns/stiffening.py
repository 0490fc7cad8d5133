"""Geometric stiffening on against off: does a run fail with it that completes without, and what does it change?

    python tests/campaigns/stiffening.py [--seed 1] [--count 36] [--cases DIR] [--record]

Random robots (`random_robots`), and with `--cases` all cases of a folder, copied: each is solved twice. A line each:
how both ended, by how much loads change the stiffness of a mode, and the largest difference of each kind of quantity,
relative to its peak. What cannot be stiffened (patches with mass, actuation points) is told as refused.
"""

import argparse
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from random_robots import random_scene
from record import record

from ffrobot.common.errors import FfrobotError, InputError
from ffrobot.run.mode_choice import reported_modes
from ffrobot.run.mode_search import difference
from ffrobot.run.solution import Solution
from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import load_scene
from ffrobot.scene.scene import Scene

NOTABLE = 0.01  # change of a mode's stiffness from which on "auto" switches it on


def scenes(asked: argparse.Namespace) -> Iterator[tuple[str, Scene]]:
    """Random robots, then the cases."""
    for number in range(asked.count):
        kind, scene = random_scene(asked.seed, number)
        yield f"{kind} {number}", scene
    if asked.cases is not None:
        with tempfile.TemporaryDirectory() as folder:
            shutil.copytree(asked.cases, folder, dirs_exist_ok=True)
            for path in sorted(Path(folder).glob("*/scene.toml")):
                yield path.parent.name, load_scene(path)


def solved(scene: Scene, stiffening: bool) -> Solution | str:
    """The solution as far as it came, or why there is none."""
    kept: list[Solution] = []
    try:
        return solve_scene(scene.model_copy(update={"geometric_stiffening": stiffening}), Watcher(), kept.append)
    except InputError:
        return "rejected"
    except FfrobotError as error:
        return kept[-1] if kept else str(error).splitlines()[0]


def ends(solution: Solution | str) -> dict[str, str]:
    """How each analysis ended."""
    if isinstance(solution, str):
        return {}
    return {name: result.status for name, result in solution.analyses.items()}


def changes(on: Solution, off: Solution) -> dict[str, float]:
    """By kind, the largest difference over all analyses that ended at the same time."""
    found: dict[str, float] = {}
    for name in on.analyses.keys() & off.analyses.keys():
        one, other = on.analyses[name], off.analyses[name]
        if np.array_equal(one.run.time, other.run.time):
            for kind, value in difference(reported_modes(one), reported_modes(other)).items():
                found[kind] = max(found.get(kind, 0.0), value)
    return found


def main() -> None:
    """Print a line for each scene, and how many fail with stiffening alone."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=36, help="random robots")
    parser.add_argument("--cases", type=Path, help="folder of cases")
    parser.add_argument("--record", action="store_true", help="keep the counts for docs/developer/stress_tests.md")
    asked = parser.parse_args()
    tried = failed = refused = above = better = 0
    for name, scene in scenes(asked):
        off, on = solved(scene, False), solved(scene, True)
        tried += 1
        if isinstance(on, str) and not isinstance(off, str):
            refused += on == "rejected"
            failed += on != "rejected"
            print(f"{name}: {on}", flush=True)
            continue
        before, after = ends(off), ends(on)
        lost = [key for key, how in before.items() if how == "completed" and after.get(key) != "completed"]
        won = [key for key, how in after.items() if how == "completed" and before.get(key) != "completed"]
        failed, better = failed + bool(lost), better + bool(won)
        effect = 0.0 if isinstance(off, str) else max(r.stiffening_effect for r in off.analyses.values())
        above += effect > NOTABLE
        moved = {} if isinstance(on, str) or isinstance(off, str) else changes(on, off)
        told = ", ".join(f"{kind} {value:.1e}" for kind, value in moved.items())
        print(f"{name}: fails {lost or 'nowhere'}, loads {effect:.1e}; {told}", flush=True)
    found = (
        f"{failed} fail with stiffening that complete without, {better} the other way round; {refused} cannot be"
        f" stiffened; in {above} loads change the stiffness of a mode by more than {NOTABLE:.0%}"
    )
    print(found)
    if asked.record:
        record("stiffening", tried=f"{tried} scenes with geometric stiffening on and off", found=found)


if __name__ == "__main__":
    main()
