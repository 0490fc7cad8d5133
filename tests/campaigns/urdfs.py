"""Every URDF below a folder through `ffrobot import` and `ffrobot solve`: moments against Newton and Euler on its XML.

    python tests/campaigns/urdfs.py FOLDER [--seed N]

The wheel `example-robot-data` (pip download, 131 MB) unpacked is such a folder. One line for each file: moments equal
(to what part of the largest), or why it is not imported. Exit code 1 where moments differ or there is a traceback.
"""

import argparse
import re
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "exchange"))

from rigid_robots import moments, with_motion

from ffrobot import FfrobotError
from ffrobot.exchange.urdf.import_urdf import import_urdf
from ffrobot.exchange.urdf.names import FORBIDDEN
from ffrobot.present.progress import Display
from ffrobot.results.spatial import write_spatial_results
from ffrobot.run.spatial import solve_spatial

EQUAL = 1e-10  # of the largest moment


def difference(urdf, folder, rng):
    """Largest difference of moments over the largest moment, and the number of joints."""
    imported = import_urdf(urdf, folder, {})
    by_scene_name = {joint["name"]: joint for joint in imported.scene["joint"]}
    called = {name: name.translate(FORBIDDEN) for name in imported.robot.joints}
    kinds = {name: by_scene_name[ours]["type"] for name, ours in called.items() if ours in by_scene_name}
    moving = [name for name, kind in kinds.items() if kind in ("revolute", "prismatic")]
    still = [name for name, joint in imported.robot.joints.items() if joint.type != "fixed" and name not in moving]
    motion = [{name: float(rng.uniform(-1, 1)) for name in moving} for _ in range(3)]
    scene = folder / "scene.toml"
    text = re.sub(r"^(viscous|coulomb)_friction = .*\n", "", scene.read_text(), flags=re.MULTILINE)
    scene.write_text(with_motion(text, *({called[name]: part[name] for name in moving} for part in motion)))
    results = folder / "results.h5"
    with Display() as display:
        write_spatial_results(solve_spatial(scene, display), results)
    expected = moments(urdf.read_bytes(), *({**part, **dict.fromkeys(still, 0.0)} for part in motion))
    with h5py.File(results) as file:
        found = np.array([file[f"inverse/joints/{called[name]}/moment"][0] for name in moving])
    wanted = np.array([expected[name] for name in moving])
    return np.abs(found - wanted).max() / np.abs(wanted).max(), len(moving)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    rng, wrong, counts = np.random.default_rng(arguments.seed), 0, {"equal": 0, "not imported": 0, "not solved": 0}
    for urdf in sorted(arguments.folder.rglob("*.urdf")):
        with TemporaryDirectory() as folder:
            try:
                error, count = difference(urdf, Path(folder) / "scene", rng)
            except FfrobotError as refusal:
                step = "not imported" if str(refusal).startswith(str(urdf)) else "not solved"
                counts[step] += 1
                print(f"{urdf.name}: {step}: {str(refusal).splitlines()[0].partition(': ')[2]}")
                continue
            counts["equal"] += error < EQUAL
            wrong += error >= EQUAL
            print(f"{urdf.name}: {count} joints, {error:.1e}", flush=True)
    print(counts, "different:", wrong)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
