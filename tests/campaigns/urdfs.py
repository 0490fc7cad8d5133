"""Every URDF below a folder through `ffrobot import` and `ffrobot solve`: moments against Newton and Euler on its XML.

    python tests/campaigns/urdfs.py FOLDER [--seed N] [--record]

The wheel `example-robot-data` (pip download, 131 MB) unpacked is such a folder. One line for each file: moments equal
(to what part of the largest), or why it is not imported. Of robots with more than 15 joints these are drawn at random
and the others welded, which keeps runs short. Exit code 1 where moments differ or there is a traceback.
"""

import argparse
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "exchange"))

from record import record
from rigid_robots import moments, with_motion

from ffrobot import FfrobotError
from ffrobot.exchange.urdf.import_urdf import import_urdf
from ffrobot.exchange.urdf.names import FORBIDDEN
from ffrobot.exchange.urdf.toml import toml_text
from ffrobot.present.progress import Display
from ffrobot.results.write import write_results
from ffrobot.run.solve import solve_scene

EQUAL = 1e-10  # of the largest moment
MOST = 15  # joints that move at once


def difference(urdf, folder, rng):
    """Largest difference of moments over the largest moment, and the number of joints."""
    imported = import_urdf(urdf, folder, {})
    by_scene_name = {joint["name"]: joint for joint in imported.scene["joint"]}
    called = {name: name.translate(FORBIDDEN) for name in imported.robot.joints}
    kinds = {name: by_scene_name[ours]["type"] for name, ours in called.items() if ours in by_scene_name}
    single = [name for name, kind in kinds.items() if kind in ("revolute", "prismatic")]
    drawn = set(rng.permutation(single)[:MOST].tolist())
    moving = [name for name in single if name in drawn]
    still = [name for name, joint in imported.robot.joints.items() if joint.type != "fixed" and name not in moving]
    motion = [{name: float(rng.uniform(-1, 1)) for name in moving} for _ in range(3)]
    scene = folder / "scene.toml"
    text = toml_text(without_friction(imported.scene, {called[name] for name in set(single) - set(moving)}))
    scene.write_text(with_motion(text, *({called[name]: part[name] for name in moving} for part in motion)))
    results = folder / "results.h5"
    with Display() as display:
        write_results(solve_scene(scene, display), results)
    expected = moments(urdf.read_bytes(), *({**part, **dict.fromkeys(still, 0.0)} for part in motion))
    with h5py.File(results) as file:
        found = np.array([file[f"inverse/joints/{called[name]}/moment"][0] for name in moving])
    wanted = np.array([expected[name] for name in moving])
    return np.abs(found - wanted).max() / np.abs(wanted).max(), len(moving)


def without_friction(keys, welded):
    """The keys of a scene whose joints have no friction, and some do not move at all."""
    dropped = {"viscous_friction", "coulomb_friction"}
    of_motion = dropped | {"axis", "position_limit", "moment_limit", "speed_limit"}
    joints = []
    for joint in keys["joint"]:
        still = joint["name"] in welded
        kept = {key: value for key, value in joint.items() if key not in (of_motion if still else dropped)}
        joints.append(kept | {"type": "weld"} if still else kept)
    return {**keys, "joint": joints}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--record", action="store_true")
    arguments = parser.parse_args()
    rng, equal, wrong, refused, worst = np.random.default_rng(arguments.seed), 0, 0, [], 0.0
    files = sorted(arguments.folder.rglob("*.urdf"))
    for urdf in files:
        with TemporaryDirectory() as folder:
            try:
                error, count = difference(urdf, Path(folder) / "scene", rng)
            except FfrobotError as refusal:
                refused.append(urdf)
                print(f"{urdf.name}: rejected: {str(refusal).splitlines()[0].partition(': ')[2]}")
                continue
            equal += error < EQUAL
            wrong += not error < EQUAL
            worst = max(worst, error)
            print(f"{urdf.name}: {count} joints, {error:.1e}", flush=True)
    print(f"{equal} equal, {wrong} different, {len(refused)} rejected; largest difference {worst:.1e}")
    if arguments.record:
        record(
            "urdfs",
            tried=f"{len(files)} URDFs of example-robot-data 6.0.0 through import and solve, all joints moving at once"
            f" (or {MOST} of them, drawn), motor torques against Newton and Euler on the XML",
            found=f"{equal} equal to {worst:.0e} of the largest moment, {wrong} different, {len(refused)} rejected, all"
            " with the reason: no link, nothing with mass that moves, inertias of zero or that no body has, a mimic of"
            " a joint that is not there; 0 × traceback",
        )
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
