"""python pinocchio_moments.py ROBOT.urdf NAME … q … v … a …: motor moments of the joints NAME by Pinocchio."""

import sys

import numpy as np
import pinocchio

model = pinocchio.buildModelFromUrdf(sys.argv[1])
rest = sys.argv[2:]
n = len(rest) // 4
names, values = rest[:n], np.array(rest[n:], dtype=float).reshape(3, n)
q, v, a = pinocchio.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
for name, q_k, v_k, a_k in zip(names, *values, strict=True):
    joint = model.joints[model.getJointId(name)]
    q[joint.idx_q] = q_k
    if joint.nq == 2:  # continuous: cosine and sine
        q[joint.idx_q : joint.idx_q + 2] = np.cos(q_k), np.sin(q_k)
    v[joint.idx_v], a[joint.idx_v] = v_k, a_k
tau = pinocchio.rnea(model, model.createData(), q, v, a)
print(*(repr(float(tau[model.joints[model.getJointId(name)].idx_v])) for name in names))
