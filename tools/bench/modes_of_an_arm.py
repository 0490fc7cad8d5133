"""How many modes an arm needs: joint moments and the tip with default modes, and others, against all 80 of the mesh.

    python tools/bench/modes_of_an_arm.py [--payload 2] [--repeat 5]

Two steel links (1 m, 15 x 25 mm, undamped, the first simply supported, the second a cantilever), a payload, both joints
on quintics, from equilibrium under gravity. Reference: all 80 eigenmodes that 40 elements have, of which five are kept
with the static flexibility of the others: integrated once, in 109 s, all gave the same to 1e-3 mm and 1e-6 of moments.
A row for each choice of `count` and `modes`, attachment modes unless "alone": largest error of the tip (mm) and of the
moments at O and A (of their peaks), steps, and solver time as a ratio to ten eigenmodes alone, smallest of repetitions
in turn. Nothing is asserted.
"""

import argparse

import numpy as np

import ffrobot

SWING = "(10*t**3 - 15*t**4 + 6*t**5)"
PLAIN = {"attachment_modes": False}
BEFORE = "ten eigenmodes alone"
ROWS = {
    BEFORE: ({"count": 10, **PLAIN}, None),
    "default": ({}, None),
    "default, auto": ({}, "auto"),
    "count 4": ({"count": 4}, None),
    "count 10": ({"count": 10}, None),
    "count 10, auto": ({"count": 10}, "auto"),
    "count 40, auto": ({"count": 40}, "auto"),
    "count 20, modes = 3": ({"count": 20}, 3),
    "count 80, modes = 2": ({"count": 80}, 2),
    "count 80, modes = 5": ({"count": 80}, 5),
}
REFERENCE = ({"count": 80, **PLAIN}, 5)


def arm(modes, kept, payload, tolerance=1e-6):
    """The scene with `[modes]` of both links, of which bodies keep `kept`."""
    keep = {} if kept is None else {"modes": kept}
    conditions = {"link1": "simply-supported", "link2": "cantilever"}
    link = {
        "name": "link",
        "material": {"youngs_modulus": 2.068427e11, "density": 7850.0, "poissons_ratio": 0.3},
        "geometry": {"kind": "beam", "length": 1.0, "section": {"shape": "rectangle", "height": 0.015, "width": 0.025}},
        "mesh": {"elements": 40},
        "modes": {"family": "in-plane-bending", **modes},
    }
    return ffrobot.make_scene(
        name="arm",
        gravity=[0.0, -9.81],
        body=[
            {"name": name, "link": link | {"reference": {"condition": how}}, **keep} for name, how in conditions.items()
        ],
        joint=[
            {"name": "O", "type": "revolute", "between": ["ground", "link1.root"]},
            {"name": "A", "type": "revolute", "between": ["link1.tip", "link2.root"]},
        ],
        payload=[{"point": "link2.tip", "mass": payload}],
        initial={"state": "static"},
        trajectory=[
            {"name": "first", "joint": "O", "value": f"0.1 + 0.6*{SWING}"},
            {"name": "second", "joint": "A", "value": f"1.0 - 0.8*{SWING}"},
        ],
        analysis=[{"name": "swing", "kind": "pcid", "end": 1.0, "output_step": 0.002, "tolerance": tolerance}],
    )


def quantities(scene):
    """Tip (T, 2) m, moments (T, 2) N·m, steps and solver time by name, and how far the tip is bent, m."""
    with ffrobot.solve(scene) as results:
        bent = np.linalg.norm(results["swing/points/link2.tip/deflection"], axis=1).max()
        moments = np.column_stack([results[f"swing/joints/{joint}/moment"] for joint in "OA"])
        return results["swing/points/link2.tip/position"], moments, results.attributes("swing"), bent


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--payload", type=float, default=2.0, help="kg")
    parser.add_argument("--repeat", type=int, default=5)
    asked = parser.parse_args()
    true_tip, true_moments, _, bent = quantities(arm(*REFERENCE, asked.payload, 1e-8))
    peaks = np.abs(true_moments).max(axis=0)
    print(f"second link bent by {1e3 * bent:.1f} mm at its tip; moments up to {peaks[0]:.1f}, {peaks[1]:.1f} N m")
    found, seconds = {}, {name: np.inf for name in ROWS}
    for _ in range(asked.repeat):
        for name, (modes, kept) in ROWS.items():
            found[name] = quantities(arm(modes, kept, asked.payload))
            seconds[name] = min(seconds[name], found[name][2]["wall_seconds"])
    reference = seconds[BEFORE]
    print(f"{'modes':22s} {'tip (mm)':>9s} {'O':>9s} {'A':>9s} {'steps':>7s} {'time':>6s}")
    for name, (tip, moments, statistics, _) in found.items():
        off = 1e3 * np.linalg.norm(tip - true_tip, axis=1).max()
        O, A = np.abs(moments - true_moments).max(axis=0) / peaks  # noqa: E741
        print(f"{name:22s} {off:9.2e} {O:9.1e} {A:9.1e} {statistics['steps']:7d} {seconds[name] / reference:6.2f}")


if __name__ == "__main__":
    main()
