"""Chains of links on revolute joints in the plane, to 40 digits: what double precision loses in the recursion.

Absolute coordinates (R, θ, p) of each body, all joints and the path of the last tip as rows, the augmented matrix
solved by Gauss: nothing is shared with the core but the invariants of the links. With w = x + Φp in body axes as a
complex number and H_kl = ∫ρ Φ̄_k Φ_l = m_xy + iS̃, ∫ρ z̄ Φ = j + ih, all blocks of the mass matrix and Q_v are sums
of these (docs/theory.md; Shabana, Dynamics of Multibody Systems, ch. 5).

    python tests/mbs/exact_chain.py     the table of docs/developer/kernel.md, a few minutes
"""

from types import SimpleNamespace

import mpmath
import numpy as np
from mechanisms import relative
from mpmath import mp

from ffrobot.mbs import _core as r

DIGITS, GRAVITY = 40, (0.0, -9.81)
INVARIANTS = ("mass", "inertia", "first_moment", "S_bar", "h", "j", "S_tilde", "m_xy", "stiffness", "damping")
CHAINS = [
    (2, "simply-supported", 10),
    (2, "simply-supported", 50),
    (10, "simply-supported", 5),
    (2, "cantilever", 10),
    (2, "cantilever", 20),
    (2, "cantilever", 50),
    (20, "cantilever", 5),
]


def exact(x):
    """An array of numbers to 40 digits."""
    return np.vectorize(mp.mpf, otypes=[object])(np.asarray(x, dtype=float))


def rotation(theta):
    c, s = mp.cos(theta), mp.sin(theta)
    return np.array([[c, -s], [s, c]], dtype=object)


TURN = np.array([[0, -1], [1, 0]], dtype=object)  # A_θ = A TURN


def eigenmode_link(name, condition, modes, length=1.0, mass=1.0, EI=30.0):
    """An Euler–Bernoulli beam in its exact modes, any number of them.

    Integrals and slopes of the shapes: Blevins, Formulas for Natural Frequency and Mode Shape, table 8-1.
    """
    k = np.arange(1, modes + 1)
    sign, one = (-1.0) ** (k + 1), np.ones(modes)
    if condition == "simply-supported":
        beta = k * np.pi
        ends, slopes = (0 * one, 0 * one), (np.sqrt(2) * beta, -np.sqrt(2) * beta * sign)
        mean, moment = np.sqrt(2) * (1 + sign) / beta, np.sqrt(2) * sign / beta
    else:
        beta = np.array(
            [float(mpmath.findroot(lambda x: mpmath.cos(x) + mpmath.sech(x), (n - 0.5) * np.pi)) for n in k]
        )
        sigma = np.array([float((mpmath.cosh(x) + mpmath.cos(x)) / (mpmath.sinh(x) + mpmath.sin(x))) for x in beta])
        ends, slopes = (0 * one, 2 * sign), (0 * one, 2 * sign * sigma * beta)
        mean, moment = 2 * sigma / beta, 2 / beta**2
    zero, root = np.zeros((modes, modes)), np.sqrt(mass)
    points = {
        label: (np.array([at * length, 0.0]), np.array([0 * one, end / root]), slope / (length * root))
        for label, at, end, slope in zip(("root", "tip"), (0.0, 1.0), ends, slopes, strict=True)
    }
    return SimpleNamespace(
        name=name, mass=mass, inertia=mass * length**2 / 3, first_moment=np.array([mass * length / 2, 0.0]),
        stiffness=EI / (mass * length**3) * beta**4, damping=zero, S_bar=root * np.array([0 * one, mean]),
        h=root * length * moment, j=0 * one, S_tilde=zero, m_xy=np.eye(modes), points=points,
        n_modes=modes,
    )  # fmt: skip


