"""What `integrator = "auto"` costs against the best single integrator, over 36 varied runs.

    python tests/campaigns/choice.py [--repeat 3]

Times are those of the processor, the shortest of `--repeat`, or of as many more as two seconds allow, all integrators
in turn. Evaluations are those of the equations of motion. A run by a single integrator ends with four times the
evaluations of "auto", which always completes. docs/benchmarks.md has a table of such runs.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path += [str(Path(__file__).parents[1] / folder) for folder in ("mbs",)]

from links import ANGLES, TIP, arm, arm_links, quintic, ritz_link
from mechanisms import forward, make_model, pcid, revolute
from oracle_runs import run

from ffrobot.mbs.inversion.motors_only import MotorsOnly

SINGLE = ("dop853", "radau", "dopri5")
EVALUATIONS = 7  # of a step, of an integrator that takes few
AIM = 1.5
SHARE, MOST = 2.0, 40  # s of all integrators of a run, rounds: short runs scatter more
REST = {"angles": ANGLES, "state": "static"}
JOLT = {"name": "tip", "point": "link2.tip", "x": f"{TIP[0]!r}-0.5*t**2", "y": f"{TIP[1]!r}+0.3*t**2"}
STIFF, SOFT = {"EI": 3000.0, "modes": 8, "extra": 2}, {"EI": 10.0, "modes": 2}
MANY = {"EI": 300.0, "modes": 12, "extra": 2}


def damped(ratio, **keys):
    return arm_links(damping_ratio=ratio, **keys)


def heavy(ratio):
    """Ten times the mass on the second link, as a payload spread over it."""
    return [
        ritz_link("link1", "simply-supported", EI=120.0, damping_ratio=ratio),
        ritz_link("link2", "cantilever", EI=120.0, mass=10.0, damping_ratio=ratio),
    ]


def chain(count, EI, damping, **keys):
    """Cantilever links hinged one to the next, hanging out to the side."""
    names = [f"link{k + 1}" for k in range(count)]
    links = [ritz_link(name, "cantilever", length=0.6, EI=EI, damping_ratio=damping) for name in names]
    ends = ["ground", *(f"{name}.tip" for name in names)]
    joints = [revolute(f"j{k}", ends[k], f"{name}.root") for k, name in enumerate(names)]
    return make_model(links, joint=joints, initial={"angles": {n: 0.3 - 0.4 * k for k, n in enumerate(names)}}, **keys)


def slider_crank(EI, damping):
    rod = ritz_link("rod", "simply-supported", length=0.5, EI=EI, damping_ratio=damping)
    crank = ritz_link("crank", "cantilever", length=0.15, mass=0.2, EI=100 * EI, modes=1)
    pin = ritz_link("slider", "cantilever", length=0.05, mass=0.3, modes=0)
    turn = 1.0
    return make_model(
        [crank, rod, pin],
        gravity=(0.0, 0.0),
        joint=[
            revolute("O", "ground", "crank.root", motor=True),
            revolute("A", "crank.tip", "rod.root"),
            revolute("B", "rod.tip", "slider.root"),
            {"name": "guide", "type": "prismatic", "between": ("ground", "slider.root"), "axis": (1.0, 0.0)},
        ],
        initial={"state": "static", "angles": {"crank": turn, "rod": -float(np.arcsin(0.3 * np.sin(turn)))}},
        trajectory=[{"name": "turn", "joint": "O", "value": quintic(turn, turn + 6.0)}],
    )


def inverse_of(model):
    return lambda **keys: run(model, pcid(**keys))


def motion_of(model, end):
    return lambda **keys: run(model, forward(end=end, **keys))


def replay_of(model, apply):
    source = run(model, pcid(tolerance=1e-6, integrator="dop853"))
    keys_of = {"actuation": "inverse", "apply": apply}
    return lambda **keys: run(model, forward(**keys_of, **keys), source)


def motors_only_replay_of(model):
    source = run(model, MotorsOnly(name="inverse", kind="motors-only", end=1.0, output_step=0.01))
    keys_of = {"actuation": "inverse", "apply": "joints"}
    return lambda **keys: run(model, forward(**keys_of, **keys), source)


def runs():
    """Name, what makes the run (called only where it is needed), and its tolerances."""
    every, common = (1e-2, 1e-4, 1e-6), (1e-2, 1e-4)
    section = {"motors": "section", "initial": REST}
    yield "arm, undeformed, smooth path", lambda: inverse_of(arm()), every
    yield "arm, static, smooth path", lambda: inverse_of(arm(initial=REST)), every
    yield "arm, static, step in acceleration", lambda: inverse_of(arm(initial=REST, trajectory=[JOLT])), common
    yield "arm, damped, undeformed", lambda: inverse_of(arm(damped(0.01))), common
    yield (
        "arm, damped, static, step in acceleration",
        lambda: inverse_of(arm(damped(0.01), initial=REST, trajectory=[JOLT])),
        (1e-4,),
    )
    yield "stiff links, static", lambda: inverse_of(arm(arm_links(**STIFF), initial=REST)), every
    yield "stiff links, damped, undeformed", lambda: inverse_of(arm(damped(0.02, **STIFF))), common
    yield "12 modes, static", lambda: inverse_of(arm(arm_links(**MANY), initial=REST)), common
    yield "soft links, undeformed", lambda: inverse_of(arm(arm_links(**SOFT))), every
    yield "heavy second link, static", lambda: inverse_of(arm(heavy(0.0), initial=REST)), (1e-4,)
    yield "heavy second link, damped, undeformed", lambda: inverse_of(arm(heavy(0.01))), common
    yield "slider-crank", lambda: inverse_of(slider_crank(30.0, 0.0)), common
    yield "slider-crank, stiff, damped", lambda: inverse_of(slider_crank(3000.0, 0.02)), common
    yield "chain of two, soft", lambda: motion_of(chain(2, 10.0, 0.0), 0.3), (1e-4,)
    yield "chain of three, damped", lambda: motion_of(chain(3, 100.0, 0.02), 0.3), common
    yield "forward run, all forces", lambda: replay_of(arm(damped(0.01), initial=REST), "trajectory"), (1e-4,)
    yield "forward run, torques alone", lambda: replay_of(arm(damped(0.01), **section), "joints"), common
    yield "forward run under motors-only torques", lambda: motors_only_replay_of(arm(damped(0.02), **section)), every


def measured(solved, tolerance, repeat):
    """By integrator: seconds, evaluations, what ran; None where it did not complete. All of them in turn."""
    found, names, limits = {}, ["auto", *SINGLE], {"max_steps": 400_000}
    began, done = time.process_time(), 0
    while done < repeat or (done < MOST and time.process_time() - began < SHARE):
        first = done % len(names)
        done += 1
        for integrator in (*names[first:], *names[:first]):
            before = time.process_time()
            outcome = solved(tolerance=tolerance, integrator=integrator, **limits)
            seconds, counts = time.process_time() - before, outcome.statistics
            if outcome.status != "completed":
                names.remove(integrator)
                continue
            if integrator == "auto":
                limits = {"max_steps": max(4 * counts.evaluations // EVALUATIONS, 2000)}
            now = {"seconds": seconds, "evaluations": counts.evaluations, "ran": counts.integrator.name}
            now |= {"reason": counts.integrator.reason}
            found[integrator] = min(found.get(integrator, now), now, key=lambda one: one["seconds"])
    return found


def table(records):
    """Lines that show each run: time and evaluations of auto over the least of the others."""
    yield "| run | tolerance | auto takes | best | time over best | evaluations over best |"
    yield "|---|---|---|---|---|---|"
    for one in records:
        best, of_time, of_evaluations = against_best(one)
        run = f"{one['run']} | {one['tolerance']:g} | {one['auto']['ran']}"
        yield f"| {run} | {best} | {of_time:.2f} | {of_evaluations:.2f} |"


def against_best(one):
    """The fastest single integrator, and time and evaluations of auto over the least of all."""
    single = {name: one[name] for name in SINGLE if name in one}
    best = min(single, key=lambda name: single[name]["seconds"])
    fewest = min(found["evaluations"] for found in single.values())
    return best, one["auto"]["seconds"] / single[best]["seconds"], one["auto"]["evaluations"] / fewest


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=3)
    asked, records = parser.parse_args(), []
    for name, make, tolerances in runs():
        solved = make()
        for tolerance in tolerances:
            records.append({"run": name, "tolerance": tolerance} | measured(solved, tolerance, asked.repeat))
            print(name, tolerance, records[-1]["auto"], flush=True)
    print("\n".join(table(records)))
    times = sorted((against_best(one)[1], one["run"], one["tolerance"]) for one in records)
    median, (worst, of, tolerance) = times[len(times) // 2][0], times[-1]
    slow = sum(over > AIM for over, *_ in times)
    print(f"{slow} above {AIM} times the best single one; median {median:.2f}, worst {worst:.2f} ({of}, {tolerance:g})")


if __name__ == "__main__":
    main()
