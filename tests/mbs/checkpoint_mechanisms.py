"""Mechanisms and states of tests/checkpoints/spatial, numbers of an independent code, for the oracle and the core."""

import json
import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import scene_of
from oracle_3d import Mechanism
from rotations import exponential, left_jacobian, left_jacobian_rate, rotation_about
from triad_measures import UNIT, About, Along, Dot, Driven, Ground, Joint, Section

from ffrobot.fe_models.link import cached_modal_body
from ffrobot.mbs.fields.expressions import parse_expression
from ffrobot.mbs.model.body import from_modal_body, rigid_body

FOLDER = Path(scene_of.__file__).parent

CASES = sorted(path.stem for path in FOLDER.glob("*.json") if "scene" in json.loads(path.read_text()))


@cache
def load(name):
    return json.loads((FOLDER / f"{name}.json").read_text())


@cache
def modal_body(link):
    return cached_modal_body(FOLDER / link).body


def bodies_of(scene):
    """The bodies; of the slider-crank its slider in place of the massless cross of the universal joint."""
    found = []
    for body in scene["bodies"]:
        if body["name"] == "cross":
            continue
        if "link" in body:
            found.append(from_modal_body(body["name"], modal_body(body["link"])))
        else:
            rigid = body["rigid"]
            inertia, points = np.array(rigid["inertia_about_center"]), rigid["points"]
            found.append(rigid_body(body["name"], rigid["mass"], rigid["center"], inertia, points))
        for mass, _ in body.get("point_masses", ()):
            found.append(rigid_body("slider", mass, np.zeros(3), 1e-4 * np.eye(3), {"pin": np.zeros(3)}))
    return found


def joints_of(scene):
    """Joints by triads as the file gives them; closed loops as universal, spherical and prismatic joints."""

    def side(name, at, triad):
        return (
            Ground(np.array(at, dtype=float), np.array(triad))
            if name == "ground"
            else Section(*name.split("."), np.array(triad))
        )

    joints = [
        Joint(f"q{k}", j["type"], side(j["first"], j["at"], j["Ba"]), side(j["second"], None, j["Bb"]))
        for k, j in enumerate(scene["joints"], 1)
    ]
    if "mechanical rows" not in scene["path"]:
        return joints
    _, first, second = scene["joints"]
    y, z = scene["path"]["parameters"][1:3]
    # x of the triad on the crank along the first axis, y of that on the rod along the second; parallel at zero angles.
    turn = np.array(first["Ba"]) @ np.array(first["Bb"]).T @ np.array(second["Ba"]) @ np.array(second["Bb"]).T
    alpha, beta = np.array(first["Ba"])[:, 2], turn @ np.array(second["Bb"])[:, 2]
    triad = np.column_stack([alpha, beta, np.cross(alpha, beta)])
    to_x = rotation_about(1, np.pi / 2)  # z along x
    slider = Section("slider", "pin", to_x)
    return [
        joints[0],
        Joint("universal", "universal", Section("crank", "tip", triad), Section("rod", "root", turn.T @ triad)),
        Joint("rod_tip", "spherical", Section("rod", "tip"), Section("slider", "pin")),
        Joint("guide", "prismatic", Ground(np.array([0.0, y, z]), to_x), slider),
    ]


class DrivenPath:
    """The path of a case: rows with targets, from the expressions that its scene file has."""

    def __init__(self, scene):
        lines = []
        scene_of.path_lines(scene["path"], lines)
        self.keys = tomllib.loads("\n".join(lines))
        self.scene = scene

    @property
    def section(self):
        path = self.scene["path"]
        if "mechanical rows" in path:
            return "slider", "pin"
        body = next(each for each in self.scene["bodies"] if each["name"] == path["body"])
        return path["body"], "tip" if "link" in body else "tool"

    def rows(self):
        keys, end = self.keys, Section(*self.section)
        rows = [(Along(Ground(), end, UNIT["xyz".index(k)]), parse_expression(keys[k])) for k in "xyz" if k in keys]
        if "tool_axis" in keys:
            driven = Driven(directed(keys["direction"]))
            tool = Section(*self.section, smallest_turn(np.array(keys["tool_axis"])))
            return rows + [(Dot(tool, driven, k, 2), None) for k in (0, 1)]
        if "rpy" in keys or "rotation_vector" in keys:
            driven = Driven(turning(keys))
            rows += [(About(driven, end, e), None) for e in UNIT]
        return rows


