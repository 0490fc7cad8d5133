"""A chain of rigid bodies on revolute joints with springs, in NumPy alone: linear equations about its equilibrium."""

import numpy as np
import tables_3d
from scipy.spatial.transform import Rotation
from tables_3d import X, Y, Z, revolute

GRAVITY = np.array(tables_3d.DOWN)


class Joint:
    """At `at` (m) of the body before, about `axis`; then a body: mass (kg), center (m), inertia about it (kg m²)."""

    def __init__(self, name, at, axis, stiffness, damping, mass, center, inertia, rotor=1e-4):
        self.name, self.at, self.axis, self.k, self.d = name, np.array(at), np.array(axis), stiffness, damping
        self.mass, self.center, self.inertia, self.rotor = mass, np.array(center), np.diag(inertia), rotor


def frames(chain, q):
    """Origins, axes and rotations of all bodies."""
    R, o, found = np.eye(3), np.zeros(3), []
    for joint, angle in zip(chain, q, strict=True):
        o, axis = o + R @ joint.at, R @ joint.axis
        R = R @ Rotation.from_rotvec(angle * joint.axis).as_matrix()
        found.append((o, axis, R))
    return found


def translation(found, body, r):
    """Columns of the velocity of the place r on a body."""
    columns = [np.cross(axis, r - o) if k <= body else np.zeros(3) for k, (o, axis, _) in enumerate(found)]
    return np.array(columns).T


def rotation(found, body):
    return np.array([axis if k <= body else np.zeros(3) for k, (_, axis, _) in enumerate(found)]).T


def gravity(chain, found):
    """Torques of the weights, and their derivatives."""
    n = len(chain)
    Q, G = np.zeros(n), np.zeros((n, n))
    for body, joint in enumerate(chain):
        r, W = found[body][0] + found[body][2] @ joint.center, joint.mass * GRAVITY
        Q += translation(found, body, r).T @ W
        for i in range(body + 1):
            for j in range(i, body + 1):
                G[i, j] = G[j, i] = G[i, j] + W @ np.cross(found[i][1], np.cross(found[j][1], r - found[j][0]))
    return Q, G


def linear_equations(chain, pose):
    """M, K, D about the equilibrium with motors at `pose`, and the frames there."""
    q, k = np.array(pose), np.array([joint.k for joint in chain])
    for _ in range(50):
        Q, G = gravity(chain, frames(chain, q))
        q = q + np.linalg.solve(np.diag(k) - G, Q - k * (q - pose))
    found, M = frames(chain, q), np.zeros((len(chain), len(chain)))
    for body, joint in enumerate(chain):
        o, axis, R = found[body]
        J, W = translation(found, body, o + R @ joint.center), rotation(found, body)
        M += joint.mass * J.T @ J + W.T @ R @ joint.inertia @ R.T @ W
        if body:  # the rotor stands still on the body before
            spin = axis @ rotation(found, body - 1)
            M += joint.rotor * np.outer(spin, spin)
    return M, np.diag(k) - gravity(chain, found)[1], np.diag([joint.d for joint in chain]), found


def receptance(chain, pose, point, frequency):
    """(F, 3, 3) m/N of the place `point` on the last body."""
    M, K, D, found = linear_equations(chain, pose)
    J = translation(found, len(chain) - 1, found[-1][0] + found[-1][2] @ point)
    w = 2 * np.pi * frequency[:, None, None]
    return J @ np.linalg.solve(K + 1j * w * D - w**2 * M, np.broadcast_to(J.T, (len(frequency), *J.T.shape)))


def scene(chain, point, pose):
    """The same robot as tables of a scene; joints that stand still are given their pose."""
    bodies, joints = [], []
    for k, joint in enumerate(chain):
        at = chain[k + 1].at.tolist() if k + 1 < len(chain) else list(point)
        points = {"origin": [0.0, 0.0, 0.0], "end": at}
        inertia = np.diag(joint.inertia).tolist()
        rigid = {"mass": joint.mass, "center": joint.center.tolist(), "inertia": inertia, "points": points}
        bodies.append({"name": f"body{k}", "rigid": rigid})
        side = "ground" if k == 0 else f"body{k - 1}.end"
        keys = {"rotor_inertia": joint.rotor, "stiffness": joint.k, "damping": joint.d}
        keys |= {"at": joint.at.tolist()} if k == 0 else {}
        joints.append(revolute(joint.name, side, f"body{k}.origin", joint.axis.tolist(), **keys))
    initial = {"joints": {joint.name: float(q) for joint, q in zip(chain, pose, strict=True)}}
    return tables_3d.scene(bodies, joints, {"name": "rest", "kind": "static"}, initial=initial)


# A six-axis arm on a plate that tilts about x and y
ARM = [
    Joint("tilt_x", [0.0, 0.0, 0.0], X, 4.0e6, 900.0, 20.0, [0.0, 0.0, 0.02], [0.4, 0.4, 0.7]),
    Joint("tilt_y", [0.0, 0.0, 0.0], Y, 3.0e6, 800.0, 60.0, [0.01, 0.0, 0.10], [1.1, 1.2, 1.0]),
    Joint("waist", [0.0, 0.0, 0.30], Z, 9.0e5, 300.0, 70.0, [0.05, 0.02, 0.10], [2.0, 1.8, 1.5]),
    Joint("shoulder", [0.15, 0.0, 0.20], Y, 8.0e5, 350.0, 45.0, [0.30, 0.0, 0.02], [0.4, 2.5, 2.6]),
    Joint("elbow", [0.70, 0.0, 0.0], Y, 4.0e5, 150.0, 30.0, [0.10, 0.01, 0.05], [0.5, 0.6, 0.5]),
    Joint("roll", [0.25, 0.0, 0.08], X, 8.0e4, 30.0, 14.0, [0.20, 0.0, 0.0], [0.06, 0.5, 0.5]),
    Joint("pitch", [0.50, 0.0, 0.0], Y, 6.0e4, 20.0, 6.0, [0.05, 0.0, 0.0], [0.02, 0.03, 0.03]),
    Joint("flange", [0.10, 0.0, 0.0], X, 3.0e4, 10.0, 8.0, [0.06, 0.0, 0.03], [0.03, 0.03, 0.02]),
]
TOOL = [0.15, 0.0, 0.12]
