"""Makes reference files of what this state of the program finds, where it differs from those that are there.

    python tests/references/make_references.py [NAME …]

Without names of all cases and scenes: some two minutes. A reference that is met keeps its numbers, and gains what it
lacks; of others the largest differences are printed, for the commit that makes them anew to explain.
"""

import sys
import warnings
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / name) for name in ("", "campaigns", "cases", "mbs")]

import reference_numbers  # noqa: E402
import reference_scenes  # noqa: E402

import ffrobot  # noqa: E402


def main():
    warnings.simplefilter("ignore", ffrobot.FfrobotWarning)
    for name in sys.argv[1:] or (*reference_scenes.CASES, *reference_scenes.MADE):
        scene = reference_scenes.CASES.get(name) or reference_scenes.MADE[name]()
        with ffrobot.solve(scene) as results:
            found = reference_numbers.of_results(results)
        path = reference_numbers.path_of(name)
        differing = reference_numbers.differing(name, found) if path.exists() else ["no reference yet"]
        if differing:
            is_met = path.exists() and all(each.words == reference_numbers.NEW for each in differing)
            reference_numbers.write(found | reference_numbers.read(path) if is_met else found, path)
        print(f"{name}: {'; '.join(map(str, differing[:3])) or 'as before'}", flush=True)


if __name__ == "__main__":
    main()