class Invariants:
    """Those of a link, to 40 digits."""

    def __init__(self, body):
        for name in INVARIANTS:
            setattr(self, name, exact(getattr(body, name))[()])
        self.ends = {label: tuple(map(exact, body.points[label])) for label in ("root", "tip")}
        self.n = body.n_modes


def equations_of(body, A, theta_rate, p, p_rate, gravity):
    """M (3 + n, 3 + n) and Q (3 + n): quadratic velocity, elastic and damping forces, weight."""
    s = body.first_moment + body.S_bar @ p
    along, across = body.j + body.m_xy @ p, body.h - body.S_tilde @ p  # Re and Im of ∫ρ w̄ Φ
    M = np.zeros((3 + body.n, 3 + body.n), dtype=object)
    M[:2, :2] = body.mass * np.eye(2, dtype=int)
    M[:2, 2], M[:2, 3:] = A @ TURN @ s, A @ body.S_bar
    M[2, :2], M[3:, :2] = M[:2, 2], M[:2, 3:].T
    M[2, 2] = body.inertia + 2 * body.j @ p + p @ body.m_xy @ p
    M[2, 3:] = M[3:, 2] = across
    M[3:, 3:] = np.eye(body.n, dtype=int)
    Q = np.zeros(3 + body.n, dtype=object)
    Q[:2] = A @ (theta_rate**2 * s - 2 * theta_rate * TURN @ body.S_bar @ p_rate) + body.mass * gravity
    Q[2] = -2 * theta_rate * along @ p_rate + (A @ TURN @ s) @ gravity
    Q[3:] = theta_rate**2 * along + 2 * theta_rate * body.S_tilde @ p_rate + (A @ body.S_bar).T @ gravity
    Q[3:] -= body.stiffness * p + body.damping @ p_rate
    return M, Q


def accelerations(bodies, gravity, angle, rate, p, p_rate, target):
    """q̈ = (R̈, θ̈, p̈) of all bodies and λ (2,) of the path of the last tip, at angles and rates of the joints.

    Args:
        bodies: n links, each hinged with its root to the tip before, the first to the origin.
        gravity: (2,).
        angle, rate: (n,) of a body's frame against the section before it.
        p, p_rate: n arrays, the modal coordinates.
        target: (2,) second derivatives of the path.
    """
    with mp.workdps(DIGITS):
        gravity, size = exact(gravity), sum(3 + body.n_modes for body in bodies)
        K = np.zeros((size + 2 * len(bodies) + 2,) * 2, dtype=object)
        b = np.zeros(len(K), dtype=object)
        section, section_rate, first, row = mp.mpf(0), mp.mpf(0), 0, size
        before = None
        for body, q, v, p_k, v_k in zip(
            map(Invariants, bodies), angle, rate, map(exact, p), map(exact, p_rate), strict=True
        ):
            theta, theta_rate = section + mp.mpf(q), section_rate + mp.mpf(v)
            phi = body.ends["tip"][2]
            section, section_rate = theta + phi @ p_k, theta_rate + phi @ v_k
            A, here = rotation(theta), slice(first, first + 3 + body.n)
            K[here, here], b[here] = equations_of(body, A, theta_rate, p_k, v_k, gravity)
            at = {label: motion_of(body.ends[label], A, theta_rate, p_k, v_k) for label in body.ends}
            rows = slice(row, row + 2)
            K[rows, here], b[rows] = at["root"][0], -at["root"][1]
            if before is not None:
                K[rows, before[0]], b[rows] = -before[1][0], b[rows] + before[1][1]
            before, first, row = (here, at["tip"]), first + 3 + body.n, row + 2
        K[row:, before[0]], b[row:] = before[1][0], exact(target) - before[1][1]
        K[:size, size:] = K[size:, :size].T
        x = np.array(mp.lu_solve(mpmath.matrix(K.tolist()), mpmath.matrix(b.tolist())).tolist(), dtype=object)[:, 0]
        return x[:size], x[-2:]


