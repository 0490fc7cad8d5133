"""Random arms on paths from rest to rest, behind compliant gears or within a path tolerance: voltages and replays.

    python tests/campaigns/tracked_arms.py [--count 30] [--seed 62] [--first 0] [--tolerance 1e-4]

One or two links in the plane, or a rod on a waist and a shoulder in 3D; 2 to 6 modes, payloads. With `--tolerance` (m)
gears are rigid, else they have 10 to 80 Hz. A line for each: least voltage, largest distance of the replay from the
planned motion (m), intervals and Newton steps, time of the processor; or the reason.
"""

import sys
import time
import warnings
from pathlib import Path

import numpy as np
from record import options

import ffrobot

sys.path += [str(Path(__file__).parents[1] / folder) for folder in ("", "cases", "mbs")]
from tables_3d import ORIGIN
from test_tracked_robots import geared, in_3d, patches, revolute, scene, septic, strip


def random_arm(rng, tolerance):
    """What it is, and its tables."""
    links, space = int(rng.integers(1, 3)), "plane" if rng.random() < 0.7 else "3D"
    f, payload = float(rng.uniform(10, 80)), float(rng.choice([0.0, rng.uniform(0.02, 0.2)]))
    if space == "3D":
        tables, inertias, tip = in_3d(), {"waist": 0.05, "shoulder": 0.05}, "arm.tip"
        what = "rod in 3D, 4 modes"
    else:
        modes, lengths = int(rng.integers(2, 7)), rng.uniform(0.5, 1.0, links)
        names, T = ["upper", "fore"][:links], float(rng.uniform(0.6, 1.0)) * links
        angles = [float(rng.uniform(-0.5, 0.5)), float(rng.uniform(0.8, 1.4))][:links]
        ends = [angle + float(rng.uniform(0.3, 0.7)) for angle in angles]
        points = [sum(L * np.exp(1j * q) for L, q in zip(lengths, of, strict=True)) for of in (angles, ends)]
        y = f"{points[0].imag} + {(points[1] - points[0]).imag}*{septic(T)}"
        x = {} if links == 1 else {"x": f"{points[0].real} + {(points[1] - points[0]).real}*{septic(T)}"}
        tip = f"{names[-1]}.tip"
        tables = scene(
            T, [0.0, 0.0], {"point": tip, "y": y, **x},
            body=[{"name": name, "link": strip(float(L), 0.006, 0.02, count=modes)}
                  for name, L in zip(names, lengths, strict=True)],
            joint=[revolute(f"to_{name}", before, f"{name}.root", motor=True)
                   for name, before in zip(names, ["ground", "upper.tip"], strict=False)],
            initial={"angles": dict(zip(names, angles, strict=True))},
            pzt=[patches(name, 0.02, count=max(4, modes)) for name in names],
        )  # fmt: skip
        inertias = {f"to_{name}": float(rng.uniform(0.02, 0.2)) for name in names}
        what = f"{links} links in the plane, {modes} modes"
    if payload:
        tables["payload"] = [{"point": tip, "mass": payload, "center": ORIGIN[: len(tables["gravity"])]}]
    tables["analysis"][0]["tolerance"] = 1e-4
    if tolerance:
        tables["analysis"][0]["path_tolerance"] = tolerance
        return f"{what}, payload {payload:.2f} kg", tables
    return f"{what}, {f:.0f} Hz, payload {payload:.2f} kg", geared(tables, f, **inertias)


def main():
    asked = options(__doc__, count=30, seed=62, first=0, tolerance=0.0).parse_args()
    warnings.simplefilter("ignore")
    for number in range(asked.first, asked.first + asked.count):
        what, tables = random_arm(np.random.default_rng([asked.seed, number]), asked.tolerance)
        model, began = ffrobot.make_scene(**tables), time.process_time()
        try:
            with ffrobot.solve(model) as results:
                point = f"points/{model.trajectory[0].point}/position"
                off = float(np.abs(results[f"replay/{point}"] - results[f"carried/{point}"]).max())
                about, of_run = (results.attributes(f"carried{part}") for part in ("/tracking", ""))
                found = f"{about['least_voltage']:.4g} V, {about['objective']}, replay off by {off:.2g} m"
                found += f", {of_run['steps']} intervals, {of_run['evaluations']} steps"
        except ffrobot.FfrobotError as error:
            found = f"{type(error).__name__}: {error}"
        print(f"{number}: {what}: {found}; {time.process_time() - began:.1f} s", flush=True)


if __name__ == "__main__":
    main()
