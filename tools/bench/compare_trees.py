"""Processor time of all integrations of a scene in several checkouts of the program, each with its own environment.

    python tools/bench/compare_trees.py SCENE.toml TREE TREE … [--rounds 8]

TREE is a folder with .venv, in which the program is installed. One process of each runs the scene in turn, after a
round that fills caches. A line for each integration: the shortest time, its ratio to the first tree, and the median of
the ratios of neighbors. Times depend on where memory happens to lie, too: by 3 % in two_link.
"""

import argparse
import json
import os
import subprocess
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

MEASURED = """
import importlib, json, sys, time, warnings
from pathlib import Path
from ffrobot import solve
warnings.simplefilter("ignore")
seconds = []
for name in ("drive", "spatial_drive"):  # older programs have both
    try:
        module = importlib.import_module("ffrobot.mbs.analysis." + name)
    except ImportError:
        continue
    def timed(*given, _integrated=module._integrated, **named):
        before = time.process_time()
        run = _integrated(*given, **named)
        seconds.append((time.process_time() - before, run.steps))
        return run
    module._integrated = timed
for line in sys.stdin:
    seconds.clear()
    solve(Path(line.strip()))
    print(json.dumps(seconds), flush=True)
"""


def measured(process, scene):
    process.stdin.write(f"{scene}\n")
    process.stdin.flush()
    return json.loads(process.stdout.readline())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("trees", type=Path, nargs="+")
    parser.add_argument("--rounds", type=int, default=8)
    asked = parser.parse_args()
    with TemporaryDirectory() as caches:
        processes = [
            subprocess.Popen(
                [tree / ".venv/bin/python", "-c", MEASURED], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                env=os.environ | {"XDG_CACHE_HOME": f"{caches}/{k}", "OMP_NUM_THREADS": "1"},
            )
            for k, tree in enumerate(asked.trees)
        ]  # fmt: skip
        rounds = [[measured(process, asked.scene.resolve()) for process in processes] for _ in range(asked.rounds + 1)]
        for process in processes:
            process.stdin.close()
            process.wait()
    print("| tree | integration | steps | seconds | ratio | median |\n|---|---|---|---|---|---|")
    for k, tree in enumerate(asked.trees):
        for run, (_, steps) in enumerate(rounds[0][k]):
            here, first = ([of_trees[i][run][0] for of_trees in rounds[1:]] for i in (k, 0))
            of_minima, of_neighbors = min(here) / min(first), median(a / b for a, b in zip(here, first, strict=True))
            print(f"| {tree} | {run} | {steps} | {min(here):.4f} | {of_minima:.3f} | {of_neighbors:.3f} |")


if __name__ == "__main__":
    main()
