"""Random robots in 3D written otherwise: turned, mirrored, renamed, split, in other units; and their results compared.

Unit and columns of a dataset are those of the table of datasets; which vectors belong to a sense of rotation, and which
are told in axes of a body, is told here.
"""

import re
from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import NamedTuple

import h5py
import numpy as np
from moved_scenes import MIRROR, combined, moved, turning
from robots_3d import random_keys
from rotations import random_rotation, rotation

import ffrobot
from ffrobot.common.meanings import RESULTS

TOLERANCE = 1e-6
GLOBAL = (
    "bodies/*/position", "bodies/*/velocity", "points/*/position", "points/*/predicted_shift", "joints/*/reaction",
    "momentum/linear",
)  # fmt: skip
GLOBAL_AXIAL = ("bodies/*/angular_velocity", "joints/*/reaction_moment", "momentum/angular")
OWN = ("points/*/deflection",)  # in axes of the body
MODAL = ("bodies/*/modal", "bodies/*/modal_velocity", "bodies/*/modal_force")
ROUND_OFF = ("constraint_violation", "resume/*", "step_ends", "linear/[A-D]", "linear/mass", "linear/transformation")
SHAPES = ("*/modes/*", "linear/*ability")  # of a size or in an order of their own
BASE = {  # powers of length, mass and time
    "m": (1, 0, 0), "kg": (0, 1, 0), "√kg": (0, 0.5, 0), "s": (0, 0, 1), "rad": (0, 0, 0), "Hz": (0, 0, -1),
    "N": (1, 1, -2), "J": (2, 1, -2), "W": (2, 1, -3), "Pa": (-1, 1, -2), "1": (0, 0, 0), "": (0, 0, 0),
}  # fmt: skip
KEYS = {  # the same of keys, by table where one name has two meanings
    "gravity": "m/s/s", "mass": "kg", "center": "m", "inertia": "m m kg", "points": "m", "at": "m",
    "youngs_modulus": "Pa", "density": "kg/m/m/m", "length": "m", "height": "m", "width": "m", "outer": "m",
    "inner": "m", "end": "s", "output_step": "s", "load.x": "N", "load.y": "N", "load.moment": "N m",
    "trajectory.x": "m", "trajectory.y": "m", "trajectory.z": "m", "initial.guide": "m", "disturbance.y": "N",
    "sample_time": "s", "delay": "s", "moment_limit": "N m", "proportional": "N m", "derivative": "N m s",
    "integral": "N m/s", "rotor_inertia": "m m kg", "stiffness": "N m", "joint.damping": "N m s",
}  # fmt: skip


class Units(NamedTuple):
    """What one SI unit is in these: 1 m = `length` of them, and so on."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    def of(self, text):
        """What the unit `text` is in these."""
        return float(np.prod(np.power(self, powers(text))))


SI = Units()
SYSTEMS = {
    "SI": SI,
    "mm, t, s": Units(1e3, 1e-3),
    "µm, mg, ms": Units(1e6, 1e6, 1e3),
    "km, kt, h": Units(1e-3, 1e-6, 1 / 3600),
    "cm, g, µs": Units(1e2, 1e3, 1e6),
    "a robot of a size of 1e-5": Units(1e-5, 1e-15),  # scenes have inertias above 1e-30
}


def powers(text):
    """Of length, mass and time in a unit such as "N m/rad"."""
    over, *under = re.sub(r"(\w+)²", r"\1 \1", text).replace("(", "").replace(")", "").split("/")
    return sum(np.array(BASE[of]) for of in over.split()) - sum((np.array(BASE[of]) for of in under), np.zeros(3))


class Written(NamedTuple):
    """A scene's tables, and what they have in place of the original: names, axes, units."""

    tables: Mapping
    names: Mapping[str, str] = {}
    Q: np.ndarray = np.eye(3)
    units: Units = SI

    def renamed(self, part):
        """Part of a dataset's name: a body, a joint, a path or a point of a body."""
        body, dot, point = part.partition(".")
        return self.names.get(body, body) + dot + point


def random_robot(seed, number):
    """Kind and tables of that number: what arms carry is a rigid hand and a payload; several analyses of a motion."""
    kind, robot, keys = random_keys(seed, number)
    tip = keys["body"][-1]["name"]
    if tip != "slider":
        size = robot.between(0.02, 0.08)
        hand = {"mass": robot.between(0.1, 0.5), "center": [size, robot.between(-0.5, 0.5) * size, 0.01],
                "inertia": (size**2 * np.array([[0.3, 0.02, 0.0], [0.02, 0.25, 0.03], [0.0, 0.03, 0.2]])).tolist(),
                "points": {"base": [0.0, 0.0, 0.0], "tool": [2.0 * size, 0.0, 0.01]}}  # fmt: skip
        keys["body"] = [*keys["body"], {"name": "hand", "rigid": hand}]
        keys["joint"] = [*keys["joint"], {"name": "flange", "type": "weld", "between": [f"{tip}.tip", "hand.base"]}]
        keys.setdefault("payload", [{"point": f"{tip}.tip", "mass": robot.between(0.05, 0.5)}])
    one = {"end": robot.end, "output_step": robot.end / 20}
    motion = "pcid" if "trajectory" in keys else "forward"
    analyses = [one | {"name": "run", "kind": motion, "tolerance": TOLERANCE}, {"name": "still", "kind": "linear"}]
    if motion == "pcid":
        analyses.append(one | {"name": "straight", "kind": "fcid", "shape": "zero"})
    return kind, {"name": f"robot{number}", "space": "spatial", "gravity": [0.0, 0.0, -9.81], "analysis": analyses,
                  "trajectory": []} | keys  # fmt: skip


