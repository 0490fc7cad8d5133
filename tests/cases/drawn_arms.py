"""Arms in 3D drawn at random: offsets, leaning axes, sections, families, payload, gravity, a path of the tool."""

import numpy as np
import tomli_w
import tree_oracle
from beam_links import link_keys
from scipy.spatial.transform import Rotation

from ffrobot.run.solve import prepare_scene
from ffrobot.run.watcher import Watcher

FAMILIES = ["in-plane-bending", "out-of-plane-bending", "torsion", "axial"]
AXES = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 0]])
POSTURE = (0.3, -0.7, 1.3, -0.5, 0.6, 0.3)  # rad, about which they are drawn


def _vector(rng, size):
    return (size * rng.standard_normal(3)).round(4).tolist()


def _section(rng, kind, number, stout):
    if stout:  # as of links of industrial robots
        if kind == "beam" and rng.choice(["tube", "rectangle"]) == "tube":
            outer = number(0.05, 0.09)
            return {"shape": "tube", "outer": outer, "inner": round(outer - 2 * number(0.002, 0.004), 4)}
        return {"shape": "rectangle", "height": number(0.03, 0.05), "width": number(0.04, 0.06)}
    shape = rng.choice(["rectangle", "tube", "circle"]) if kind == "beam" else "rectangle"
    if shape == "tube":
        outer = number(0.014, 0.024)
        return {"shape": "tube", "outer": outer, "inner": round(outer - number(0.002, 0.004), 4)}
    if shape == "circle":
        return {"shape": "circle", "diameter": number(0.008, 0.012)}
    return {"shape": "rectangle", "height": number(0.006, 0.012), "width": number(0.008, 0.016)}


def _link(rng, name, kind, families, damping, stout):
    def number(low, high):
        return round(float(rng.uniform(low, high)), 4)

    length = round(float(rng.uniform(0.25 if stout else 0.3, 0.6)), 3)
    section, mesh = _section(rng, kind, number, stout), {"elements": 8} if kind == "beam" else {}
    condition = str(rng.choice(["cantilever", "simply-supported"]))
    modes = {"count": int(rng.integers(1, 4)), "family": families}
    return link_keys(
        kind, length, section, mesh, condition=condition, name=name, modes=modes, damping={"ratio": damping}
    )


def _rigid(rng, name, offset, stout):
    if stout:
        mass = round(float(rng.uniform(1.0, 4.0)), 3)
        inertia = (mass * rng.uniform(0.04, 0.07, 3) ** 2).round(5).tolist()
        points = {"o": [0.0, 0.0, 0.0], "e": _vector(rng, 2 * offset)}
        center = _vector(rng, 0.03)
        return {"name": name, "rigid": {"mass": mass, "center": center, "inertia": inertia, "points": points}}
    inertia = rng.uniform(0.002, 0.004, 3).round(5).tolist()
    points = {"o": [0.0, 0.0, 0.0], "e": _vector(rng, offset)}
    mass = round(float(rng.uniform(0.3, 1.5)), 3)
    return {"name": name, "rigid": {"mass": mass, "center": _vector(rng, 0.02), "inertia": inertia, "points": points}}


def _chain(rng, seed, count, stout):
    """Bodies, joints, and the point that is the tool; links 1 and 2 of `count` bodies bend."""
    families = [FAMILIES[:2], FAMILIES[:3], FAMILIES, FAMILIES[:2]][seed % 4]
    kind, damping = "solid" if seed % 10 == 3 else "beam", [0.0, 0.005, 0.02][seed % 3]
    bodies, joints, before = [], [], "ground"
    for k in range(count):
        name, bends = f"b{k}", k in (1, 2)
        if bends:
            own = {"name": name, "link": _link(rng, name, kind, families, damping, stout)}
        else:
            own = _rigid(rng, name, 0.06, stout)
        axis = (AXES[k] + (0.1 if count == 6 else 0.3) * rng.standard_normal(3)).round(4).tolist()
        first, last = ("root", "tip") if bends else ("o", "e")
        joint = {"name": f"j{k}", "type": "revolute", "between": [before, f"{name}.{first}"], "axis": axis}
        joints.append(joint | ({"rpy": _vector(rng, 0.4)} if k == 1 else {}))
        bodies.append(own)
        before = f"{name}.{last}"
    if count == 3:  # a hand, so that the tool is off the axis of the last link
        bodies.append(_rigid(rng, "hand", 0.05, stout))
        joints.append({"name": "wrist", "type": "weld", "between": [before, "hand.o"]})
        before = "hand.e"
    return bodies, joints, before


def drawn_arm(seed, folder, *, stout=False):
    """The file of a scene whose motors alone carry the tool from one drawn posture to another, and its replay.

    Every fifth has six joints and a pose to follow, the others three joints and a place; `stout` ones are as thick as
    industrial robots. The scene's tool is the second value.
    """
    rng = np.random.default_rng(seed)
    count, end = 6 if seed % 5 == 4 else 3, [0.5, 0.8][seed % 2]
    bodies, joints, tool = _chain(rng, seed, count, stout)
    start = {f"j{k}": float(np.round(POSTURE[k] + 0.2 * rng.standard_normal(), 3)) for k in range(count)}
    ways = rng.uniform(0.08, 0.3, count) * rng.choice([-1, 1], count)
    finish = {name: value + way for (name, value), way in zip(start.items(), ways, strict=True)}
    scene = {
        "name": f"arm{seed}", "space": "spatial", "body": bodies, "joint": joints,
        "gravity": _vector(rng, 5.0) if seed % 4 else [0.0, 0.0, -9.81],
        "payload": [{"point": tool, "mass": round(float(rng.uniform(0.05, 0.4)), 3)}],
    }  # fmt: skip
    scene |= {"initial": {"state": "static", "joints": start}, "analysis": [{"name": "s", "kind": "static"}]}
    path = folder / f"arm{seed}.toml"
    path.write_text(tomli_w.dumps(scene), encoding="utf-8")
    tree = prepare_scene(path, Watcher()).model.tree
    places = []
    for posture in (start, finish):
        q = tree.at_rest({name: [value] for name, value in posture.items()})[None]
        at = tree_oracle.motion(tree, tree.section(tool, np.eye(3)), q, tree_oracle.frames(tree, q))
        turn = Rotation.from_matrix(at.F[0]).as_euler("xyz").tolist() if count == 6 else []
        places.append([round(x, 6) for x in (*at.r[0], *turn)])
    scene["trajectory"] = [{"name": "tool", "point": tool, "via": places, "duration": end}]
    scene["analysis"] = [
        {"name": "exact", "kind": "motors-only", "end": end, "output_step": 0.005, "tolerance": 1e-6},
        {"name": "again", "kind": "forward", "actuation": "exact", "apply": "joints", "tolerance": 1e-7},
    ]
    path.write_text(tomli_w.dumps(scene), encoding="utf-8")
    return path, tool
