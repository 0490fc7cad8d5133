"""The motions of this case: python make_motions.py writes plan.csv and, with jitter, logged.csv."""

import numpy as np

from ffrobot.mbs.fields.paths import averaged_step

JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
START, CHANGE = np.array([0.0, -1.2, 1.0, -0.5, 0.5, 0.0]), np.array([1.2, 0.5, -0.5, 0.6, -0.8, 0.9])  # rad
TIMES = (0.7, 0.2, 0.05)  # s, over which a step is averaged: an S-curve of 0.95 s
STEP, JITTER = 0.008, 0.001  # s


def write(name: str, times: np.ndarray, rows: np.ndarray) -> None:
    """A table with the names of the joints."""
    header = ",".join(["t", *(f"{joint}_joint" for joint in JOINTS)])
    np.savetxt(name, np.column_stack([times, rows]), fmt="%.6f", delimiter=",", header=header, comments="")


times = STEP * np.arange(round(sum(TIMES) / STEP) + 1)
rows = START + CHANGE * averaged_step(np.array(TIMES)).sample(times)
write("plan.csv", times, rows)
late = times + np.append(0.0, np.random.default_rng(5).normal(0.0, JITTER, len(times) - 1))
write("logged.csv", late, rows)
