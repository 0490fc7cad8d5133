"""Scenes in 3D as a whole turned, or seen in a mirror: tables of keys, and what becomes of their results.

Vectors change by Q; those that belong to a sense of rotation (angular velocities, moments, axes to turn about) by
det(Q) Q: with a mirror they keep their component along its normal and change the others.
"""

import numpy as np
from checkpoint_mechanisms import FOLDER
from checkpoint_scenes import rpy
from rotations import exponential
from scenes_in_3d import read

MIRROR = np.diag([1.0, -1.0, 1.0])


def tables_of(name, tolerance):
    """The keys of a checkpoint's scene, its links by their absolute paths."""
    tables = read(FOLDER / f"{name}.toml")
    tables["analysis"][0]["tolerance"] = tolerance
    return tables


def turning(Q):
    """What becomes of what has a sense of rotation."""
    return np.linalg.det(Q) * Q


def moved(tables, Q):
    """The scene as a whole changed by Q: a rotation, which what stands on the ground gets, or the mirror.

    In a mirror bodies have axes of their own that are changed as well, so that these are right-handed: all that is told
    in them changes. Turned bodies have their axes turned with them, and keep it.
    """
    is_mirrored = np.linalg.det(Q) < 0
    found = tables | {"gravity": (Q @ tables["gravity"]).tolist()}
    if is_mirrored:
        found["body"] = [_mirrored_body(body) for body in tables["body"]]
    found["joint"] = [
        _joint(joint, Q, is_mirrored) if is_mirrored or "ground" in joint["between"] else joint
        for joint in tables["joint"]
    ]
    found["trajectory"] = [_trajectory(path, Q) for path in tables["trajectory"]]
    return found


def _mirrored_body(body):
    if "rigid" not in body:
        return body  # a straight tube
    rigid = body["rigid"]
    J = np.array(rigid["inertia"])
    J = MIRROR @ (np.diag(J) if J.ndim == 1 else J) @ MIRROR
    points = {name: (MIRROR @ place).tolist() for name, place in rigid["points"].items()}
    return body | {
        "rigid": rigid | {"inertia": J.tolist(), "center": (MIRROR @ rigid["center"]).tolist(), "points": points}
    }


def _joint(joint, Q, is_mirrored):
    found, axial = dict(joint), turning(Q)
    if "at" in joint:
        found["at"] = (Q @ joint["at"]).tolist()
    if "axis" in joint:
        found["axis"] = ((Q if joint["type"] == "prismatic" else axial) @ joint["axis"]).tolist()
    if "second_axis" in joint and is_mirrored:  # in axes of the second body
        found["second_axis"] = (axial @ joint["second_axis"]).tolist()
    if joint["type"] == "spherical" and not is_mirrored:
        return found
    x, y, z = joint.get("rpy", (0.0, 0.0, 0.0))
    unit = np.eye(3)
    C = exponential(z * unit[2]) @ exponential(y * unit[1]) @ exponential(x * unit[0])
    found["rpy"] = rpy(Q @ C @ Q if is_mirrored else Q @ C)
    return found


def _trajectory(path, Q):
    if "joint" in path:
        return path
    return path | dict(zip("xyz", combined(Q, [path[c] for c in "xyz"]), strict=True))


def combined(Q, expressions):
    """Expressions of t for Q times a vector of such."""
    return [" + ".join(f"({q!r})*({of})" for q, of in zip(row.tolist(), expressions, strict=True)) for row in Q]
