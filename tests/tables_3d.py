"""Tables of scenes in 3D as tests of all parts write them: rigid bodies, joints, a scene."""

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
    found = {"name": "scene", "space": "spatial", "gravity": gravity, "body": bodies, "joint": joints}
    return found | {"analysis": list(analyses)} | tables