def written_otherwise(tables, rng):
    """The same robot by what was done to it."""
    Q, system = random_rotation(rng), str(rng.choice(list(SYSTEMS)[1:]))
    return {
        "turned": Written(in_global_axes(moved(tables, Q), Q), Q=Q),
        "mirrored": Written(in_global_axes(moved(tables, MIRROR), MIRROR), Q=MIRROR),
        "renamed": renamed(tables, rng),
        "split": split(tables),
        system: Written(scaled(tables, SYSTEMS[system]), units=SYSTEMS[system]),
    }


def in_global_axes(tables, Q):
    """With loads on points changed by Q, too."""
    loads = [
        load | dict(zip("xyz", combined(Q, [load.get(c, "0") for c in "xyz"]), strict=True))
        if "point" in load
        else load
        for load in tables.get("load", ())
    ]
    return tables | {"load": loads}


def renamed(tables, rng):
    """Other names of bodies, joints and paths, whose tables stand in another order."""
    lists = ("body", "joint", "trajectory")
    old = [table["name"] for key in lists for table in tables[key]]
    new = {name: f"n{k}" for name, k in zip(old, rng.permutation(len(old)).tolist(), strict=True)}

    def change(value):
        if isinstance(value, Mapping):
            return {new.get(key, key): change(of) for key, of in value.items()}
        if isinstance(value, list):
            return [change(of) for of in value]
        if isinstance(value, str):
            body, dot, point = value.partition(".")
            return new.get(body, body) + dot + point
        return value

    found = {key: change(tables[key]) for key in (*lists, "payload", "load", "initial") if key in tables}
    mixed = {key: [found[key][k] for k in rng.permutation(len(found[key]))] for key in lists}
    return Written(tables | found | mixed, new)


def split(tables):
    """Rigid bodies as two halves, welded; payloads and loads as two."""
    bodies, halves, welds = [], [], []
    for body in tables["body"]:
        if "rigid" in body:
            name, inertia = body["name"], np.array(body["rigid"]["inertia"]) / 2
            half = body["rigid"] | {"mass": body["rigid"]["mass"] / 2, "inertia": inertia.tolist()}
            base = next(iter(half["points"]))
            body = body | {"rigid": half}
            halves.append({"name": f"{name}_half", "rigid": half | {"points": {base: half["points"][base]}}})
            between = [f"{name}.{base}", f"{name}_half.{base}"]
            welds.append({"name": f"{name}_weld", "type": "weld", "between": between})
        bodies.append(body)
    payloads = [of | {"mass": of["mass"] / 2} for of in tables.get("payload", ()) for _ in range(2)]
    loads = [
        load | {key: f"({load[key]})/2" for key in ("x", "y", "z", "moment") if key in load}
        for load in tables.get("load", ())
        for _ in range(2)
    ]
    joints = [*tables["joint"], *welds]
    return Written(tables | {"body": [*bodies, *halves], "joint": joints, "payload": payloads, "load": loads})


def scaled(tables, units):
    """The tables in `units`; paths are of points, or of angles."""

    def change(value, key, table):
        if isinstance(value, Mapping):
            return {name: change(of, key if key in KEYS else name, key) for name, of in value.items()}
        if isinstance(value, list):
            return [change(of, key, table) for of in value]
        unit = units.of(KEYS.get(f"{table}.{key}", KEYS.get(key, "")))
        if isinstance(value, str) and key in ("x", "y", "z", "value", "moment"):
            in_seconds = re.sub(r"\bt\b", f"(t/{units.time!r})", value)
            return f"{unit!r}*({in_seconds})"
        return unit * value if isinstance(value, (int, float)) and unit != 1.0 else value

    return {key: change(value, key, "") for key, value in tables.items()}


def solved(tables, folder):
    """Datasets by name of all analyses."""
    found, file = {}, folder / "results.h5"

    def take(name, item):
        if isinstance(item, h5py.Dataset) and item.dtype.kind == "f":
            found[name] = item[()]

    ffrobot.solve(ffrobot.make_scene(**tables), file).close()
    with h5py.File(file) as results:
        for analysis in tables["analysis"]:
            first = analysis["name"]
            results[first].visititems(lambda name, item, first=first: take(f"{first}/{name}", item))
    return found


