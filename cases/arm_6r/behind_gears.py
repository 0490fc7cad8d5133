"""The arm with compliant gears: its motors go where controllers hold them, the joints behind them where gears let them.

    .venv/bin/python cases/arm_6r/behind_gears.py

Of scene.results.h5 it takes the joint coordinates of "straight" and writes beside it, from scene.toml:

* gears.toml: motors where joints with rigid gears would be (motor_JOINT.csv);
* swift.toml: motors through three of these postures (pick, halfway, place) on S-curves, past the second without a stop;
* slower.toml: the same, as slow as one ZVD shaper makes it;
* shaped.toml: as swift.toml, with a ZVD shaper for the two lowest vibrations of the robot.
"""

import re
import sys
from pathlib import Path

import numpy as np

from ffrobot import Results

HERE = Path(__file__).parent
GEARS = {  # stiffness N·m/rad, damping N·m·s/rad, ratio, inertia of the rotor kg·m²: of strain wave gears of this size
    "waist": (3e4, 8.0, 121, 1.2e-4),
    "shoulder": (3e4, 8.0, 121, 1.2e-4),
    "elbow": (1.6e4, 4.0, 101, 6e-5),
    "forearm_roll": (5e3, 0.6, 101, 1.5e-5),
    "wrist_pitch": (5e3, 0.6, 101, 1.5e-5),
    "wrist_roll": (5e3, 0.4, 101, 1e-5),
}
HALFWAY = 0.45  # s, of the path in scene.toml
SWIFT, SLOWER = 0.4, 0.466  # s, of each leg
LAW = 'profile = "s-curve"\nduration = {}\nblend = 0.4'
ANALYSIS = '[[analysis]]\nname = "{}"\nkind = "pcid"\nend = {}\noutput_step = 0.0025\ntolerance = 1e-5\n'


def geared(text: str) -> str:
    """The robot of scene.toml without its path, with gears; dry friction, on the motors' side of them, is left out."""
    text = re.sub(r"coulomb_friction = .*\n", "", text[: text.index("[[trajectory]]")])
    for joint, (stiffness, damping, ratio, inertia) in GEARS.items():
        keys = f"stiffness = {stiffness}\ndamping = {damping}\ngear_ratio = {ratio}\nrotor_inertia = {inertia}\n"
        text = text.replace(f'name = "{joint}"\ntype = "revolute"\n', f'name = "{joint}"\ntype = "revolute"\n{keys}')
    return text


def main(folder: Path) -> None:
    """Write the scenes and tables in the folder of scene.toml and scene.results.h5."""
    robot = geared((folder / "scene.toml").read_text(encoding="utf-8"))
    with Results(folder / "scene.results.h5") as results:
        time = results["straight/time"]
        angles = {joint: results[f"straight/joints/{joint}/coordinate"] for joint in GEARS}
    rows = [0, int(np.abs(time - HALFWAY).argmin()), -1]
    via = {joint: f"via = {angle[rows].tolist()}\n" for joint, angle in angles.items()}
    for joint, angle in angles.items():
        table = np.column_stack([time, angle])
        np.savetxt(folder / f"motor_{joint}.csv", table, fmt="%.17g", delimiter=",", header="t,value", comments="")
    ways = {
        "gears": {joint: f'waypoints = "motor_{joint}.csv"' for joint in GEARS},
        "swift": {joint: via[joint] + LAW.format(SWIFT) for joint in GEARS},
        "slower": {joint: via[joint] + LAW.format(SLOWER) for joint in GEARS},
        "shaped": {joint: via[joint] + LAW.format(SWIFT) + '\nshaper = { kind = "zvd", modes = 2 }' for joint in GEARS},
    }
    for name, way in ways.items():
        paths = [f'[[trajectory]]\nname = "{joint}"\nmotor = "{joint}"\n{keys}\n' for joint, keys in way.items()]
        text = "\n".join([robot, *paths, ANALYSIS.format(name, 1.0 if name == "gears" else 1.2)])
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