def smallest_turn(axis):
    """The triad whose z is `axis`: the smallest rotation that brings z there."""
    z = axis / np.linalg.norm(axis)
    across = np.cross([0, 0, 1], z)
    size = np.linalg.norm(across)
    return exponential(across / size * np.arctan2(size, z[2])) if size else np.diag([1.0, np.sign(z[2]), np.sign(z[2])])


def jets(texts):
    """Value, rate and second derivative, each (k,), of expressions at a time."""
    functions = [parse_expression(text) for text in texts]
    return lambda t: np.array([function(t) for function in functions]).T


def turning(keys):
    """A triad driven in orientation: exp(ψ~) exp(reference~), or by roll, pitch and yaw."""
    if "rpy" in keys:
        angles = jets(keys["rpy"])

        def path(t):  # A = R_z R_y R_x: ω = ẏ z + R_z (ṗ y + R_y ṙ x)
            (r, p, y), (dr, dp, dy), (ddr, ddp, ddy) = angles(t)
            R_z, R_y, (ex, ey, ez) = rotation_about(2, y), rotation_about(1, p), np.eye(3)
            pitch, roll = R_z @ ey, R_z @ R_y @ ex
            omega = dy * ez + dp * pitch + dr * roll
            alpha = ddy * ez + ddp * pitch + ddr * roll
            alpha = alpha + dp * np.cross(dy * ez, pitch) + dr * np.cross(dy * ez + dp * pitch, roll)
            return still(R_z @ R_y @ rotation_about(0, r), omega, alpha)

        return path
    vector, reference = (
        jets(keys["rotation_vector"]),
        exponential(np.array(keys.get("reference_rotation_vector", np.zeros(3)))),
    )

    def path(t):
        psi, rate, second = vector(t)
        J_l = left_jacobian(psi)
        return still(exponential(psi) @ reference, J_l @ rate, J_l @ second + left_jacobian_rate(psi, rate))

    return path


def directed(texts):
    """A triad whose z is along a direction in time, turning least: ω = z × ż."""
    direction = jets(texts)

    def path(t):
        d, rate, second = direction(t)
        size = np.linalg.norm(d)
        z, slope = d / size, (rate @ d) / size
        z_dot = (rate - slope * z) / size
        z_2dot = (second - 2 * slope * z_dot) / size  # less a part along z, which z × z̈ does not have
        return still(smallest_turn(z), np.cross(z, z_dot), np.cross(z, z_2dot))

    return path


def still(A, omega, alpha):
    zero = np.zeros(3)
    return zero, A, np.concatenate([zero, omega]), np.concatenate([zero, alpha])


def mechanism_of(name):
    """The mechanism of a case, its joints, and how many constraints come before those of the path."""
    scene = load(name)["scene"]
    joints = joints_of(scene)
    mechanical = [(row, None) for joint in joints for row in joint.rows()]
    path = DrivenPath(scene).rows()
    return Mechanism(bodies_of(scene), scene["gravity"], [*mechanical, *path]), joints, len(mechanical)


def state_of(mechanism, sample):
    """Q and v of a sample: places, quaternions, ω̄, p and ṗ are in it, Ṙ is what the constraints then leave."""
    q, v = np.zeros(mechanism.coordinates.n_q), np.zeros(mechanism.size)
    for body in mechanism.bodies:
        R, e, p = mechanism.coordinates.parts(q, body.name)
        _, omega, p_dot = mechanism.coordinates.rates(v, body.name)
        found = sample["bodies"].get(body.name)
        if found is None:  # the slider: it stands on its guide without turning
            R[:], e[:] = mechanism.marker(Section("rod", "tip"), q, v).r, [1, 0, 0, 0]
            continue
        R[:], e[:], omega[:] = found["position"], found["quaternion"], found["angular_velocity_body"]
        p[:], p_dot[:] = found.get("modal", []), found.get("modal_velocity", [])
    _, rate, C_v, _ = mechanism.constraint_values(sample["t"], q, v)
    columns = map(mechanism.coordinates.columns, mechanism.coordinates.names)
    columns = map(mechanism.coordinates.columns, mechanism.coordinates.names)
    places = np.concatenate([np.arange(i.start, i.start + 3) for i in columns])
    v[places] -= np.linalg.lstsq(C_v[:, places], rate, rcond=None)[0]
    return q, v
