"""python pinocchio_dynamics.py ROBOT.urdf < request > answer: equations of motion of a rigid tree by Pinocchio.

In JSON. Request: `names` of joints (n) and lists of `q`, `v`, `a`, `tau`, (T, n) each. Answer: lists of accelerations
under tau (`aba`), of moments for a (`rnea`), (T, n) each, and of mass matrices (`crba`), (T, n, n).
"""

import json
import sys

import numpy as np
import pinocchio

model = pinocchio.buildModelFromUrdf(sys.argv[1])
data, request = model.createData(), json.load(sys.stdin)
joints = [model.joints[model.getJointId(name)] for name in request["names"]]
columns = [joint.idx_v for joint in joints]


def position(values):
    """Configuration of Pinocchio: continuous joints are cosine and sine there."""
    q = pinocchio.neutral(model)
    for joint, value in zip(joints, values, strict=True):
        q[joint.idx_q : joint.idx_q + joint.nq] = value if joint.nq == 1 else (np.cos(value), np.sin(value))
    return q


def along(values):
    """A vector of velocities or forces of Pinocchio."""
    found = np.zeros(model.nv)
    found[columns] = values
    return found


answer = {"aba": [], "rnea": [], "crba": []}
for q, v, a, tau in zip(*(request[key] for key in ("q", "v", "a", "tau")), strict=True):
    q, v = position(q), along(v)
    answer["aba"].append(pinocchio.aba(model, data, q, v, along(tau))[columns].tolist())
    answer["rnea"].append(pinocchio.rnea(model, data, q, v, along(a))[columns].tolist())
    upper = np.triu(pinocchio.crba(model, data, q))
    M = upper + np.triu(upper, 1).T
    answer["crba"].append(M[np.ix_(columns, columns)].tolist())
json.dump(answer, sys.stdout)
