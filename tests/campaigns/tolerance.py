"""What `tolerance` promises, tried on random robots: every integrator, every output of every reported history.

    python tests/campaigns/tolerance.py found.jsonl [--space] [--count 200] [--seeds 1 2] [--record]

Robots that are in the file already are not run again. Each is run by every integrator at random tolerances. Errors are
differences to a run at 3e-11, in parts of the history's peak and in tolerances. Histories smaller than a thousandth of
the largest of their kind count in parts of that. Modal velocities count relative to √m times the velocity of their
body where that is larger than their own peak, rates of joints to 0.01 rad in the time of the run.
"""

import argparse
import json
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
from judging import (
    largest,
    largest_errors,
    nothing_of_rounding,
    peaks,
    record_of_run,
    with_body_velocity,
    with_slow_rates,
)
from random_robots import random_scene
from record import record
from spatial_tolerance import EXACT as EXACT_IN_SPACE
from spatial_tolerance import RUNS as RUNS_IN_SPACE
from spatial_tolerance import try_spatial_robot

from ffrobot.actuation.patches.voltages import solve_voltages
from ffrobot.common.errors import FfrobotError
from ffrobot.mbs.analysis.forward import run_forward
from ffrobot.mbs.analysis.pcid import run_pcid
from ffrobot.mbs.analysis.replay import ActuatorSet
from ffrobot.mbs.model.system import MechanismSystem
from ffrobot.mbs.quantities.observation import joint_forces, point_motion, trajectory_force
from ffrobot.mbs.solve.initial_state import undeformed_state
from ffrobot.mbs.solve.vibration import vibrations
from ffrobot.run.prepare import prepare
from ffrobot.run.watcher import Watcher

EXACT = 3e-11
RUNS = {  # powers of ten between which tolerances are drawn, those that an integrator's order is made for; how many;
    # steps that a run may take: those of low order are many and cheap
    "dop853": (-8, -3, 3, 15_000),
    "dopri5": (-7, -3, 2, 15_000),
    "radau": (-7, -2, 2, 15_000),
    "generalized-alpha": (-3.5, -2, 1, 100_000),
    "auto": (-7, -2, 2, 15_000),
}
MOST_RADIANS = 1_500.0  # of the highest vibration in a run: keeps it short
MOST_STEPS_EXACT = 60_000


def solved(prepared, **keys):
    """The outcome of the scene's one analysis with other keys."""
    analysis = prepared.scene.analysis[0].model_copy(update=keys)
    if analysis.kind == "pcid":
        return run_pcid(prepared.model, analysis, False, lambda _: True)
    return run_forward(prepared.model, analysis, None, ActuatorSet(), lambda _: True)


def prepared_robot(seed, number):
    """Its kind and what is to be solved, with an end before the highest vibration has gone through `MOST_RADIANS`."""
    kind, scene = random_scene(seed, number)
    prepared = prepare(scene, Watcher())
    analysis, model = scene.analysis[0], prepared.model
    system = MechanismSystem(model, [*model.joints, *model.trajectories])
    top = float(vibrations(system, undeformed_state(system)).frequency[-1])
    shorter = min(1.0, MOST_RADIANS / (top * analysis.end))
    times = {"end": shorter * analysis.end, "output_step": shorter * analysis.output_step}
    shortened = prepared.scene.model_copy(update={"analysis": (analysis.model_copy(update=times),)})
    return kind, replace(prepared, scene=shortened)


def histories(prepared, outcome):
    """What is reported, by kind and name: (T,) or (T, columns)."""
    found = defaultdict(dict)
    sections = {None: (np.zeros(len(outcome.time)),) * 2}  # angle and rate at each point, of the ground
    for body in outcome.assembly.model.bodies:
        columns = outcome.coordinates(body.name)
        q, v = outcome.q[:, columns], outcome.v[:, columns]
        found["position"][body.name], found["angle"][body.name] = q[:, :2], q[:, 2]
        for label, point in body.points.items():
            name = f"{body.name}.{label}"
            motion = point_motion(outcome, name)
            found["position"][name] = motion.position
            sections[name] = q[:, 2] + q[:, 3:] @ point.rotation, v[:, 2] + v[:, 3:] @ point.rotation
            if body.n_modes:
                found["deflection"][name] = motion.deflection
        if body.n_modes:
            found["modal"][body.name], found["modal velocity"][body.name] = q[:, 3:], v[:, 3:]
            if outcome.F_p is not None:
                F_p = outcome.F_p[:, outcome.modal_columns(body.name)]
                found["modal force"][body.name] = F_p
                if body.name in prepared.patches:
                    found["voltage"][body.name] = solve_voltages(prepared.patches[body.name], F_p).required
    for joint in prepared.scene.joint:
        forces = joint_forces(outcome, joint.name)
        found["reaction"][joint.name] = forces.reaction
        if joint.type == "revolute":
            first, second = (sections[None if end == "ground" else end] for end in joint.between)
            found["joint coordinate"][joint.name] = second[0] - first[0]
            found["joint rate"][joint.name] = second[1] - first[1]
        if forces.motor is not None:
            found["moment"][joint.name] = forces.motor
    held = {c.owner for c in outcome.assembly.constraints if c.is_trajectory}
    for trajectory in prepared.scene.trajectory:
        if trajectory.name in held:
            kind = "force" if trajectory.point else "moment"
            found[kind][f"of {trajectory.name}"] = trajectory_force(outcome, trajectory.name)
    return found


