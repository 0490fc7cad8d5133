"""What tests/campaigns/tolerance.py does with robots in space: it judges what their results files report."""

import json
import tempfile
from collections import defaultdict
from pathlib import Path

import h5py
import numpy as np
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
NEGLIGIBLE = 1e-3  # of the largest peak of a kind
NOTHING = 1e-9  # modal forces over forces
SLOW = 0.01  # rad in the time of a run: what the rate of a joint counts relative to at least
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


def largest(values):
    return float(np.abs(values).max())


def scales(file, exact, duration):
    """What the error of each history counts relative to, by kind and owner."""
    found = {}
    for kind, members in exact.items():
        peaks = {owner: largest(values) for owner, values in members.items()}
        found[kind] = {owner: max(peak, NEGLIGIBLE * max(peaks.values())) for owner, peak in peaks.items()}
    files = json.loads(file.attrs["modal_bodies"])
    for owner, own in found.get("bodies/modal_velocity", {}).items():
        with h5py.File(files[owner]["path"]) as body:
            mass, length = float(body["mass"][()]), float(body["length"][()])
        moving = file["exact/bodies"][owner]
        velocity, turning = (np.linalg.norm(moving[key], axis=1).max() for key in ("velocity", "angular_velocity"))
        fastest = max(velocity, turning * length)
        found["bodies/modal_velocity"][owner] = max(own, np.sqrt(mass) * fastest)
    forces = max(found["joints/reaction"].values())
    if max(found.get("bodies/modal_force", {}).values(), default=0.0) < NOTHING * forces:  # motors alone do it
        found["bodies/modal_force"] = dict.fromkeys(found.get("bodies/modal_force", {}), 0.0)
    rates = found.get("joints/rate", {})
    found["joints/rate"] = {owner: max(size, SLOW / duration) for owner, size in rates.items()}
    return found


def errors(found, exact, scale):
    """By kind, the largest error at any output, in parts of `scale`, and which history it is of."""
    return {
        kind: max(
            (largest(found[kind][owner] - values) / scale[kind][owner], owner) for owner, values in members.items()
        )
        for kind, members in exact.items()
        if max(scale[kind].values(), default=0.0) > 0
    }


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
            attributes = file[name].attrs
            run = {"integrator": by, "ran": attributes["integrator"], "tolerance": tolerance}
            run |= {"status": attributes["status"], "evaluations": int(attributes["evaluations"])}
            if run["status"] == "completed":
                of = errors(histories(file, name), exact, scale)
                run["errors"] = {kind: (float(f"{e / tolerance:.3g}"), owner) for kind, (e, owner) in of.items()}
            found["runs"].append(run)
    return found
