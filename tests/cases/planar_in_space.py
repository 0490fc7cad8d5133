"""Planar scenes as scenes in space: the same robot in the plane z = 0, every joint about z."""

import tomllib

import tomli_w


def in_space(tables):
    """The tables of a planar scene, without patches and analyses, as those of one in space."""
    found = {key: tables[key] for key in ("name", "motors") if key in tables}
    found |= {"space": "spatial", "gravity": [*tables["gravity"], 0.0]}
    found["body"] = [_body(body) for body in tables["body"]]
    found["joint"] = [_joint(joint) for joint in tables["joint"]]
    found["trajectory"] = [dict(trajectory) for trajectory in tables["trajectory"]]
    return found


def _body(body):
    if "rigid" not in body:
        return dict(body)
    rigid = body["rigid"]
    points = {name: [*place, 0.0] for name, place in rigid["points"].items()}
    J = rigid["inertia"]  # about z; the others are of no account in the plane
    return {
        "name": body["name"],
        "rigid": {
            "mass": rigid["mass"],
            "center": [*rigid["center"], 0.0],
            "inertia": [0.6 * J, 0.6 * J, J],
            "points": points,
        },
    }


def _joint(joint):
    found = dict(joint)
    if "at" in joint:
        found["at"] = [*joint["at"], 0.0]
    found["axis"] = [*joint["axis"], 0.0] if joint["type"] == "prismatic" else [0.0, 0.0, 1.0]
    return found


def read(path):
    """The tables of a scene file, its links by their absolute paths."""
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    for body in tables["body"]:
        if "link" in body:
            body["link"] = str((path.parent / body["link"]).resolve())
    return tables


def write(tables, path):
    """A scene file."""
    path.write_text(tomli_w.dumps(tables), encoding="utf-8")
    return path
