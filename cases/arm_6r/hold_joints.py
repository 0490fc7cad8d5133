"""The arm as its joint controllers see it: joints go exactly where those of the rigid robot go, the links give.

    .venv/bin/python cases/arm_6r/hold_joints.py

Of scene.results.h5 it takes the joint coordinates of "straight" and writes held.toml beside it: the robot of
scene.toml, with these coordinates in place of the tool's path (held_JOINT.csv).
"""

import sys
from pathlib import Path

import numpy as np

from ffrobot import Results

HERE = Path(__file__).parent
TRAJECTORY = '[[trajectory]]\nname = "{0}"\njoint = "{0}"\nwaypoints = "held_{0}.csv"\n'
ANALYSIS = '[[analysis]]\nname = "held"\nkind = "pcid"\nend = 1.0\noutput_step = 0.005\ntolerance = 1e-6\n'


def main(folder: Path) -> None:
    """Write held.toml and its tables in the folder of scene.toml and scene.results.h5."""
    text = (folder / "scene.toml").read_text(encoding="utf-8")
    parts = [text[: text.index("[[trajectory]]")].rstrip() + "\n"]
    with Results(folder / "scene.results.h5") as results:
        time = results["straight/time"]
        for joint in (keys["name"] for keys in results.scene["joint"]):
            table = np.column_stack([time, results[f"straight/joints/{joint}/coordinate"]])
            np.savetxt(folder / f"held_{joint}.csv", table, fmt="%.17g", delimiter=",", header="t,value", comments="")
            parts.append(TRAJECTORY.format(joint))
    (folder / "held.toml").write_text("\n".join([*parts, ANALYSIS]), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
