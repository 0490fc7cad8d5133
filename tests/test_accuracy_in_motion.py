"""What a run says of its errors where the links of an arm in 3D bend and twist in motion, against rods.

References: each link as rigid rods with springs for bending in two planes and torsion between them, 5 and 10 of them,
extrapolated; Pinocchio's algorithms for the dynamics, SciPy's Radau for the time. They share nothing with the program.
"""

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from tables_3d import revolute, scene

import ffrobot

NAMES = ("a", "b", "c")
OUTPUTS = 60
# Links b, c: length, height, width (m), E, density. Reference: output, then the tips' deflections (mm).
ARMS = {
    "bends by 15 %": {
        "gravity": [-4.351, -8.453, -2.421], "damping": 5e-4, "first": (0.485, 0.573),
        "links": [(0.448, 0.00926, 0.0046, 70e9, 2700.0), (0.34, 0.00359, 0.00598, 207e9, 7850.0)],
        "axes": [[0, 0, 1], [-0.091, -0.191, -0.184], [0.148, -0.798, -0.491]],
        "start": [-0.123, -0.092, -0.866], "way": [0.864, 0.726, 0.469], "time": 0.663,
        "payload": (0.202, [0.0093, 0.0155, -0.0055],
                    [0.0005210166212404472, 0.0008278340551251875, 0.000617432691370036]),
        "tips": [(16, -2.1518, -14.206, -36.3125, -0.2552, -11.2486, -4.2586),
                 (45, -5.9622, -0.4266, 64.9143, -0.0447, 0.6291, 4.9906),
                 (51, -2.264, -4.1265, 39.8926, -0.0342, -3.2714, 2.9568),
                 (54, -0.2666, -6.6619, 12.0928, -0.0596, -5.7764, 0.6791),
                 (56, -0.1942, -7.7622, -8.805, -0.0774, -6.5447, -1.0212)],
    },
    "bends by 5 %": {
        "gravity": [8.631, -4.338, -1.709], "damping": 2e-4, "first": (0.459, 0.909),
        "links": [(0.306, 0.00928, 0.00691, 70e9, 2700.0), (0.31, 0.00484, 0.00594, 207e9, 7850.0)],
        "axes": [[0, 0, 1], [-0.099, 0.761, 0.743], [0.128, 0.25, -0.697]],
        "start": [-0.148, 0.743, 0.449], "way": [0.906, 0.6, 0.676], "time": 0.684,
        "payload": (0.746, [-0.0172, -0.0213, 0.0059],
                    [0.0022738049515889014, 0.0020194923399998875, 0.003067271739850193]),
        "tips": [(13, -0.4078, -13.1094, 5.103, -0.3103, -12.3486, 3.1278),
                 (38, -0.0438, 0.1756, -4.6454, -0.0133, 0.6255, -2.5495),
                 (56, -0.1172, -5.7389, -4.8931, -0.0643, -5.6975, -1.1196),
                 (58, -0.0773, -3.4232, -5.1064, -0.0249, -3.0935, -1.8777),
                 (60, -0.0503, -1.5717, -4.7356, -0.0098, -0.561, -2.1892)],
    },
}  # fmt: skip


def link(name, damping, length, height, width, E, density):
    damping = {"rayleigh": [0.0, damping]}
    return beam_link(length, rectangle(height, width), 16, E=E, nu=0.3, rho=density, name=name, damping=damping)


def solved(arm, **keys):
    """All joints along fifth-order polynomials from a static start."""
    length, mass = arm["first"]
    points = {"root": [0.0, 0.0, 0.0], "tip": [length, 0.0, 0.0]}
    first = {"mass": mass, "center": [length / 2, 0.01, -0.02], "inertia": [0.002, 0.01, 0.011], "points": points}
    flexible = [
        {"name": name, "link": link(name, arm["damping"], *of)}
        for name, of in zip("bc", arm["links"], strict=True)
    ]  # fmt: skip
    sides = [["ground", "a.root"], ["a.tip", "b.root"], ["b.tip", "c.root"]]
    s = f"(where(t < {arm['time']}, t/{arm['time']}, 1))"
    mass, center, inertia = arm["payload"]
    end = arm["time"] + 0.15
    tables = scene(
        [{"name": "a", "rigid": first}, *flexible],
        [revolute(name, *side, axis) for name, side, axis in zip(NAMES, sides, arm["axes"], strict=True)],
        {"name": "run", "kind": "pcid", "end": end, "output_step": end / OUTPUTS, "tolerance": 1e-7},
        gravity=arm["gravity"],
        payload=[{"point": "c.tip", "mass": mass, "center": center, "inertia": inertia}],
        initial={"state": "static", "joints": dict(zip(NAMES, arm["start"], strict=True))},
        trajectory=[
            {"name": f"of {name}", "joint": name, "value": f"{q} + {way}*(10*{s}**3 - 15*{s}**4 + 6*{s}**5)"}
            for name, q, way in zip(NAMES, arm["start"], arm["way"], strict=True)
        ],
    )
    return ffrobot.solve(ffrobot.make_scene(**tables | keys))


@pytest.mark.parametrize(
    ("name", "stiffened"), [("bends by 15 %", False), ("bends by 15 %", True), ("bends by 5 %", False)]
)
@pytest.mark.filterwarnings("ignore::ffrobot.FfrobotWarning")
def test_stated_errors_are_true_within_a_factor_of_five(name, stiffened):
    """Of the link that bends most, and of the other, which what the first does wrong moves and loads."""
    arm = ARMS[name]
    results, tips = solved(arm, geometric_stiffening=stiffened), np.array(arm["tips"])
    outputs = tips[:, 0].astype(int)
    for body, columns, of in zip("bc", (slice(1, 4), slice(4, 7)), arm["links"], strict=True):
        exact = tips[:, columns] / 1e3
        error = np.linalg.norm(results[f"run/points/{body}.tip/deflection"][outputs] - exact, axis=1).max()
        about = results.attributes(f"run/bodies/{body}")
        for true, stated in (
            (error / of[0], about["position_error"]),
            (error / np.linalg.norm(exact, axis=1).max(), about["relative_error"]),
        ):
            assert 0.2 < true / stated < 5
