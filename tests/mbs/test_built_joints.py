"""Rotors behind gears: moments in closed form."""

import numpy as np
from mechanisms import make_model, pcid, relative, revolute
from oracle_runs import joint_forces, run
from rods import rod

from ffrobot.mbs.analysis.fcid import Fcid


def test_geared_two_link_arm_needs_the_moments_of_spong():
    """Spong, Modeling and control of elastic joint robots (1987), in the limit of stiff joints: rods with rotors.

    τ_1 gets J₁N₁² α̈_1 and, since the second rotor sits on the first link, J₂(α̈_1 + N₂ γ̈_2); τ_2 J₂N₂(α̈_1 + N₂ γ̈_2).
    """
    J1, N1, J2, N2 = 3e-3, 20.0, 1e-3, 15.0

    def inverse(first, second, kind="pcid"):
        model = make_model(
            [rod("a", 0.8, 3.0), rod("b", 0.6, 2.0)],
            joint=[revolute("O", "ground", "a.root", **first), revolute("A", "a.tip", "b.root", **second)],
            trajectory=[
                {"name": "first", "joint": "O", "value": "0.4+0.9*sin(2*t)"},
                {"name": "second", "joint": "A", "value": "-1.1+0.7*cos(3*t)"},
            ],
            initial={"angles": {"a": 0.4, "b": 0.0}},
        )
        if kind == "fcid":
            return run(model, Fcid(name="i", kind="fcid", shape="zero", end=1.0, output_step=0.01))
        return run(model, pcid(tolerance=1e-9))

    for kind in ("pcid", "fcid"):
        bare = inverse({}, {}, kind)
        geared = inverse({"gear_ratio": N1, "rotor_inertia": J1}, {"gear_ratio": N2, "rotor_inertia": J2}, kind)
        t = bare.time
        alpha, gamma = -3.6 * np.sin(2 * t), -6.3 * np.cos(3 * t)
        rotor = J2 * (alpha + N2 * gamma)
        for joint, expected in (("O", J1 * N1**2 * alpha + rotor), ("A", N2 * rotor)):
            added = joint_forces(geared, joint).motor - joint_forces(bare, joint).motor
            assert relative(added, expected) < 1e-9, (kind, joint)
