"""Inverse analyses and the forward runs that replay them agree in every dataset and attribute, in 3D."""

import h5py
import numpy as np
import pytest
from beam_links import beam_link, rectangle
from four_bar import out_of_plane

import ffrobot

TOLERANCE = 1e-9
CLOSE = 1e-7  # of the peak of each kind of dataset: forces amplify errors of the motion
# What inverse analyses or replays alone have, and what runs differ in by nature
ALONE = ("predicted_shift", "trajectories/", "pzt/", "feasibility", "modal_force", "off_path")
NOT_COMPARED = (
    "kind", "apply", "actuation", "steps", "rejected", "evaluations", "wall_seconds", "integrator", "integrator_reason",
    "unresolved",
)  # fmt: skip
# From times between outputs, which are not the same
BY_STEPS = ("peak", "peak_time", "rms", "mean", "peak_power", "rms_power", "mean_power")
END = 0.3


def unit(rng):
    x = rng.standard_normal(3)
    return x / np.linalg.norm(x)


def turn(rng):
    return [float(x) for x in rng.uniform(-1, 1, 3).round(3)]


def rigid(rng, name):
    tip = unit(rng) * rng.uniform(0.2, 0.5)
    body = {"mass": 0.8, "inertia": [4e-3, 5e-3, 6e-3], "center": (0.4 * tip).tolist()}
    return {"name": name, "rigid": body | {"points": {"root": [0.0, 0.0, 0.0], "tip": tip.tolist()}}}


def beam(name, condition="cantilever"):
    return {
        "name": name,
        "link": beam_link(
            0.35, rectangle(0.009, 0.014), 8, condition=condition, name=name,
            modes={"count": 3, "family": "all", "attachment_modes": False}, damping={"ratio": 0.01}
        ),
    }  # fmt: skip


PATCHES = {
    "count": 2, "length": 0.03, "width": 0.014, "thickness": 5e-4, "modulus": 63e9, "d31": 1.1e-10, "limit": 200.0,
    "allocation": "least-squares",
}  # fmt: skip
GEAR = {"gear_ratio": 40.0, "rotor_inertia": 2e-5}
SOFT = GEAR | {"stiffness": 800.0, "damping": 0.4}
ROUGH = {"viscous_friction": 0.1, "coulomb_friction": 0.05, "friction_speed": 0.2}
LIMITED = {"moment_limit": 900.0, "speed_limit": 90.0, "power_limit": 1e4, "position_limit": [-40.0, 40.0]}

# By name: type and keys of each joint from the ground on, which links are beams, and more keys of the scene
ARMS = {
    "revolute, prismatic, screw": (
        [("revolute", ROUGH), ("prismatic", LIMITED), ("screw", {"lead": 0.06})], (), {}
    ),
    "screws and slides as built": (
        [("prismatic", ROUGH | {"gear_ratio": 90.0, "rotor_inertia": 1e-5}), ("screw", ROUGH | {"lead": -0.03}),
         ("revolute", GEAR)], (), {},
    ),
    "links that bend": ([("revolute", GEAR), ("screw", {"lead": 0.05}), ("revolute", ROUGH)], (0, 2), {}),
    "patches": (
        [("revolute", GEAR | LIMITED), ("revolute", {})], (0,), {"pzt": [{"body": "b0", **PATCHES}]}
    ),
    "a compliant gear": ([("revolute", SOFT | ROUGH), ("revolute", ROUGH)], (), {}),
    "a compliant gear and a link that bends": ([("revolute", SOFT)], (0,), {}),
    "compliant gears on links that move": (
        [("revolute", SOFT), ("revolute", GEAR | ROUGH), ("revolute", SOFT | {"stiffness": 2e3})], (), {}
    ),
    "motors that turn frames": ([("revolute", {}), ("prismatic", {})], (), {"motors": "frame"}),
}  # fmt: skip


def is_soft(name):
    return any("stiffness" in keys for _, keys in ARMS[name][0])


