"""Random robots in 3D written otherwise: turned, in a mirror, renamed, split, in other units. Results have to agree.

    python tests/campaigns/rewritten.py [--count 100] [--seed 57] [--first 0] [--record]

Every dataset counts but round-off (constraints) and what has a size or an order of its own (mode shapes).
A line for each that differs by more than the tolerance.
"""

import sys
import tempfile
import warnings
from collections import Counter
from pathlib import Path

import numpy as np
from record import options, record

from ffrobot import SolveError

sys.path += [str(Path(__file__).parents[1] / folder) for folder in ("cases", "mbs", "checkpoints/spatial")]
from rewritten_scenes import TOLERANCE, differences, random_robot, solved, written_otherwise


def main():
    asked = options(__doc__, count=100, seed=57, first=0).parse_args()
    warnings.simplefilter("ignore")
    tried, differ, most, datasets = Counter(), Counter(), 0.0, 0
    for number in range(asked.first, asked.first + asked.count):
        kind, tables = random_robot(asked.seed, number)
        with tempfile.TemporaryDirectory() as folder:
            try:
                original = solved(tables, Path(folder))
            except SolveError as error:  # as it should be written otherwise: out of reach
                print(f"{number} {kind}: {error}", flush=True)
                tried["not solved"] += 1
                continue
            rng = np.random.default_rng([asked.seed, number])
            for way, other in written_otherwise(tables, rng).items():
                tried[way] += 1
                try:
                    off = differences(tables, original, other, solved(other.tables, Path(folder)))
                except Exception as error:
                    differ[way] += 1
                    print(f"{number} {kind}, {way}: {type(error).__name__}: {error}", flush=True)
                    continue
                datasets, most = datasets + len(off), max(most, *off.values())
                if worst := {name: size for name, size in off.items() if size > TOLERANCE}:
                    differ[way] += 1
                    name = max(worst, key=worst.get)
                    print(f"{number} {kind}, {way}: {len(worst)} datasets, {name} by {worst[name]:.1e}", flush=True)
    ways = ", ".join(f"{way} {count}" for way, count in tried.items())
    beyond = sum(differ.values())
    found = f"{beyond} differ by more than {TOLERANCE:g}; largest difference {most:.1e} of {datasets} datasets"
    print(f"{asked.count} robots: {ways}: {found}")
    if asked.record:
        record("rewritten", tried=f"{asked.count} random robots in 3D, each written otherwise: {ways}", found=found)


if __name__ == "__main__":
    main()
