"""An arm in 3D of rigid rods with bending springs between them, driven by moments: a reference that shares nothing.

Each bar is a row of rods, the first and the last half as long, with universal springs EI/rod about the bar's y and z
between them (no twist). Minimal coordinates, bodies by Jacobians, SciPy integrates. A bar's compliance is the midpoint
rule of ∫ (L − x)²/EI dx: by 1/(4 springs²) too small.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root

X, Y, Z = np.eye(3)


def skew(a):
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def turned(axis, angle):
    """Rodrigues' formula, axis of length 1."""
    W = skew(axis)
    return np.eye(3) + np.sin(angle) * W + (1 - np.cos(angle)) * W @ W


@dataclass
class Body:
    """On a hinge at `at` of the body before it, turned about `axis`; no mass between two hinges of one place."""

    at: np.ndarray
    axis: np.ndarray
    mass: float = 0.0
    center: np.ndarray = None
    inertia: np.ndarray = None  # about the center
    spring: float = 0.0


def bar(length, height, width, springs, at, axis, payload=0.0, E=70e9, density=2700.0):
    """Bodies of a bar along x: height along y, width along z; `payload` (kg) at its end."""
    rod, area = length / springs, height * width
    ends = [rod / 2, *[rod] * (springs - 1), rod / 2]
    found = [Body(at, axis)]
    for k, long in enumerate(ends):
        mass = density * area * long
        inertia = mass / 12 * np.diag([height**2 + width**2, long**2 + width**2, long**2 + height**2])
        if k:
            found.append(Body(ends[k - 1] * X, Y, spring=E * height * width**3 / 12 / rod))
            found.append(Body(np.zeros(3), Z, spring=E * width * height**3 / 12 / rod))
        found[-1].mass, found[-1].center, found[-1].inertia = mass, long / 2 * X, inertia
    if payload:
        last = found[-1]
        total = last.mass + payload
        center = (last.mass * last.center + payload * ends[-1] * X) / total
        for m, place in ((last.mass, last.center), (payload, ends[-1] * X)):
            d = place - center
            last.inertia = last.inertia + m * (d @ d * np.eye(3) - np.outer(d, d))
        last.mass, last.center = total, center
    return found


class RodChain:
    """`bodies` from the ground on; `tip` (3,) on the last; `driven` numbers of the hinges with motors."""

    def __init__(self, bodies, tip, driven, gravity=(0.0, 0.0, -9.81)):
        self.bodies, self.tip, self.driven, self.g = bodies, tip, driven, np.array(gravity)
        self.K = np.array([body.spring for body in bodies])

    def _walk(self, q, v):
        """Of each body with mass: A, W = ω~, r, J (6, n) and J̇v (6,) at its center; and all of the tip."""
        n, r, A, W = len(q), np.zeros(3), np.eye(3), np.zeros((3, 3))
        J, bias = np.zeros((6, n)), np.zeros(6)
        for k, body in enumerate(self.bodies):
            r, J, bias = self._carried(r, J, bias, W, A @ body.at)
            axis = A @ body.axis
            J[3:, k] = axis
            bias[3:] += W @ axis * v[k]
            W = W + skew(axis * v[k])
            A = A @ turned(body.axis, q[k])
            if body.mass:
                yield body, A, W, *self._carried(r, J, bias, W, A @ body.center)
        yield None, A, W, *self._carried(r, J, bias, W, A @ self.tip)

    @staticmethod
    def _carried(r, J, bias, W, d):
        S, J, bias = skew(d), J.copy(), bias.copy()
        J[:3] -= S @ J[3:]
        bias[:3] += W @ (W @ d) - S @ bias[3:]
        return r + d, J, bias

    def equations(self, q, v, damping=0.0):
        """M and what is left of the forces without motors: M v̇ = Q + moments."""
        M, Q = np.zeros((len(q), len(q))), -self.K * (q + damping * v)
        for body, A, W, _, J, bias in self._walk(q, v):
            if body is not None:
                inertia = A @ body.inertia @ A.T
                M += body.mass * J[:3].T @ J[:3] + J[3:].T @ inertia @ J[3:]
                Q += body.mass * J[:3].T @ (self.g - bias[:3])
                omega = np.array([W[2, 1], W[0, 2], W[1, 0]])
                Q -= J[3:].T @ (inertia @ bias[3:] + W @ (inertia @ omega))
        return M, Q

    def place(self, q):
        """Of the tip."""
        return list(self._walk(q, np.zeros_like(q)))[-1][3]

    def at_rest(self, place, guess):
        """Q in equilibrium with the tip at `place`, near `guess` of the driven hinges, and the moments that hold it."""
        n, k = len(self.bodies), len(self.driven)
        x = np.zeros(n + k)
        x[self.driven] = guess

        def left(x):
            Q = self.equations(x[:n], np.zeros(n))[1]
            Q[self.driven] += x[n:]
            return np.concatenate([Q, self.place(x[:n]) - place])

        found = root(left, x, tol=1e-12)
        assert found.success, found.message
        return found.x[:n], found.x[n:]

    def moved(self, moments, times, q, damping):
        """Places (T, 3) of the tip from rest at q; moments(t) of the motors; springs damped by `damping` s."""

        def slope(t, y):
            M, Q = self.equations(*np.split(y, 2), damping)
            Q[self.driven] += moments(t)
            return np.concatenate([y[len(q) :], np.linalg.solve(M, Q)])

        y = np.concatenate([q, 0 * q])
        run = solve_ivp(slope, (times[0], times[-1]), y, "DOP853", times, rtol=1e-6, atol=1e-8)
        assert run.success
        return np.array([self.place(row[: len(q)]) for row in run.y.T])
