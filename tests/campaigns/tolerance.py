"""What `tolerance` promises, tried on random robots: every integrator, every output of every reported history.

    python tests/campaigns/tolerance.py found.jsonl [--space] [--count 200] [--seeds 1 2] [--record]

Robots that are in the file already are not run again. Each is run by every integrator at random tolerances. Errors are
differences to a run at 1e-10, in parts of the history's peak and in tolerances. Histories smaller than a thousandth of
the largest of their kind count in parts of that. Modal velocities count relative to √m times the velocity of their
body where that is larger than their own peak, rates of joints to 0.01 rad in the time of the run. Histories are arrays
(T,) or (T, columns) by kind and by name.
"""

import json
import tempfile
from collections import defaultdict
from pathlib import Path

import h5py
import numpy as np
from random_robots import random_scene
from record import options, record
from robots_3d import random_scene_in_3d

import ffrobot
from ffrobot.common.errors import FfrobotError
from ffrobot.mbs.linear.vibration import vibrations_of
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.posture.start import undeformed_posture
from ffrobot.run.solve import prepare_scene
from ffrobot.run.watcher import Watcher

EXACT = 1e-10  # the least that a scene may ask for
RUNS_IN_SPACE = {  # powers of ten between which tolerances are drawn, those that an integrator's order is made for; how
    "dop853": (-7, -3, 3),  # many
    "dopri5": (-7, -3, 2),
    "radau": (-7, -2, 2),
    "auto": (-7, -2, 2),
}
RUNS = {
    "dop853": (-8, -3, 3),
    "dopri5": (-7, -3, 2),
    "radau": (-7, -2, 2),
    "generalized-alpha": (-3.5, -2, 1),
    "auto": (-7, -2, 2),
}
MOST_RADIANS = 1_500.0  # of the highest vibration in a planar run: keeps it short
MOST_STEPS = 100_000
NEGLIGIBLE = 1e-3  # of the largest peak of a kind
NOTHING = 1e-9  # modal forces over forces
SLOW = 0.01  # rad in the time of a run: what the rate of a joint counts relative to at least
KINDS = {
    "bodies": ("position", "angle", "modal", "modal_velocity", "modal_force"),
    "points": ("position", "deflection"),
    "joints": ("coordinate", "rate", "moment", "reaction", "reaction_moment"),
    "trajectories": ("force", "moment"),
    "pzt": ("required_voltage",),
}


def largest(values):
    return float(np.abs(values).max())


def peaks(exact):
    """What the error of each history counts relative to: its peak, or a share of the largest of its kind."""
    found = {}
    for kind, members in exact.items():
        of = {name: largest(values) for name, values in members.items()}
        found[kind] = {name: max(peak, NEGLIGIBLE * max(of.values())) for name, peak in of.items()}
    return found


def nothing_of_rounding(scale, kinds, forces):
    """Sets to zero what only rounding leaves of modal forces where motors alone do it."""
    if max(scale.get(kinds[0], {}).values(), default=0.0) < NOTHING * forces:
        for kind in kinds:
            scale[kind] = dict.fromkeys(scale.get(kind, {}), 0.0)


def largest_errors(found, exact, scale):
    """By kind, the largest error at any output, in parts of `scale`, and which history it is of."""
    errors = {}
    for kind, members in exact.items():
        of = {
            name: largest(found[kind][name] - values) / scale[kind][name]
            for name, values in members.items()
            if scale[kind][name] > 0
        }
        if of:
            errors[kind] = max((error, name) for name, error in of.items())
    return errors


def record_of_run(asked, ran, tolerance, status, evaluations, errors):
    """One run of a robot; errors(), of runs that are completed, counts in tolerances here."""
    run = {"integrator": asked, "ran": ran, "tolerance": tolerance, "status": status, "evaluations": int(evaluations)}
    if status == "completed":
        run["errors"] = {kind: (float(f"{error / tolerance:.3g}"), name) for kind, (error, name) in errors().items()}
    return run


