"""python pinocchio_stiffness.py ROBOT.urdf < request > answer: a rigid tree on springs at rest, by Pinocchio.

In JSON. Request: `names` of joints, `motors` (n) their coordinates on the motor's side, `stiffness` (n), `frame`.
Answer: `q` (n) at rest, `frequency` (n) in Hz, `compliance` (6, 6) of the frame in its axes.
"""

import json
import sys

import numpy as np
import pinocchio

model, request = pinocchio.buildModelFromUrdf(sys.argv[1]), json.load(sys.stdin)
data = model.createData()
columns = [model.joints[model.getJointId(name)].idx_v for name in request["names"]]
motors, k = np.zeros(model.nv), np.zeros(model.nv)
motors[columns], k[columns] = request["motors"], request["stiffness"]
q = motors.copy()
for _ in range(30):  # Newton on g(q) = k (motors − q)
    slope = pinocchio.computeGeneralizedGravityDerivatives(model, data, q) + np.diag(k)
    q -= np.linalg.solve(slope, pinocchio.computeGeneralizedGravity(model, data, q) + k * (q - motors))
K = pinocchio.computeGeneralizedGravityDerivatives(model, data, q) + np.diag(k)
upper = np.triu(pinocchio.crba(model, data, q))
back = np.linalg.inv(np.linalg.cholesky(upper + np.triu(upper, 1).T))
frequency = np.sqrt(np.linalg.eigvalsh(back @ K @ back.T)) / (2 * np.pi)
J = pinocchio.computeFrameJacobian(model, data, q, model.getFrameId(request["frame"]), pinocchio.LOCAL)
C = J @ np.linalg.solve(K, J.T)
json.dump({"q": q[columns].tolist(), "frequency": frequency.tolist(), "compliance": C.tolist()}, sys.stdout)
