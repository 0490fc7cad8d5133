"""Steps of runs whose motors bear large loads, against those of the same runs without them.

    python tests/campaigns/borne_loads.py [--count 50] [--seed 1] [--record]

Chains of one to three flexible links in the plane and in 3D, some behind gears, on joint paths of up to 20 rad/s, with
loads of 1 to 1e5 N m on their joints, which motors bear: links move as they do without. Where a load is quicker than
all else steps have to see it: those that steps of a third of its pulse or of its sine take are free.
"""

import time
import warnings

import numpy as np
from record import options, record

import ffrobot
from ffrobot.common.errors import FfrobotError

AIM = 3.0  # times the steps without the load
LIMIT = 60_000  # steps, of a run with the load


def random_scenes(seed, number):
    """What it is in words, how many steps its loads need, and the same scene without and with them."""
    rng = np.random.default_rng([seed, number])
    links, in_space = int(rng.integers(1, 4)), bool(rng.random() < 0.5)
    gear, gravity = str(rng.choice(["none", "rigid", "compliant"], p=[0.6, 0.25, 0.15])), 9.81 * (rng.random() < 0.5)
    rate, size, end = float(rng.choice([0.0, 0.1, 1.0, 20.0])), float(10 ** rng.uniform(0, 5)), 0.2
    outer = float(rng.uniform(0.015, 0.03))
    link = {
        "material": {"youngs_modulus": 70e9, "density": 2700.0, "poissons_ratio": 0.3},
        "geometry": {"kind": "beam", "length": float(rng.uniform(0.3, 0.8)),
                     "section": {"shape": "tube", "outer": outer, "inner": 0.8 * outer}},
        "mesh": {"elements": 6}, "reference": {"condition": "cantilever"},
        "modes": {"count": 3, "family": ["in-plane-bending", "out-of-plane-bending"][: 1 + in_space]},
        "damping": {"ratio": float(rng.choice([0.0, 0.01]))},
    }  # fmt: skip
    built = {"none": {}, "rigid": {"gear_ratio": 50.0, "rotor_inertia": 1e-4, "motor": True},
             "compliant": {"gear_ratio": 50.0, "rotor_inertia": 1e-4, "stiffness": 1e4, "damping": 5.0,
                           "motor": True}}[gear]  # fmt: skip
    pulse = bool(rng.random() < 0.5)
    shape = f"exp(-((t - {end / 2 + 3.7e-4!r})/0.002)**2)" if pulse else f"sin({float(rng.uniform(5, 40))!r}*t)"
    ends = ["ground", *(f"b{k}.tip" for k in range(links))]
    followed = "motor" if gear == "compliant" else "joint"
    path = f"{rate!r}*t" if rng.random() < 0.5 else f"{0.5 * rate * end!r}*(1 - cos({np.pi / end!r}*t))"
    axis = {"axis": [0.0, 0.0, 1.0]} if in_space else {}
    scene = {
        "name": "borne", "space": "spatial" if in_space else "planar",
        "gravity": [0.0, -gravity, 0.0] if in_space else [0.0, -gravity],
        "body": [{"name": f"b{k}", "link": link} for k in range(links)],
        "joint": [{"name": f"j{k}", "type": "revolute", "between": [ends[k], f"b{k}.root"]} | axis | built
                  for k in range(links)],
        "trajectory": [{"name": f"t{k}", followed: f"j{k}", "value": path} for k in range(links)],
        "initial": {"state": str(rng.choice(["static", "undeformed"]))},
        "analysis": [{"name": "a", "kind": "pcid", "end": end, "output_step": end / 10, "max_steps": LIMIT}],
    }  # fmt: skip
    loads = [{"joint": f"j{k}", "moment": f"{size!r}*{shape}"} for k in range(links)]
    words = f"{links} links, {scene['space']}, gear {gear}, g {gravity:.3g}, {rate:g} rad/s, {size:.3g} N m"
    words += f", {'pulse' if pulse else 'sine'}, {scene['initial']['state']}"
    return words, 30 if pulse else 12, scene, scene | {"load": loads}


def steps_of(scene):
    """Steps (those rejected, too) and integrator; or the error."""
    try:
        with ffrobot.solve(ffrobot.make_scene(**scene)) as results:
            of = results.attributes("a")
            return int(of["steps"] + of["rejected"]), str(of["integrator"])
    except FfrobotError as error:
        return None, str(error)[-200:]


def main():
    warnings.simplefilter("ignore", ffrobot.FfrobotWarning)
    asked = options(__doc__, count=50, seed=1).parse_args()
    ratios, failed = [], 0
    for number in range(asked.count):
        words, needed, without, loaded = random_scenes(asked.seed, number)
        began = time.process_time()
        before, now = steps_of(without), steps_of(loaded)
        if before[0] is None or now[0] is None:
            failed += before[0] is not None  # else links break without the load, too
            print(f"{number:3d} {words}: {before} {now}", flush=True)
            continue
        ratios.append(now[0] / (before[0] + needed))
        mark = "!!" if ratios[-1] > AIM else ""
        taken = time.process_time() - began
        print(f"{number:3d} {ratios[-1]:7.2f} {mark} {before} {now} {taken:.1f} s {words}", flush=True)
    beyond = sum(ratio > AIM for ratio in ratios)
    print(f"{failed} failed, {beyond} beyond {AIM:g}, median {np.median(ratios):.2f}, most {max(ratios):.2f}")
    if asked.record:
        record(
            "borne_loads",
            tried=f"steps of {len(ratios)} runs whose motors bear loads of 1 to 1e5 N m, against the runs without",
            found=f"{failed} ended early; ratio median {np.median(ratios):.2f}, most {max(ratios):.2f}, {beyond} above"
            f" {AIM:g}",
        )


if __name__ == "__main__":
    main()
