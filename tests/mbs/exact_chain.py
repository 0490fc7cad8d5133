"""Chains of links on revolute joints in the plane, to 40 digits: what double precision loses in the recursion.

Absolute coordinates (R, θ, p) of each body, all joints and the path of the last tip as rows, the augmented matrix
solved by Gauss: nothing is shared with the core but the invariants of the links. With w = x + Φp in body axes as a
complex number and H_kl = ∫ρ Φ̄_k Φ_l = m_xy + iS̃, ∫ρ z̄ Φ = j + ih, all blocks of the mass matrix and Q_v are sums
of these (docs/theory.md; Shabana, Dynamics of Multibody Systems, ch. 5).

    python tests/mbs/exact_chain.py     the table of docs/developer/kernel.md, a few minutes
"""

import mpmath
import numpy as np
from links import eigenmode_link
from mechanisms import assemble, make_model, relative, revolute
from mpmath import mp
from recursion_trees import tree_of

DIGITS = 40
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


class Invariants:
    """Those of a `PlanarBody` without stiffening, to 40 digits."""

    def __init__(self, body):
        names = ("mass", "inertia", "first_moment", "S_bar", "h", "j", "S_tilde", "m_xy", "stiffness", "damping")
        for name in names:
            setattr(self, name, exact(getattr(body, name))[()])
        self.ends = {
            label: tuple(exact(getattr(body.points[label], part)) for part in ("position", "translation", "rotation"))
            for label in ("root", "tip")
        }
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
        bodies: n `PlanarBody`s, each hinged with its root to the tip before, the first to the origin.
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


def chain(count, condition, modes):
    """Hinged links, the last tip on a path."""
    links = [eigenmode_link(f"b{k + 1}", condition, modes) for k in range(count)]
    ends = ["ground", *(f"{link.name}.tip" for link in links)]
    return make_model(
        links,
        joint=[revolute(f"j{k}", ends[k], f"{link.name}.root") for k, link in enumerate(links)],
        trajectory=[{"name": "tip", "point": ends[-1], "x": "1+0.3*t**2", "y": "0.5-0.2*t**2"}],
    )


def errors(count, condition, modes, seed):
    """Relative errors of λ and q̈ by the recursion in a random state."""
    rng, model = np.random.default_rng(seed), chain(count, condition, modes)
    tree = tree_of(assembly := assemble(model))
    q, v = rng.standard_normal(tree.model.n_q), rng.standard_normal(tree.model.n_v)
    first = np.array(tree.model.first)
    assert tree.bodies == list(range(count))
    number = np.arange(1, modes + 1)
    for _, at_q, _, at_v in first:  # higher modes bend less: 1 mm, 10 mm/s of the first
        q[at_q : at_q + modes] *= 1e-3 / number**2
        v[at_v : at_v + modes] *= 1e-2 / number
    p, p_rate = ([x[at : at + modes] for at in column] for x, column in ((q, first[:, 1]), (v, first[:, 3])))
    rows = [assembly.constraints[i] for i in tree.rows]
    x_y = np.argsort([row.measure.kind.name for row in rows])
    target = np.array([row.target(1.0)[2] for row in rows])
    a, lambda_ = tree.model.evaluate(q, v, target, None, None)
    A = tree.from_tree(q, v, a)[2]
    exact_a, exact_lambda = accelerations(
        model.bodies, model.scene.gravity[:2], q[first[:, 0]], v[first[:, 2]], p, p_rate, target[x_y]
    )
    return float(relative(lambda_[x_y], exact_lambda)), float(relative(A, exact_a))


def main():
    print("| chain | λ | q̈ |\n|---|---|---|")
    for count, condition, modes in CHAINS:
        states = 20 if count * modes < 50 else 4
        found = np.max([errors(count, condition, modes, seed) for seed in range(states)], axis=0)
        cells = " | ".join(f"{error:.0e}" for error in found)
        print(f"| {count} links, {condition}, {modes} modes; {states} states | {cells} |", flush=True)


if __name__ == "__main__":
    main()
