"""Tables of scenes as tests of all parts write them: rigid bodies, joints, a scene in 3D or in the plane."""

import ffrobot

ORIGIN = [0.0, 0.0, 0.0]
DOWN = [0.0, 0.0, -9.81]
X, Y, Z = [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]


def rigid(name, mass=1.0, inertia=(0.1, 0.1, 0.1), center=ORIGIN, **points):
    """With the point "root" at its origin, and `points` beside it."""
    tensor = [list(row) if isinstance(row, list | tuple) else row for row in inertia]
    points = {"root": ORIGIN} | points
    return {"name": name, "rigid": {"mass": mass, "center": list(center), "inertia": tensor, "points": points}}


def joint(name, kind, inner, outer, **keys):
    return {"name": name, "type": kind, "between": [inner, outer], **keys}


def revolute(name, inner, outer, axis=Z, **keys):
    return joint(name, "revolute", inner, outer, axis=list(axis), **keys)


def scene(bodies, joints, *analyses, gravity=DOWN, **tables):
    return planar(bodies, joints, *analyses, gravity=gravity, **{"space": "spatial"} | tables)


def planar(bodies, joints, *analyses, gravity=(0.0, -9.81), **tables):
    found = {"name": "scene", "gravity": list(gravity), "body": bodies, "joint": joints, "analysis": list(analyses)}
    return found | tables


def pin(name, inner, outer, **keys):
    """A revolute joint of a planar scene."""
    return joint(name, "revolute", inner, outer, **keys)


def solved(tables):
    return ffrobot.solve(ffrobot.make_scene(**tables))
