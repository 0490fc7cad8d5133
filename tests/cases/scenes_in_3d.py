"""Planar scenes as scenes in 3D: the same robot in the plane z = 0, every joint about z."""

import tomllib

import tomli_w

from ffrobot.mbs.fields.spelling import NORMAL, inertia_about_z, place

# Where the joints of these cases start: [initial] of scenes in 3D
TWO_LINK = {"O": 0.0, "A": 1.0471975511965976}
CRANK = {
    "O": 1.3548358281099402,
    "A": -0.43192099736991246 - 1.3548358281099402,
    "B": 0.43192099736991246,
    "guide": 0.233,
}


def in_3d(tables):
    """The tables of a planar scene, without patches and analyses, as those of one in 3D."""
    found = {key: tables[key] for key in ("name", "motors") if key in tables}
    found |= {"space": "spatial", "gravity": place(tables["gravity"])}
    found["body"] = [_body(body) for body in tables["body"]]
    found["joint"] = [joint_keys(joint) for joint in tables["joint"]]
    found["trajectory"] = [dict(trajectory) for trajectory in tables["trajectory"]]
    return found


def _body(body):
    return body | {"rigid": rigid_keys(body["rigid"])} if "rigid" in body else dict(body)


def rigid_keys(rigid):
    """The table of a rigid body in 3D."""
    points = {name: place(at) for name, at in rigid.get("points", {}).items()}
    return rigid | {"center": place(rigid["center"]), "inertia": inertia_about_z(rigid["inertia"]), "points": points}


def joint_keys(joint):
    """The table of a joint in 3D, whose sides have the same axes where it is welded or slides."""
    axes = {"revolute": lambda: {"axis": NORMAL}, "prismatic": lambda: {"axis": place(joint["axis"])}, "weld": dict}
    at = {"at": place(joint["at"])} if "at" in joint else {}
    return joint | at | axes[joint["type"]]()


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
