"""The same physics in other units gives the same numbers: no absolute tolerance hides in the code."""

import math
import random
import re

import h5py
import numpy as np
import pytest
import tomli_w
from beam_links import beam_link
from links import quintic
from mechanisms import relative
from rewritten_scenes import SI, SYSTEMS

import ffrobot

OTHERS = ["mm, t, s", "km, kt, h", "a robot of a size of 1e-5"]


def falling_arm(units, integrator, axis):
    """Two rigid links from rest; lengths of 0.5 m, for a second."""
    length = 0.5 * units.length
    inertia = 0.02 * units.mass * units.length**2
    points = {"root": [0.0, 0.0, 0.0], "tip": [length, 0.0, 0.0]}
    rod = {"mass": units.mass, "center": [length / 2, 0.0, 0.0], "inertia": [0.1 * inertia, inertia, inertia]}
    run = {"kind": "forward", "end": units.time, "output_step": 0.1 * units.time, "tolerance": 1e-4}
    return ffrobot.make_scene(
        name="arm", space="spatial", gravity=[0.0, 0.0, -9.81 * units.length / units.time**2],
        body=[{"name": name, "rigid": rod | {"points": points}} for name in ("upper", "fore")],
        joint=[{"name": "O", "type": "revolute", "between": ["ground", "upper.root"], "axis": [0.0, 1.0, 0.0]},
               {"name": "A", "type": "revolute", "between": ["upper.tip", "fore.root"], "axis": axis}],
        analysis=[{"name": "fall", "integrator": integrator} | run],
    )  # fmt: skip


@pytest.mark.parametrize("axis", [[0.0, 1.0, 0.0], [0.0, 0.8, 0.6]], ids=["in a plane", "askew"])
@pytest.mark.parametrize("integrator", ["dop853", "dopri5", "radau", "generalized-alpha"])
def test_rigid_links(integrator, axis):
    """In the very same steps."""
    found = {}
    for name, units in SYSTEMS.items():
        results = ffrobot.solve(falling_arm(units, integrator, axis))
        found[name] = results["fall/joints/A/coordinate"], int(results.attributes("fall")["steps"])
    angle, steps = found["SI"]
    assert {taken for _, taken in found.values()} == {steps}
    assert max(relative(other, angle) for other, _ in found.values()) < 1e-9


# Powers of length, mass and time of the results in 3D.
DIMENSIONS = {
    r"points/.*/(position|deflection)|bodies/.*/position": (1, 0, 0),
    r".*/quaternion|joints/.*/coordinate": (0, 0, 0),
    r"joints/.*/rate|bodies/.*/angular_velocity": (0, 0, -1),
    r"bodies/.*/velocity": (1, 0, -1),
    r"bodies/.*/modal": (1, 0.5, 0),
    r"bodies/.*/modal_velocity": (1, 0.5, -1),
    r"joints/.*/reaction": (1, 1, -2),
    r"joints/.*/(moment|reaction_moment)|energy/(gravitational|kinetic|strain)": (2, 1, -2),
    r"energy/dissipated_power": (2, 1, -3),
    r"momentum/linear": (1, 1, -1),
    r"momentum/angular": (2, 1, -1),
}


def flexible_arm(seed, units, folder):
    """Three beams on skew axes, drawn at random, with all modes of a link by default, and a payload; in `units`."""
    draw = random.Random(seed)
    L, M, T = units.length, units.mass, units.time
    folder.mkdir()
    bodies, joints, paths = [], [], []
    for k in range(3):
        length, height = draw.uniform(0.3, 0.6), draw.uniform(0.012, 0.02)
        section = {"shape": "rectangle", "height": height * L, "width": height * L * draw.uniform(0.6, 2.0)}
        link = beam_link(
            length * L,
            section,
            8,
            E=7e10 * M / L / T**2,
            rho=2700 * M / L**3,
            condition=draw.choice(["cantilever", "simply-supported"]),
            name=f"link{k}",
            modes={"count": draw.randint(1, 4)},
            damping={"rayleigh": [0.0, 1e-4 * T]},
        )
        (folder / f"link{k}.toml").write_text(tomli_w.dumps(link))
        bodies.append({"name": f"link{k}", "link": f"link{k}.toml"})
        before = "ground" if k == 0 else f"link{k - 1}.tip"
        axis, rpy = ([draw.uniform(-1, 1) for _ in range(3)] for _ in range(2))
        joints.append(
            {"name": f"j{k}", "type": "revolute", "axis": axis, "rpy": rpy, "between": [before, f"link{k}.root"]}
        )
        paths.append({"name": f"path{k}", "joint": f"j{k}", "value": quintic(0.3 * k, draw.uniform(-1, 1), 0.5 * T)})
    scene = {
        "name": "arm",
        "space": "spatial",
        "gravity": [0.0, 3.0 * L / T**2, -9.0 * L / T**2],
        "body": bodies,
        "joint": joints,
        "payload": [{"point": "link2.tip", "mass": 0.3 * M, "center": [0.02 * L, 0.03 * L, -0.01 * L]}],
        "trajectory": paths,
        "initial": {"state": "static", "joints": {f"j{k}": 0.3 * k for k in range(3)}},
        "analysis": [{"name": "run", "kind": "pcid", "end": 0.5 * T, "output_step": 0.025 * T, "tolerance": 1e-8}],
    }
    (folder / "scene.toml").write_text(tomli_w.dumps(scene))
    return folder / "scene.toml"


def all_numbers(scene):
    """Every dataset of the run but what is rounding alone: constraints, what actuators leave."""
    found = {}

    def take(name, item):
        if isinstance(item, h5py.Dataset) and any(re.fullmatch(pattern, name) for pattern in DIMENSIONS):
            found[name] = item[()]

    file = scene.with_suffix(".h5")
    ffrobot.solve(scene, file)
    with h5py.File(file) as results:
        results["run"].visititems(take)
    return found


@pytest.mark.parametrize("seed", [pytest.param(seed, marks=pytest.mark.nightly) for seed in range(3)])
def test_flexible_arms_in_3d(seed, tmp_path):
    """Links, modes and all results, from the link files on."""
    expected = all_numbers(flexible_arm(seed, SI, tmp_path / "SI"))
    assert len(expected) > 40
    for number, name in enumerate(OTHERS):
        units = SYSTEMS[name]
        for quantity, values in all_numbers(flexible_arm(seed, units, tmp_path / str(number))).items():
            powers = next(powers for pattern, powers in DIMENSIONS.items() if re.fullmatch(pattern, quantity))
            unit = math.prod(u**p for u, p in zip((units.length, units.mass, units.time), powers, strict=True))
            largest = np.abs(expected[quantity]).max(initial=1e-12)
            assert np.abs(values / unit - expected[quantity]).max(initial=0.0) < 1e-6 * largest, (name, quantity)
