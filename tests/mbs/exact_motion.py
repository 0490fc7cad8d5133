"""A clamped beam in its modes with a point mass beside its tip, let go straight: no term of its motion left out.

Curvatures are those of the modes, R' = R k~ and r' = R e1 are integrated along it, and Lagrange's equations are written
for the points that it then consists of, their derivatives by differences.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

STEPS = 16


def tip_let_go(body, rho_A, mass, arm, gravity, time):
    """Displacement (T, 3) of the tip of a modal body at `time` (T,), its mass at `arm` (3,) from there."""
    h, n = body.length / STEPS, body.mode_count
    turned = np.array([body.interpolate(x).rotation for x in np.linspace(0.0, body.length, 2 * STEPS + 1)])
    to_middle, to_end = turned[1::2] - turned[:-1:2], turned[2::2] - turned[:-2:2]
    weights = np.full(STEPS + 1, h) * np.where(np.arange(STEPS + 1) % 2, 4 / 3, 2 / 3)
    weights[[0, -1]] /= 2
    m = np.append(rho_A * weights, mass)
    step = 1e-4 / np.sqrt(np.diag(body.stiffness))

    def matrices(turns, P):
        return Rotation.from_rotvec(np.einsum("kn,bn->bk", turns, P)).as_matrix()

    def places(P):
        R, r = np.broadcast_to(np.eye(3), (len(P), 3, 3)), np.zeros((len(P), 3))
        found = [r]
        for middle, end in zip(to_middle, to_end, strict=True):
            R_middle, R_end = R @ matrices(middle, P), R @ matrices(end, P)
            r = r + h / 6 * (R + 4 * R_middle + R_end)[..., 0]
            R = R_end
            found.append(r)
        return np.stack([*found, r + R @ arm], axis=1)

    def rates(_t, y):
        p, v = y[:n], y[n:]
        along = v * min(1e-3, 1e-3 / max(np.linalg.norm(v * np.sqrt(np.diag(body.stiffness))), 1e-12))
        r = places(np.concatenate([p + np.diag(step), p - np.diag(step), [p + along, p - along, p]]))
        J = (r[:n] - r[n : 2 * n]) / (2 * step[:, None, None])
        size = np.linalg.norm(along) / max(np.linalg.norm(v), 1e-300)
        bending = (r[-3] + r[-2] - 2 * r[-1]) / max(size, 1e-12) ** 2
        M = np.einsum("ixk,x,jxk->ij", J, m, J) + body.S_spin
        force = np.einsum("ixk,x,xk->i", J, m, gravity - bending) - body.stiffness @ p
        return np.concatenate([v, np.linalg.solve(M, force)])

    run = solve_ivp(rates, (0.0, time[-1]), np.zeros(2 * n), method="DOP853", t_eval=time, rtol=1e-7, atol=1e-12)
    return places(run.y[:n].T)[:, STEPS] - [body.length, 0.0, 0.0]
