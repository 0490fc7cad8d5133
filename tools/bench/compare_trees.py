"""Processor time of a scene in several checkouts of the program, each with its own environment.

    python tools/bench/compare_trees.py SCENE.toml TREE TREE … [--rounds 8] [--over AXIS …]

TREE is a folder with .venv, in which the program is installed. One process of each runs the scene in turn, after a
round that fills caches. A line for the state that the scene starts from, each integration and the whole run, or with
`--over` for a map of these axes: the shortest time, its ratio to the first tree, and the median of the ratios of
neighbors. Times depend on where memory happens to lie, too: by 3 % in two_link.
"""

import argparse
import json
import os
import subprocess
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

MEASURED = """
import importlib, json, resource, subprocess, sys, tempfile, time, warnings
from pathlib import Path
from ffrobot import solve
from ffrobot.run.solve import prepare_scene
warnings.simplefilter("ignore")
seconds = []

def first(*names):  # older programs have them elsewhere
    for name in names:
        try:
            return importlib.import_module("ffrobot.mbs." + name)
        except ImportError:
            pass

drive, statics = first("run.drive", "analysis.drive"), first("linear.statics", "solve.statics")
begin = first("posture.start", "solve.start")
of, name = (drive._Integration, "run") if hasattr(drive, "_Integration") else (drive, "_integrated")
integrated = getattr(of, name)

def timed(*given, **named):
    getattr(given[0], "ends", None)  # where steps end: older programs have looked for these places before
    before = time.process_time()
    run = integrated(*given, **named)
    seconds.append(("integration", time.process_time() - before, run.steps))
    return run

setattr(of, name, timed)

def run(scene):
    model, before = prepare_scene(scene).model, time.process_time()
    takes_start = statics.initial_state.__code__.co_argcount == 2
    for _ in range(STARTS):
        statics.initial_state(model, *([begin.undeformed_posture(model)] if takes_start else []))
    seconds.append(("start", (time.process_time() - before) / STARTS, 0))
    before = time.process_time()
    solve(scene)
    seconds.append(("run", time.process_time() - before, 0))

def of_children():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime

def make_map(scene, over):
    before = of_children()
    with tempfile.TemporaryDirectory() as folder:
        axes = [text for axis in over for text in ("--over", axis)]
        command = [Path(sys.executable).with_name("ffrobot"), "map", scene, *axes, "--no-figures", "-j1", "-o", folder]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    seconds.append(("map", of_children() - before, 0))

for line in sys.stdin:
    seconds.clear()
    scene, *over = json.loads(line)
    make_map(scene, over) if over else run(Path(scene))
    print(json.dumps(seconds), flush=True)
""".replace("STARTS", "10")


def measured(process, scene, over):
    process.stdin.write(json.dumps([str(scene), *over]) + "\n")
    process.stdin.flush()
    return json.loads(process.stdout.readline())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("trees", type=Path, nargs="+")
    parser.add_argument("--rounds", type=int, default=8)
    parser.add_argument("--over", action="append", default=[])
    asked = parser.parse_args()
    with TemporaryDirectory() as caches:
        processes = [
            subprocess.Popen(
                [tree / ".venv/bin/python", "-P", "-c", MEASURED], text=True,
                stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                env=os.environ | {"XDG_CACHE_HOME": f"{caches}/{k}", "OMP_NUM_THREADS": "1"},
            )
            for k, tree in enumerate(asked.trees)
        ]  # fmt: skip
        scene = asked.scene.resolve()
        rounds = [[measured(process, scene, asked.over) for process in processes] for _ in range(asked.rounds + 1)]
        for process in processes:
            process.stdin.close()
            process.wait()
    print("| tree | what | steps | seconds | ratio | median |\n|---|---|---|---|---|---|")
    for k, tree in enumerate(asked.trees):
        for run, (what, _, steps) in enumerate(rounds[0][k]):
            here, first = ([of_trees[i][run][1] for of_trees in rounds[1:]] for i in (k, 0))
            of_minima, of_neighbors = min(here) / min(first), median(a / b for a, b in zip(here, first, strict=True))
            print(f"| {tree} | {what} | {steps} | {min(here):.4f} | {of_minima:.3f} | {of_neighbors:.3f} |")


if __name__ == "__main__":
    main()
