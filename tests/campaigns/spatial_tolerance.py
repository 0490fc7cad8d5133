"""What tests/campaigns/tolerance.py does with robots in space: it judges what their results files report."""

import json
import tempfile
from collections import defaultdict
from pathlib import Path

import h5py
import numpy as np
from judging import largest_errors, nothing_of_rounding, peaks, record_of_run, with_body_velocity, with_slow_rates
from spatial_robots import random_spatial_scene

import ffrobot
from ffrobot.common.errors import FfrobotError

EXACT = 1e-10  # the least that a scene may ask for
RUNS = {  # powers of ten between which tolerances are drawn, and how many
    "dop853": (-7, -3, 3),
    "dopri5": (-7, -3, 2),
    "radau": (-7, -2, 2),
    "auto": (-7, -2, 2),
}
MOST_STEPS = 60_000
KINDS = {
    "bodies": ("position", "modal", "modal_velocity", "modal_force"),
    "points": ("position", "deflection"),
    "joints": ("coordinate", "rate", "moment", "reaction", "reaction_moment"),
    "trajectories": ("force", "moment"),
}


def histories(file, name):
    """What one analysis reports, by kind and owner: (T,) or (T, columns)."""
    found = defaultdict(dict)
    for group, kinds in KINDS.items():
        for owner, part in file[name].get(group, {}).items():
            for kind in kinds:
                if kind in part and part[kind].size:
                    found[f"{group}/{kind}"][owner] = part[kind][()]
    return found


def scales(file, exact, duration):
    """What the error of each history counts relative to, by kind and owner."""
    found = peaks(exact)
    files = json.loads(file.attrs["modal_bodies"])
    for owner, own in found.get("bodies/modal_velocity", {}).items():
        with h5py.File(files[owner]["path"]) as body:
            mass, length = float(body["mass"][()]), float(body["length"][()])
        moving = file["exact/bodies"][owner]
        velocity, turning = (np.linalg.norm(moving[key], axis=1).max() for key in ("velocity", "angular_velocity"))
        found["bodies/modal_velocity"][owner] = with_body_velocity(own, mass, max(velocity, turning * length))
    nothing_of_rounding(found, ("bodies/modal_force",), max(found["joints/reaction"].values()))
    found["joints/rate"] = with_slow_rates(found.get("joints/rate", {}), duration)
    return found


def try_spatial_robot(seed, number, integrators=tuple(RUNS)):
    """As `try_robot` of tolerance.py."""
    rng = np.random.default_rng([seed, number, 1])
    drawn = [(by, 10**power) for by, (low, high, n) in RUNS.items() for power in rng.uniform(low, high, n)]
    runs = [(f"{by}{k}", float(f"{at:.2g}"), by) for k, (by, at) in enumerate(drawn) if by in integrators]
    found = {"seed": seed, "number": number, "space": True, "runs": []}
    try:
        found["kind"], scene = random_spatial_scene(seed, number, [("exact", EXACT, "dop853"), *runs], MOST_STEPS)
        results = ffrobot.solve(scene)
    except FfrobotError as error:
        return found | {"left out": str(error)}
    with tempfile.TemporaryDirectory() as folder, h5py.File(results.save(Path(folder) / "robot.h5")) as file:
        if file["exact"].attrs["status"] != "completed":
            return found | {"left out": str(file["exact"].attrs["status"])}
        exact = histories(file, "exact")
        scale = scales(file, exact, scene.analysis[0].end)
        for name, tolerance, by in runs:
            done = file[name].attrs
            run = record_of_run(
                by, done["integrator"], tolerance, done["status"], done["evaluations"],
                lambda name=name: largest_errors(histories(file, name), exact, scale),
            )  # fmt: skip
            found["runs"].append(run)
    return found