def matches(name, patterns):
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def differences(tables, original, other, results):
    """Largest difference of each dataset of the original to the one written otherwise, in parts of its largest value.

    Those of all bodies, points, joints and paths count together. Modal forces count in parts of what bending takes,
    too: where motors can do all there are none but round-off; those of motors in parts of what their joints bear.
    """
    units = {joint["name"]: "m" if joint["type"] == "prismatic" else "rad" for joint in tables["joint"]}
    is_mirrored = np.linalg.det(other.Q) < 0
    frequency = original["still/linear/frequency"]
    stiffness = (2 * np.pi * frequency[frequency > 0].min()) ** 2
    spinning = between_spherical_joints(tables)
    largest, found, signs = {}, {}, {}
    for name, values in original.items():
        kind = kind_of(name)
        size = np.abs(values).max(initial=0.0)
        largest[kind] = max(largest.get(kind, 0.0), size)
        if name.endswith("/modal"):
            kind = f"{kind}_force"
            largest[kind] = max(largest.get(kind, 0.0), stiffness * size)
        if name.endswith("/reaction_moment"):
            for of_motors in (kind.replace("reaction_", ""), f"{name.partition('/')[0]}/trajectories/*/force"):
                largest[of_motors] = max(largest.get(of_motors, 0.0), size)
    for name, values in original.items():
        analysis, _, dataset = name.partition("/")
        if matches(dataset, ROUND_OFF + SHAPES):
            continue
        parts = dataset.split("/")
        if parts[:2] == ["linear", "zeros"] and (other.names or not np.array_equal(other.Q, np.eye(3))):
            continue  # of points along axes, by numbers
        new = f"{analysis}/" + "/".join(other.renamed(part) for part in parts)
        assert new in results, (name, new)
        there, expected, Q = results[new], values, other.Q
        if parts[1:2] == ["compliance"]:  # of translations and rotations by forces and moments
            lengths = np.repeat([other.units.of("m"), 1.0], 3)
            there = there * other.units.of("N m") / (lengths[:, None] * lengths)
            both = np.kron(np.diag([1.0, 0.0]), Q) + np.kron(np.diag([0.0, 1.0]), turning(Q))
            expected = both @ values @ both.T
        else:
            there = there / other.units.of(unit_of(dataset, units, tables))
        if parts[-1] == "quaternion":  # R turned as a whole is Q R, in a mirror Q R Q
            there = np.array([rotation(e) for e in there.reshape(-1, 4)])
            expected = np.array([Q @ rotation(e) @ (Q if is_mirrored else np.eye(3)) for e in values.reshape(-1, 4)])
        elif matches(dataset, GLOBAL) or (parts[0] == "trajectories" and values.shape[-1] == 3):
            expected = values @ Q.T
        elif matches(dataset, GLOBAL_AXIAL):
            expected = values @ turning(Q).T
        elif matches(dataset, OWN) and is_mirrored:
            expected = values @ MIRROR
        elif matches(dataset, MODAL) and is_mirrored:  # each mode bends to the one side or the other
            sign = signs.setdefault(parts[1], np.where((values * there).sum(axis=0) < 0, -1.0, 1.0))
            expected = values * sign
        if analysis == "still" and len(parts) > 2 and parts[1].partition(".")[0] in spinning:
            there, expected = without_spin(parts[-1], there), without_spin(parts[-1], expected)
        known = 1e-2 if parts[:2] == ["linear", "zeros"] else 1.0  # fourfold ones to the fourth root of round-off
        found[name] = known * np.abs(there - expected).max(initial=0.0) / max(largest[kind_of(name)], 1e-300)
    return found


def between_spherical_joints(tables):
    """Names of bodies that turn about their own axis as they like: no equilibrium says by how much."""
    spherical = [joint["between"] for joint in tables["joint"] if joint["type"] == "spherical"]
    ends = [side.partition(".")[0] for between in spherical for side in between]
    return {name for name in ends if ends.count(name) > 1}


def without_spin(of, values):
    """What is left of a body's dataset `of` that its turns about its own axis do not change."""
    if of == "quaternion":  # a rotation matrix here
        return values[..., 0]
    return np.linalg.norm(values, axis=-1) if of in ("modal", "deflection") else values


def kind_of(name):
    return re.sub(r"/(bodies|points|joints|trajectories|compliance)/[^/]+", r"/\1/*", name)


def unit_of(dataset, coordinates, tables):
    """Of the table of datasets; of two that a joint or a path may have, the one that goes with its coordinate."""
    patterns = ((pattern.replace("**", "*"), of.unit) for pattern, of in RESULTS.items())
    units = [unit.strip() for pattern, text in patterns if fnmatchcase(dataset, pattern) for unit in text.split(",")]
    if len(units) < 2:
        return units[0]
    room, owner, *_ = dataset.split("/")
    if room == "trajectories":
        path = next(path for path in tables["trajectory"] if path["name"] == owner)
        turns = "joint" in path and coordinates[path["joint"]] == "rad"
    else:
        turns = coordinates[owner] == "rad"
    return next(unit for unit in units if (unit in ("rad", "rad/s", "N m")) == turns)
