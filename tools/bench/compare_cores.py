"""Speed of compiled cores: the one of this environment, tuned for this machine, and the two that a wheel holds.

    .venv/bin/python tools/bench/compare_cores.py WHEEL [--repeat 5]

An arm of two links of 3, 8 and 16 modes by DOP853 and by Radau IIA; all cores in turn. Printed are ratios of the
shortest processor times to those of this environment. scripts/build_wheel.sh builds a wheel.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

MODES, INTEGRATORS = (3, 8, 16), ("dop853", "radau")
MEASURED = """
import json, sys, time
sys.path[:0] = sys.argv[1:]
from links import ANGLES, arm, arm_links
from mechanisms import pcid
from oracle_runs import run
from ffrobot.mbs import _core
for line in sys.stdin:
    modes, integrator = json.loads(line)
    model = arm(arm_links(modes=modes, extra=2), initial={"angles": ANGLES})
    analysis = pcid(end=0.2, tolerance=1e-5, integrator=integrator)
    before = time.process_time()
    statistics = run(model, analysis).statistics
    seconds = time.process_time() - before
    print(json.dumps([seconds, statistics.evaluations, _core.build]), flush=True)
"""
TESTS = Path(__file__).parents[2] / "tests"


def started(core, folder):
    """A process that makes runs with the core of that name, from a wheel unpacked in `folder` where one is given."""
    paths = [str(TESTS / "mbs"), str(TESTS / "checkpoints" / "spatial"), *([folder] if folder else [])]
    code = MEASURED
    if folder:  # an editable install would come first
        code = "import sys; sys.meta_path[:] = [f for f in sys.meta_path if 'ditable' not in repr(f)]\n" + code
    return subprocess.Popen(
        [sys.executable, "-P", "-c", code, *paths], env=os.environ | {"FFROBOT_CORE": core, "OMP_NUM_THREADS": "1"},
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip


def measured(process, modes, integrator):
    process.stdin.write(json.dumps([modes, integrator]) + "\n")
    process.stdin.flush()
    return json.loads(process.stdout.readline())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wheel", type=Path)
    parser.add_argument("--repeat", type=int, default=5)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        zipfile.ZipFile(asked.wheel).extractall(folder)
        cores = {"": started("", None), "v3": started("v3", folder), "baseline": started("baseline", folder)}
        print("| modes a link | integrator | v3 | baseline |\n|---|---|---|---|")
        for modes in MODES:
            for integrator in INTEGRATORS:
                found = {core: [] for core in cores}
                for _ in range(asked.repeat):
                    for core, process in cores.items():
                        found[core].append(measured(process, modes, integrator))
                seconds = {core: min(one[0] for one in runs) for core, runs in found.items()}
                ratios = " | ".join(f"{seconds[core] / seconds['']:.2f}" for core in ("v3", "baseline"))
                print(f"| {modes} | {integrator} | {ratios} |", flush=True)
        builds = {core or "this environment": measured(process, 3, "dop853")[2] for core, process in cores.items()}
        for process in cores.values():
            process.stdin.close()
            process.wait()
    print(*(f"{core}: {build}" for core, build in builds.items()), sep="\n")


if __name__ == "__main__":
    main()
