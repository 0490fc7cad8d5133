"""q̇ = D (ȧ, ṗ): motor coordinates a and modal coordinates p as the independent ones (Shabana 2022, Eqs. 18–21)."""

import numpy as np
from marker_measures import coordinate as coordinate_of
from marker_measures import joint_constraints
from oracle import rotation


def open_chain(mechanism, scene, q):
    """D (N, motors + modes), joint by joint from the ground outwards; joints are listed in that order."""
    driven = [joint.name for joint in scene.joint if joint.type != "weld"]
    modes = [i for body in mechanism.bodies for i in range(*mechanism.columns[body.name].indices(mechanism.size))[3:]]
    D = np.zeros((mechanism.size, len(driven) + len(modes)))
    for k, i in enumerate(modes, len(driven)):
        D[i, k] = 1.0
    placed, rest = {None}, np.zeros(mechanism.size)
    for joint in scene.joint:
        place = joint_constraints(joint)[0]
        outwards = place.a.body in placed  # the joint's second side is the new body
        known, new = (place.a, place.b) if outwards else (place.b, place.a)
        base, tip = mechanism.marker(known, q, rest), mechanism.marker(new, q, rest)
        own = mechanism.columns[new.body]
        v_base = base.L @ D
        rate = np.zeros(D.shape[1])
        if joint.name in driven:
            rate[driven.index(joint.name)] = 1.0 if outwards else -1.0
        angular, section = v_base[2].copy(), True
        coordinate = None if joint.type == "weld" else coordinate_of(joint, scene.motors)
        if joint.type == "revolute":
            angular = mechanism.marker(coordinate.a if outwards else coordinate.b, q, rest).L[2] @ D + rate
            section = coordinate.a.point != "" or coordinate.b.point != ""
        if section:  # `angular` belongs to the section; the frame lacks φ ṗ
            angular = angular - tip.L[2, own][3:] @ D[own][3:]
        D[own.start + 2] = angular
        velocity = v_base[:2].copy()
        if joint.type == "prismatic":
            alpha = (base if outwards else tip).position[2]
            axis = rotation(alpha) @ coordinate.direction
            arm = tip.position[:2] - base.position[:2]
            velocity += np.outer(axis, rate) + np.outer([-arm[1], arm[0]], v_base[2])
        D[own.start : own.start + 2] = 0.0
        D[own.start : own.start + 2] = velocity - tip.L[:2] @ D
        placed.add(new.body)
    return D


def by_definition(mechanism, C_mq, T_q):
    """D from its definition C_mq D = 0, T_q D = (I, 0), the p rows of D = (0, I): closed loops as well."""
    modes = [i for body in mechanism.bodies for i in range(*mechanism.columns[body.name].indices(mechanism.size))[3:]]
    rows = np.vstack([C_mq, T_q, np.eye(mechanism.size)[modes]])
    return np.linalg.solve(rows, np.eye(mechanism.size))[:, len(C_mq) :]
