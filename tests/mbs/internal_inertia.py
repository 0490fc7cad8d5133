"""The sign of det M_i of arms that rest on their path but for its time: by points of mass and differences, in NumPy.

Links are Euler–Bernoulli beams with cantilever modes in closed form, joints turn relative to their ends, so that motors
work on joint angles alone: M_i = M_pp − M_pq J_q⁻¹ J_p with the Jacobian J of the output.
"""

import numpy as np
from scipy.optimize import brentq

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(24)
POINTS, WEIGHTS = 0.5 * (POINTS + 1), 0.5 * WEIGHTS
STEP = 1e-6


class Modes:
    """Of a cantilever of length and mass one at `x` (P,), the last of which is 1: shapes (count, P), slopes at 1."""

    def __init__(self, count, x):
        k = np.arange(count)
        self.roots = np.array([brentq(lambda z: np.cos(z) + 1 / np.cosh(z), np.pi * j, np.pi * (j + 1)) for j in k])
        z, one = self.roots[:, None] * x, self.roots[:, None]
        s = (np.cosh(one) + np.cos(one)) / (np.sinh(one) + np.sin(one))
        growing = np.exp(z) * (1 - s) / 2 + np.exp(-z) * (1 + s) / 2  # cosh z − s sinh z, without what cancels
        self.shapes = growing - np.cos(z) + s * np.sin(z)
        self.slopes = (one * (np.sinh(one) - s * np.cosh(one) + np.sin(one) + s * np.cos(one)))[:, 0]


class Chain:
    """Links (length, height, width) one behind the other in the plane, without gravity."""

    def __init__(self, links, count, payload, output, *, E=70e9, rho=2700.0, rotor=None):
        """`rotor`: inertia (kg·m²) and gear ratio at the joint of the second of two links, on the tip of the first."""
        self.links, self.output, self.rotor = links, output, rotor
        self.modes, self.count = Modes(count, np.append(POINTS, 1.0)), count
        masses = [rho * L * h * w for L, h, w in links]
        self.masses = np.concatenate([np.append(m * WEIGHTS, 0.0) for m in masses])
        self.masses[-1] = payload
        self.omega = np.concatenate([self.modes.roots**2 * np.sqrt(E * h * h / 12 / rho) / L**2 for L, h, _ in links])
        self.sizes = np.repeat(1 / np.sqrt(masses), count)

    def points(self, q, p):
        """Of all masses (points, 2); the last one is the tip."""
        amplitudes = (p * self.sizes).reshape(len(self.links), -1, self.count)
        x, found, root, angle = np.append(POINTS, 1.0), [], 0j, 0.0
        for (L, *_), (of,), turn in zip(self.links, amplitudes, q, strict=True):
            angle += turn
            at = root + np.exp(1j * angle) * (L * x + 1j * (of @ self.modes.shapes))
            root, angle = at[-1], angle + np.arctan(of @ self.modes.slopes / L)
            found.append(at)
        at = np.concatenate(found)
        return np.column_stack([at.real, at.imag])

    def jacobian(self, q, p, count=None):
        """(points, 2, joints + modes), or of the first `count` of these."""
        x = np.concatenate([q, p])
        steps = STEP * np.concatenate([np.ones(len(q)), 1 / self.sizes])
        split = len(q)
        moved = []
        for k, step in enumerate(steps[:count]):
            ends = [x + sign * step * (np.arange(len(x)) == k) for sign in (1, -1)]
            moved.append(
                (self.points(*np.split(ends[0], [split])) - self.points(*np.split(ends[1], [split]))) / (2 * step)
            )
        return np.stack(moved, axis=-1)

    def angles(self, t, p, q):
        """Joint angles of the path at t (s) by Newton's method from q, with deflections p."""
        wanted = self.output(t)
        rows = slice(2 - len(wanted), 2)
        while True:
            off = wanted - self.points(q, p)[-1, rows]
            if np.abs(off).max() < 1e-13:
                return q
            q = q + np.linalg.solve(self.jacobian(q, p, len(q))[-1, rows], off)

    def of_rotor(self, p, inertia, ratio):
        """What a rotor adds to M: its moment on the link that carries it; the motor takes that on its own joint."""
        length, first = self.links[0][0], np.s_[: self.count]
        slopes = self.sizes[first] * self.modes.slopes / length
        carrier = np.zeros(2 + len(p))
        carrier[0] = 1.0
        carrier[2 : 2 + self.count] = slopes / (1 + (slopes @ p[first]) ** 2)
        spin = carrier + ratio * (np.arange(len(carrier)) == 1)
        return inertia * np.outer(carrier, spin)

    def inertia(self, t, q, h=1e-3):
        """det M_i at time t where links carry what the path asks of them at rest relative to it, and q there."""
        p, before = np.zeros(len(self.omega)), np.inf
        while np.abs(self.sizes * (p - before)).max() > 1e-7:
            before = p
            q = self.angles(t, p, q)
            around = [self.points(self.angles(t + s * h, p, q), p) for s in (-1, 0, 1)]
            acceleration = (around[0] - 2 * around[1] + around[2]) / h**2
            J = self.jacobian(q, p)
            p = -np.einsum("i,ijp,ij->p", self.masses, J[:, :, len(q) :], acceleration) / self.omega**2
        M = np.einsum("i,ija,ijb->ab", self.masses, J, J)
        if self.rotor is not None:
            M += self.of_rotor(p, *self.rotor)
        n, rows = len(q), slice(J.shape[1] - len(q), None)
        of_tip = J[-1, rows]
        return np.linalg.det(M[n:, n:] - M[n:, :n] @ np.linalg.solve(of_tip[:, :n], of_tip[:, n:])), q


def changes(chain, q, end, samples=61):
    """Times (s) at which det M_i changes its sign along the path, from joint angles q at its start."""
    times, values = np.linspace(0.0, end, samples), []
    for t in times:
        value, q = chain.inertia(t, q)
        values.append(value)
    at = np.flatnonzero(np.diff(np.sign(values)))
    return times[at] + np.diff(times)[at] * np.abs(values)[at] / (np.abs(values)[at] + np.abs(values)[at + 1])