def motion_of(end, A, theta_rate, p, p_rate):
    """Jacobian (2, 3 + n) of a point with respect to (R, θ, p), and its acceleration where these have none."""
    x, Phi, _ = end
    u = x + Phi @ p
    L = np.hstack([np.eye(2, dtype=int), (A @ TURN @ u)[:, None], A @ Phi])
    return L, A @ (2 * theta_rate * TURN @ Phi @ p_rate - theta_rate**2 * u)


def marker(position=(0.0, 0.0), translation=(), rotation=()):
    made = r.PlanarMarker()
    made.position, made.angle = np.array(position), 0.0
    made.Phi = np.vstack([np.reshape(translation, (2, -1)), np.reshape(rotation, (1, -1))])
    return made


def chain(links, coordinates=(None, None)):
    """Hinged links, as the core has them in the plane; rows are x and y of the last tip, or two coordinates in v."""
    bodies, tip = [], r.MarkerAt(len(links) - 1, 2)
    for k, link in enumerate(links):
        body, data = r.PlanarBody(), r.PlanarData()
        for name in INVARIANTS:
            setattr(data, name, getattr(link, name))
        ends = [link.points[label] for label in ("root", "tip")]
        still = marker(translation=np.zeros((2, link.n_modes)), rotation=np.zeros(link.n_modes))
        data.markers = [still, *(marker(*end) for end in ends)]
        body.name, body.joint, body.data, body.parent = link.name, r.JointKind.revolute, data, k - 1
        body.inboard_marker, body.parent_marker = 1, 2 if k else 0
        bodies.append(body)
    rows = [r.ConstraintModel() for _ in range(2)]
    for row, f, coordinate in zip(rows, np.eye(3)[:2], coordinates, strict=True):
        row.name, row.kind, row.f, row.a, row.b = "tip", r.ConstraintKind.point, f, r.MarkerAt(-1, 0), tip
        if coordinate is not None:
            row.kind, row.a, row.b, row.coordinate = r.ConstraintKind.coordinate, *[r.MarkerAt(0, 0)] * 2, coordinate
    return r.PlanarModel(bodies, [marker()], rows, [], np.array(GRAVITY))


def errors(count, condition, modes, seed):
    """Relative errors of λ and q̈ by the recursion in a random state."""
    rng, links = np.random.default_rng(seed), [eigenmode_link(f"b{k + 1}", condition, modes) for k in range(count)]
    model, number, target = chain(links), np.arange(1, modes + 1), np.array([0.6, -0.4])
    q, v = rng.standard_normal(model.n_q), rng.standard_normal(model.n_v)
    first = np.array(model.first)
    for _, at_q, _, at_v in first:  # higher modes bend less: 1 mm, 10 mm/s of the first
        q[at_q : at_q + modes] *= 1e-3 / number**2
        v[at_v : at_v + modes] *= 1e-2 / number
    p, p_rate = ([x[at : at + modes] for at in column] for x, column in ((q, first[:, 1]), (v, first[:, 3])))
    a, lambda_ = model.evaluate(q, v, target, None, None)
    frames = zip(model.frames(q, v), first[:, 3], strict=True)
    A = np.concatenate([[*frame.a[:2], frame.alpha[2], *a[at : at + modes]] for frame, at in frames])
    angle, rate = q[first[:, 0]], v[first[:, 2]]
    exact_a, exact_lambda = accelerations(links, GRAVITY, angle, rate, p, p_rate, target)
    return float(relative(lambda_, exact_lambda)), float(relative(A, exact_a))


def main():
    print("| chain | λ | q̈ |\n|---|---|---|")
    for count, condition, modes in CHAINS:
        states = 20 if count * modes < 50 else 4
        found = np.max([errors(count, condition, modes, seed) for seed in range(states)], axis=0)
        cells = " | ".join(f"{error:.0e}" for error in found)
        print(f"| {count} links, {condition}, {modes} modes; {states} states | {cells} |", flush=True)


if __name__ == "__main__":
    main()