def planar_scene(seed, number, analyses):
    """Its kind and scene, with an end before the highest vibration has gone through `MOST_RADIANS`."""
    kind, scene = random_scene(seed, number)
    model, (analysis,) = prepare_scene(scene, Watcher()).model, scene.analysis
    top = float(vibrations_of(MultibodySystem(model), 0.0, undeformed_posture(model).q).frequency[-1])
    shorter = min(1.0, MOST_RADIANS / (top * analysis.end))
    times = {"end": shorter * analysis.end, "output_step": shorter * analysis.output_step, "max_steps": MOST_STEPS}
    copies = [times | {"name": name, "tolerance": at, "integrator": by} for name, at, by in analyses]
    return kind, scene.model_copy(update={"analysis": tuple(analysis.model_copy(update=keys) for keys in copies)})


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
    """What the error of each history counts relative to, by kind and owner; zero where it is but rounding."""
    found = peaks(exact)
    files = json.loads(file.attrs["modal_bodies"])
    for owner, own in found.get("bodies/modal_velocity", {}).items():
        if owner not in files:  # rigid
            continue
        with h5py.File(files[owner]["path"]) as body:
            mass, length = float(body["mass"][()]), float(body["length"][()])
        moving = file["exact/bodies"][owner]
        velocity, turning = (np.abs(moving[key][()]).max() for key in ("velocity", "angular_velocity"))
        found["bodies/modal_velocity"][owner] = max(own, np.sqrt(mass) * max(velocity, turning * length))
    nothing_of_rounding(found, ("bodies/modal_force", "pzt/required_voltage"), max(found["joints/reaction"].values()))
    found["joints/rate"] = {name: max(peak, SLOW / duration) for name, peak in found.get("joints/rate", {}).items()}
    return found


def try_robot(seed, number, *, space=False):
    """Record of one robot: by integrator and tolerance, steps, evaluations and the largest error of each kind."""
    rng, of_all = np.random.default_rng([seed, number, 1]), RUNS_IN_SPACE if space else RUNS
    drawn = [(by, 10**power) for by, (low, high, n) in of_all.items() for power in rng.uniform(low, high, n)]
    runs = [(f"{by}{k}", float(f"{at:.2g}"), by) for k, (by, at) in enumerate(drawn)]
    found = {"seed": seed, "number": number, "space": space, "runs": []}
    try:
        of_runs = [("exact", EXACT, "dop853"), *runs]
        made = random_scene_in_3d(seed, number, of_runs, MOST_STEPS) if space else planar_scene(seed, number, of_runs)
        found["kind"], scene = made
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


def counts(records):
    """By integrator: robots judged, completed runs, those that took too many steps, those outside, the worst error and
    its kind."""
    by_integrator = defaultdict(list)
    for one in records:
        for run in one["runs"]:
            by_integrator[run["integrator"]].append(run | {"robot": (one["seed"], one["number"])})
    for integrator, runs in by_integrator.items():
        done = [run for run in runs if run["status"] == "completed"]
        robots = len({run["robot"] for run in done})
        worst = [max((error, kind) for kind, (error, _) in run["errors"].items()) for run in done]
        yield integrator, robots, len(done), len(runs) - len(done), sum(error > 1 for error, _ in worst), *max(worst)


def main():
    parser = options(__doc__, count=200)
    parser.add_argument("file", type=Path, help="a JSON record per robot; those in it are not run again")
    parser.add_argument("--space", action="store_true", help="robots in space")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    asked = parser.parse_args()
    of_all = RUNS_IN_SPACE if asked.space else RUNS
    text = asked.file.read_text() if asked.file.exists() else ""
    wanted = [(seed, number) for seed in asked.seeds for number in range(asked.count)]
    records = {(one["seed"], one["number"]): one for one in map(json.loads, text.splitlines())}
    records = {key: one for key, one in records.items() if key in wanted}
    with asked.file.open("a") as file:
        for key in wanted:
            if key not in records:
                records[key] = try_robot(*key, space=asked.space)
                file.write(json.dumps(records[key]) + "\n")
                file.flush()
    for integrator, robots, done, too_long, outside, worst, kind in counts(records.values()):
        found = f"{outside} outside, {100 * (1 - outside / done):.1f} % kept, worst {worst:.2f} times ({kind})"
        print(f"{integrator}: {done} runs of {robots} robots, {too_long} too long; {found}")
        if asked.record:
            low, high, _ = of_all[integrator]
            where = " in space" if asked.space else ""
            tried = (
                f'`integrator = "{integrator}"`: {done} runs of {robots} random arms, chains and loops{where},'
                f" tolerances 1e{low:g} … 1e{high:g}, every output of every history against {EXACT:g}"
            )
            record(f"tolerance{'-space' if asked.space else ''}-{integrator}", tried=tried, found=found)


if __name__ == "__main__":
    main()
