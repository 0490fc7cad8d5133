"""A clamped Kirchhoff rod along x that bends and twists without limit: neither stretch nor shear, the load at its tip.

Integrated from the tip to the root, so that loads which follow the section there need no iteration.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation


def torsion_constant(a, b):
    """Of a rectangle (Timoshenko and Goodier, Theory of Elasticity, §109)."""
    a, b = max(a, b), min(a, b)
    n = np.arange(1, 400, 2)
    return a * b**3 * (1 / 3 - 64 / np.pi**5 * b / a * np.sum(np.tanh(n * np.pi * a / 2 / b) / n**5))


def rigidities(height, width, E, nu):
    """GJ, EI_y, EI_z of a rectangle, height along y."""
    GJ = E / 2 / (1 + nu) * torsion_constant(height, width)
    return np.array([GJ, E * height * width**3 / 12, E * width * height**3 / 12])


def tip_of(stiffness, length, force, moment, arm=(0.0, 0.0, 0.0), follows=False):
    """Displacement (3,) of the tip and rotation vector (3,) of its section.

    stiffness (3,) as `rigidities`; force (at `arm` from the tip, in its section) and moment (3,) in axes of the root,
    or of the section at the tip where the load `follows`.
    """
    force, moment, arm = (np.asarray(v, dtype=float) for v in (force, moment, arm))

    def back(R_tip, f, m):
        def rates(_s, y):
            R = Rotation.from_quat(y[3:7])
            k = R.inv().apply(y[7:]) / stiffness
            v, e0, e1 = y[3:6], y[6], R.apply([1.0, 0.0, 0.0])
            return np.concatenate([e1, 0.5 * (e0 * k + np.cross(v, k)), [-0.5 * v @ k], -np.cross(e1, f)])

        start = np.concatenate([np.zeros(3), R_tip.as_quat(), m])
        end = solve_ivp(rates, (length, 0.0), start, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
        return Rotation.from_quat(end[3:7]), -end[:3]

    def loaded(R_tip):
        f, m = (force, moment) if not follows else (R_tip.apply(force), R_tip.apply(moment))
        return back(R_tip, f, m + np.cross(R_tip.apply(arm), f))

    def root(psi):
        return loaded(Rotation.from_rotvec(psi))[0].as_rotvec()

    R_tip = Rotation.from_rotvec(np.zeros(3) if follows else fsolve(root, np.zeros(3), xtol=1e-12))
    R_root, r = loaded(R_tip)
    return R_root.inv().apply(r) - [length, 0.0, 0.0], (R_root.inv() * R_tip).as_rotvec()
