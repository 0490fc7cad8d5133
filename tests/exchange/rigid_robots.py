"""Rigid robots in URDF: random ones, and their moments by Newton and Euler, from the XML itself."""

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

ROBOTS = Path(__file__).parent / "robots"
GRAVITY = np.array([0.0, 0.0, -9.81])


def numbers(element, key, default="0 0 0"):
    return np.array([float(part) for part in (default if element is None else element.get(key, default)).split()])


def turned(axis, angle):
    """Rodrigues."""
    x, y, z = axis / np.linalg.norm(axis)
    S = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * S + (1 - math.cos(angle)) * S @ S


def of_rpy(rpy):
    return turned(np.eye(3)[2], rpy[2]) @ turned(np.eye(3)[1], rpy[1]) @ turned(np.eye(3)[0], rpy[0])


def moments(text, q, v, a):
    """{joint: moment or force} of a URDF whose moving joints have q, v, a: dicts by name. No link is merged.

    Outward: place, velocity and acceleration of each link's frame in global axes; inward: forces, moments about the
    global origin.
    """
    root = ElementTree.fromstring(text)
    joints = root.findall("joint")
    children = {joint.find("child").get("link") for joint in joints}
    base = next(link.get("name") for link in root.findall("link") if link.get("name") not in children)
    zero = np.zeros(3)
    state = {base: (zero, np.eye(3), zero, zero, zero, zero)}  # R, A, omega, alpha, velocity, acceleration
    order, todo, along = [], [base], {}
    while todo:
        parent = todo.pop()
        for joint in joints:
            if joint.find("parent").get("link") == parent:
                state[joint.find("child").get("link")], along[joint.get("name")] = carried(
                    joint, state[parent], q, v, a
                )
                order.append(joint)
                todo.append(joint.find("child").get("link"))
    acting = {link.get("name"): inertia_force(link, state[link.get("name")]) for link in root.findall("link")}
    found = {}
    for joint in reversed(order):
        child, name = joint.find("child").get("link"), joint.get("name")
        force, moment = acting[child]
        at, direction = state[child][0], along[name]
        if joint.get("type") in ("revolute", "continuous"):
            found[name] = float(direction @ (moment - np.cross(at, force)))
        elif joint.get("type") == "prismatic":
            found[name] = float(direction @ force)
        f, m = acting[joint.find("parent").get("link")]
        acting[joint.find("parent").get("link")] = f + force, m + moment
    return found


def carried(joint, state, q, v, a):
    R, A, omega, alpha, velocity, acceleration = state
    origin, name = joint.find("origin"), joint.get("name")
    d, A = A @ numbers(origin, "xyz"), A @ of_rpy(numbers(origin, "rpy"))
    axis = numbers(joint.find("axis"), "xyz", "1 0 0")
    e = A @ axis / np.linalg.norm(axis)
    if joint.get("type") == "prismatic":
        d = d + q[name] * e
    velocity = velocity + np.cross(omega, d)
    acceleration = acceleration + np.cross(alpha, d) + np.cross(omega, np.cross(omega, d))
    if joint.get("type") == "prismatic":
        velocity = velocity + v[name] * e
        acceleration = acceleration + a[name] * e + 2 * np.cross(omega, v[name] * e)
    elif joint.get("type") != "fixed":
        A = A @ turned(axis, q[name])
        alpha = alpha + a[name] * e + np.cross(omega, v[name] * e)
        omega = omega + v[name] * e
    return (R + d, A, omega, alpha, velocity, acceleration), e


def inertia_force(link, state):
    """Force and moment about the global origin that keep the link moving, less gravity."""
    inertial = link.find("inertial")
    if inertial is None:
        return np.zeros(3), np.zeros(3)
    R, A, omega, alpha, _, acceleration = state
    m = float(inertial.find("mass").get("value"))
    inertia = inertial.find("inertia")
    J = np.array([[float(inertia.get("i" + "".join(sorted(k + j)))) for j in "xyz"] for k in "xyz"])
    C = A @ of_rpy(numbers(inertial.find("origin"), "rpy"))
    J, r = C @ J @ C.T, A @ numbers(inertial.find("origin"), "xyz")
    force = m * (acceleration + np.cross(alpha, r) + np.cross(omega, np.cross(omega, r)) - GRAVITY)
    return force, np.cross(R + r, force) + J @ alpha + np.cross(omega, J @ omega)


def random_urdf(rng, count=12):
    """A tree of `count` links with joints of all single types and fixed ones, origins and inertials anyhow."""
    parts = ['<link name="base"/>']
    for k in range(count):
        parent = "base" if k == 0 else f"link{rng.integers(max(0, k - 4), k)}"
        kind = "revolute" if k == 0 else rng.choice(["revolute", "continuous", "prismatic", "fixed"])
        half = rng.uniform(0.05, 0.2, 3)
        ixx, iyy, izz = (half[[1, 2, 0]] ** 2 + half[[2, 0, 1]] ** 2).tolist()
        parts.append(
            f'<link name="link{k}"><inertial><origin xyz="{row(rng, 0.1)}" rpy="{row(rng, 3)}"/>'
            f'<mass value="{rng.uniform(0.5, 3.0)!r}"/>'
            f'<inertia ixx="{ixx!r}" ixy="0" ixz="0" iyy="{iyy!r}" iyz="0" izz="{izz!r}"/></inertial></link>'
            f'<joint name="joint{k}" type="{kind}"><parent link="{parent}"/><child link="link{k}"/>'
            f'<origin xyz="{row(rng, 0.4)}" rpy="{row(rng, 3)}"/><axis xyz="{row(rng, 1)}"/>'
            f'<limit lower="-3" upper="3" effort="100" velocity="5"/></joint>'
        )
    return f'<robot name="random">{"".join(parts)}</robot>'


def row(rng, size):
    return " ".join(repr(float(value)) for value in rng.uniform(-size, size, 3))


def with_motion(scene_text, q, v, a):
    """The scene with q + v t + a t²/2 of each joint, by name, and two outputs of an inverse analysis."""
    parts = [scene_text]
    for name in q:
        value = f"{float(q[name])!r} + {float(v[name])!r}*t + {float(a[name]) / 2!r}*t**2"
        parts.append(f'[[trajectory]]\nname = "{name}"\njoint = "{name}"\nvalue = "{value}"\n')
    parts.append(
        "[initial.joints]\n" + "".join(f'"{name}" = {float(q[name])!r}\n' for name in q)
        + '\n[[analysis]]\nname = "inverse"\nkind = "pcid"\nend = 1e-3\noutput_step = 1e-3\ntolerance = 1e-8\n'
    )  # fmt: skip
    return "\n".join(parts)
