"""Every URDF below a folder through `ffrobot import` and `ffrobot solve`: motor torques against another program.

    python tests/campaigns/urdfs.py FOLDER [--seed N] [--pinocchio PYTHON] [--fix] [--record]

The folder has wheels unpacked (pip download, no installation). One line for each different file: torques equal (to what
part of the largest), or why it is not imported. Of robots with more than 15 joints these are drawn at random and the
others welded, which keeps runs short. Right values are those of Newton and Euler on the XML, and of Pinocchio where
`--pinocchio` names a Python that has it. `--fix` imports with `--fix-inertia`, for which there is no comparison. Exit
code 1 where torques differ or there is a traceback.
"""

import sys
import traceback
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "exchange"))

from other_codes import pinocchio_dynamics
from record import options, record
from rigid_robots import moments, with_motion

from ffrobot import FfrobotError
from ffrobot.common.toml_files import toml_text
from ffrobot.exchange.urdf.import_urdf import import_urdf
from ffrobot.exchange.urdf.robot import FORBIDDEN
from ffrobot.present.console import Display
from ffrobot.results.write import write_results
from ffrobot.run.solve import solve_scene

EQUAL = 1e-10  # of the largest moment
MOST = 15  # joints that move at once


def difference(urdf, folder, rng, python):
    """Largest difference of torques over the largest torque, and the number of joints; `python` may have Pinocchio."""
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
    rights = [np.array([expected[name] for name in moving])]
    if python is not None:
        q, v, a = ([[part[name] for name in moving]] for part in motion)
        (answer,) = pinocchio_dynamics(python, urdf, moving, q=q, v=v, a=a, tau=a)["rnea"]
        rights.append(np.array(answer))
    return max(np.abs(found - wanted).max() / np.abs(wanted).max() for wanted in rights), len(moving)


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


def different_files(folder):
    """URDFs below `folder`, those of the same content once."""
    return list({path.read_bytes(): path for path in reversed(sorted(folder.rglob("*.urdf")))}.values())[::-1]


def main():
    parser = options(__doc__, seed=1)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--pinocchio", type=Path)
    parser.add_argument("--fix", action="store_true")
    arguments = parser.parse_args()
    rng, found, worst = np.random.default_rng(arguments.seed), Counter(), 0.0
    files = different_files(arguments.folder)
    for urdf in files:
        with TemporaryDirectory() as folder:
            try:
                if arguments.fix:
                    import_urdf(urdf, Path(folder) / "scene", {}, fix_inertia=True)
                    found["imported"] += 1
                    continue
                error, count = difference(urdf, Path(folder) / "scene", rng, arguments.pinocchio)
                outcome, says = "equal" if error < EQUAL else "different", f"{count} joints, {error:.1e}"
                worst = max(worst, error)
            except FfrobotError as refusal:
                outcome, says = "rejected", str(refusal).splitlines()[0].partition(": ")[2]
            except Exception:  # whatever is no message of the program
                outcome, says = "traceback", traceback.format_exc(limit=-1).replace("\n", " ")
        found[outcome] += 1
        print(f"{urdf.relative_to(arguments.folder)}: {outcome}: {says}", flush=True)
    print(", ".join(f"{number} {outcome}" for outcome, number in found.items()) + f"; largest difference {worst:.1e}")
    if arguments.record:
        record(
            "urdfs",
            tried=f"{len(files)} different URDFs of the packages in {arguments.folder.name} through import and solve,"
            f" all joints moving at once (or {MOST} of them, drawn), motor torques against Newton and Euler on the XML"
            + (" and Pinocchio" if arguments.pinocchio else ""),
            found=f"{found['equal']} equal to {worst:.0e} of the largest torque, {found['different']} different,"
            f" {found['rejected']} rejected with the reason; {found['traceback']} × traceback",
        )
    return 1 if found["different"] or found["traceback"] else 0


if __name__ == "__main__":
    sys.exit(main())