def arm(name):
    """A scene with joints that all follow a path; every second joint leads inwards."""
    joints, beams, more = ARMS[name]
    rng = np.random.default_rng(list(ARMS).index(name))
    bodies = [beam(f"b{k}") if k in beams else rigid(rng, f"b{k}") for k in range(len(joints))]
    scene = {"name": "arm", "space": "spatial", "gravity": (9.81 * unit(rng)).tolist(), "body": bodies, **more}
    scene |= {"joint": [], "trajectory": [], "initial": {"state": "static", "joints": {}}}
    for k, (kind, keys) in enumerate(joints):
        sides = ["ground" if k == 0 else f"b{k - 1}.tip", f"b{k}.root"]
        label, size = f"j{k}", 0.1 if kind == "prismatic" else 0.8
        start, way = (float(x) for x in (size * rng.uniform(-1, 1, 2)).round(3))
        scene["joint"].append(
            {"name": label, "type": kind, "between": sides[:: -1 if k % 2 else 1], "axis": unit(rng).tolist(),
             "rpy": turn(rng), **keys}
        )  # fmt: skip
        s = f"(t/{END})"
        value = f"{start}+({way})*sin(pi*{s}/2)**{6 if is_soft(name) else 3}"
        scene["trajectory"].append({"name": f"t{k}", "joint": label, "value": value})
        scene["initial"]["joints"][label] = start
    tip = f"b{len(joints) - 1}.tip"
    scene["payload"] = [{"point": tip, "mass": 0.2, "center": [0.0, 0.02, 0.01], "inertia": [1e-3] * 3}]
    scene["load"] = [{"point": tip, "x": "2*sin(12*t)**6", "mz": "t**6"}]
    return scene


def solved(scene, ways, folder, steps=60):
    """By name of the analysis: datasets and attributes."""
    common = {"tolerance": TOLERANCE, "integrator": "dop853"}
    analyses = [{"name": "inverse", "kind": "pcid", "end": END, "output_step": END / steps, **common}]
    analyses += [{"name": way, "kind": "forward", "actuation": "inverse", "apply": way, **common} for way in ways]
    path = folder / "r.h5"
    with ffrobot.solve(ffrobot.make_scene(**scene | {"analysis": analyses})) as results:
        results.save(path)
    found = {}
    with h5py.File(path) as file:
        for name in ("inverse", *ways):
            data, about = {}, {key: file[name].attrs[key] for key in file[name].attrs}

            def see(key, what, data=data, about=about):
                if isinstance(what, h5py.Dataset):
                    data[key] = what[()]
                about.update({f"{key}@{each}": what.attrs[each] for each in what.attrs})

            file[name].visititems(see)
            found[name] = data, about
    return found


def kind_of(key):
    first, *rest = key.split("/")
    return f"{first}/{rest[-1]}" if rest else first


def is_alone(key):
    return any(part in key for part in ALONE)


def compare(found, ways):
    data, about = found["inverse"]
    peaks = {}
    for key, values in data.items():
        if values.dtype.kind == "f":
            peaks[kind_of(key)] = max(peaks.get(kind_of(key), 1e-3), np.abs(values).max(initial=0.0))
    for way in ways:
        again, about_again = found[way]
        assert {key for key in data if not is_alone(key)} == again.keys()
        for key, values in again.items():
            if key.endswith("constraint_violation"):  # of other rows
                continue
            atol = CLOSE * peaks[kind_of(key)]
            np.testing.assert_allclose(values, data[key], rtol=0, atol=atol, err_msg=f"{way}: {key}")
        for attributes in (about, about_again):
            for key in [k for k in attributes if is_alone(k) or k.rpartition("@")[2] in NOT_COMPARED]:
                del attributes[key]
        assert about.keys() == about_again.keys()
        for key, value in about.items():
            if key.rpartition("@")[2] in BY_STEPS:
                if not key.endswith("peak_time"):
                    np.testing.assert_allclose(about_again[key], value, rtol=0.01, atol=1e-6, err_msg=key)
            elif np.asarray(value).dtype.kind == "f":
                np.testing.assert_allclose(about_again[key], value, rtol=1e-5, atol=1e-9, err_msg=key)
            else:
                assert np.all(about_again[key] == value), key


@pytest.mark.parametrize("name", ARMS)
def test_arms(name, tmp_path):
    ways = ["joints", *(["joints+pzt"] if "pzt" in ARMS[name][2] else []), *([] if is_soft(name) else ["trajectory"])]
    compare(solved(arm(name), ways, tmp_path, 900 if is_soft(name) else 60), ways)  # splines through outputs


def test_a_loop(tmp_path):
    """Of revolute, universal, spherical and revolute joints."""
    built = {"A": GEAR, "B": {"viscous_friction": 0.02}, "D": {"viscous_friction": 0.05}}
    scene = out_of_plane(f"0.7+0.9*(1-cos(pi*t/{END}))", **built)
    compare(solved(scene, ["joints", "trajectory"], tmp_path), ["joints", "trajectory"])