def scales(outcome, exact):
    """What the error of each history counts relative to, by kind and name; zero where it is but rounding."""
    found = peaks(exact)
    for body in outcome.assembly.model.bodies:
        v = outcome.v[:, outcome.coordinates(body.name)]
        fastest = max(largest(np.hypot(v[:, 0], v[:, 1])), largest(v[:, 2]) * (body.length or 0.0))
        if body.n_modes:
            own = found["modal velocity"][body.name]
            found["modal velocity"][body.name] = with_body_velocity(own, body.mass, fastest)
    found["joint rate"] = with_slow_rates(found.get("joint rate", {}), float(outcome.time[-1] - outcome.time[0]))
    nothing_of_rounding(found, ("modal force", "voltage"), max(found["reaction"].values()))
    return found


def try_robot(seed, number, integrators=tuple(RUNS)):
    """Record of one robot: by integrator and tolerance, steps, evaluations and the largest error of each kind."""
    rng = np.random.default_rng([seed, number, 1])
    found = {"seed": seed, "number": number, "runs": []}
    try:
        found["kind"], prepared = prepared_robot(seed, number)
        reference = solved(prepared, tolerance=EXACT, integrator="dop853", max_steps=MOST_STEPS_EXACT)
    except FfrobotError as error:
        return found | {"left out": str(error)}
    if reference.status != "completed":
        return found | {"left out": reference.status}
    exact = histories(prepared, reference)
    scale = scales(reference, exact)
    for integrator, (low, high, count, most_steps) in RUNS.items():
        powers = rng.uniform(low, high, count)  # drawn for all, so that they do not hang on which are asked for
        for power in powers if integrator in integrators else ():
            tolerance = float(f"{10**power:.2g}")
            outcome = solved(prepared, tolerance=tolerance, integrator=integrator, max_steps=most_steps)
            run = record_of_run(
                integrator, outcome.statistics.integrator.name, tolerance, outcome.status,
                outcome.statistics.evaluations,
                lambda outcome=outcome: largest_errors(histories(prepared, outcome), exact, scale),
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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path, help="a JSON record per robot; those in it are not run again")
    parser.add_argument("--space", action="store_true", help="robots in space")
    parser.add_argument("--count", type=int, default=200, help="robots of each seed")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--integrators", choices=list(RUNS), nargs="+")
    parser.add_argument("--record", action="store_true", help="write the counts, for docs/developer/stress_tests.md")
    asked = parser.parse_args()
    of_all, exact, attempt = (
        (RUNS_IN_SPACE, EXACT_IN_SPACE, try_spatial_robot) if asked.space else (RUNS, EXACT, try_robot)
    )
    text = asked.file.read_text() if asked.file.exists() else ""
    wanted = [(seed, number) for seed in asked.seeds for number in range(asked.count)]
    records = {(one["seed"], one["number"]): one for one in map(json.loads, text.splitlines())}
    records = {key: one for key, one in records.items() if key in wanted}
    with asked.file.open("a") as file:
        for key in wanted:
            if key not in records:
                records[key] = attempt(*key, asked.integrators or tuple(of_all))
                file.write(json.dumps(records[key]) + "\n")
                file.flush()
    for integrator, robots, done, too_long, outside, worst, kind in counts(records.values()):
        found = f"{outside} outside, {100 * (1 - outside / done):.1f} % kept, worst {worst:.2f} times ({kind})"
        print(f"{integrator}: {done} runs of {robots} robots, {too_long} too long; {found}")
        if asked.record:
            low, high, *_ = of_all[integrator]
            where = " in space" if asked.space else ""
            tried = (
                f'`integrator = "{integrator}"`: {done} runs of {robots} random arms, chains and loops{where},'
                f" tolerances 1e{low:g} … 1e{high:g}, every output of every history against {exact:g}"
            )
            record(f"tolerance{'-space' if asked.space else ''}-{integrator}", tried=tried, found=found)


if __name__ == "__main__":
    main()
