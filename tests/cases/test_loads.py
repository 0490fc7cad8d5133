"""Loads on points, friction and rotors in 3D through `ffrobot solve`, against forces written by hand."""

import re

import h5py
import numpy as np
import pytest
from beam_links import beam_link, rectangle
from checkpoint_scene_files import solved, write_scene
from scipy.interpolate import CubicSpline

import ffrobot

SCENE = """
name = "loads"
space = "spatial"
gravity = [0.0, 0.0, -9.81]

[[body]]
name = "carriage"
[body.rigid]
mass = 2.0
inertia = [0.1, 0.1, 0.1]
center = [0.0, 0.0, 0.0]
points = { mount = [0.0, 0.0, 0.0], side = [0.3, 0.0, 0.0] }

[[body]]
name = "wheel"
[body.rigid]
mass = 1.0
inertia = [0.02, 0.03, 0.05]
center = [0.0, 0.0, 0.0]
points = { hub = [0.0, 0.0, 0.0], rim = [0.0, 0.25, 0.0] }

[[joint]]
name = "lift"
type = "prismatic"
between = ["ground", "carriage.mount"]
axis = [0.0, 0.0, 1.0]
viscous_friction = 3.0
coulomb_friction = 0.5
friction_speed = 0.05
rotor_inertia = 2e-4
gear_ratio = 50.0

[[joint]]
name = "turn"
type = "revolute"
between = ["carriage.side", "wheel.hub"]
axis = [0.0, 0.0, 1.0]
viscous_friction = 0.2
rotor_inertia = 1e-3
gear_ratio = 20.0

[[trajectory]]
name = "way"
joint = "lift"
value = "0.1*sin(3*t)"

[[trajectory]]
name = "angle"
joint = "turn"
value = "0.5*t**2"

[[load]]
point = "wheel.rim"
x = "4*cos(t)"
z = "-7*t"
mz = "0.3"

[[analysis]]
name = "inverse"
kind = "pcid"
end = 1.0
output_step = 0.1
tolerance = 1e-9
"""


def test_motors_carry_loads_friction_and_rotors(tmp_path, ffrobot):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    ffrobot.ok("solve", path)
    with h5py.File(path.with_suffix(".results.h5")) as file:
        t = file["inverse/time"][()]
        lift, turn = (file[f"inverse/joints/{name}/moment"][()] for name in ("lift", "turn"))
        reaction, moment = (file[f"inverse/joints/lift/{key}"][()] for key in ("reaction", "reaction_moment"))
        dissipated, kinetic = (file[f"inverse/energy/{key}"][()] for key in ("dissipated_power", "kinetic"))
    rate, acceleration = 0.3 * np.cos(3 * t), -0.9 * np.sin(3 * t)
    friction = 3.0 * rate + 0.5 * np.tanh(rate / 0.05)
    of_rotor = 2e-4 * 50**2
    np.testing.assert_allclose(
        lift, 3.0 * (acceleration + 9.81) + of_rotor * acceleration + friction + 7 * t, rtol=1e-8
    )
    arm = -0.25 * np.cos(0.5 * t**2)  # of the force along x, about z
    np.testing.assert_allclose(turn, 0.05 + 1e-3 * 20**2 + 0.2 * t - 0.3 - arm * 4 * np.cos(t), atol=1e-7)
    np.testing.assert_allclose(
        moment[:, 2], 0.05 + 1e-3 * 20 - 0.3 - arm * 4 * np.cos(t), atol=1e-7
    )  # the rotor's, too
    np.testing.assert_allclose(dissipated, friction * rate + 0.2 * t**2, atol=1e-7)
    turning = 0.05 + 1e-3 * 20**2
    np.testing.assert_allclose(kinetic, 0.5 * (3.0 + of_rotor) * rate**2 + 0.5 * turning * t**2, atol=1e-7)
    np.testing.assert_allclose(reaction[:, 0], -4 * np.cos(t), atol=1e-7)


def test_links_whose_joints_stick(tmp_path, ffrobot):
    """Dry friction near rest, a stiff damper at light ends of links: "auto" is implicit, and finds the same moments."""
    scene = write_scene("arm6_static", tmp_path)
    text = re.sub(r"end = .*\noutput_step = .*", "end = 0.004\noutput_step = 0.001", scene.read_text())
    text = text.replace('type = "revolute"', 'type = "revolute"\ncoulomb_friction = 0.2')
    found = {}
    for integrator in ("auto", "dop853"):
        scene.write_text(f'{text}\nintegrator = "{integrator}"\n')
        with solved(ffrobot, scene) as file:
            group = file["inverse"]
            moments = np.array([group[f"joints/q{k}/moment"][()] for k in range(1, 7)])
            found[integrator] = group.attrs["integrator"], group.attrs["evaluations"], moments
    (implicit, few, radau), (_, many, dop853) = found["auto"], found["dop853"]
    assert implicit == "radau"
    assert 10 * few < many
    np.testing.assert_allclose(radau, dop853, atol=1e-6 * np.abs(dop853).max())


TWO_OR_MORE = {
    "universal": {"axis": [1.0, 0.0, 0.0], "second_axis": [0.0, 1.0, 0.0]},
    "cylindrical": {"axis": [0.3, 0.2, 1.0]},
    "planar": {"axis": [0.0, 0.2, 1.0]},
}


@pytest.mark.parametrize("joint", TWO_OR_MORE)
def test_moments_along_several_coordinates_do_their_work(joint):
    """One expression for each coordinate: the kinetic energy of a body from rest is the work Σ ∫ moment · rate dt."""
    inertia = {"mass": 2.0, "center": [0.1, 0.02, -0.05], "inertia": [0.02, 0.03, 0.04]}
    moments = ["0.3 + t", "-0.2*cos(3*t)", "0.1"][: 3 if joint == "planar" else 2]
    scene = ffrobot.make_scene(
        name="driven", space="spatial", gravity=[0.0, 0.0, 0.0],
        body=[{"name": "body", "rigid": inertia | {"points": {"at": [0.0, 0.0, 0.0]}}}],
        joint=[{"name": "J", "type": joint, "between": ["ground", "body.at"], "motor": False} | TWO_OR_MORE[joint]],
        load=[{"joint": "J", "moment": moments}],
        analysis=[{"name": "fall", "kind": "forward", "end": 0.5, "output_step": 0.001, "tolerance": 1e-10}],
    )  # fmt: skip
    with ffrobot.solve(scene) as results:
        t, rates, energy = (results[f"fall/{key}"] for key in ("time", "joints/J/rate", "energy/kinetic"))
    power = np.sum(np.stack([0.3 + t, -0.2 * np.cos(3 * t), 0.1 + 0 * t], axis=1)[:, : len(moments)] * rates, axis=1)
    work = CubicSpline(t, power).antiderivative()(t)
    np.testing.assert_allclose(energy - energy[0], work, rtol=0, atol=1e-8 * work[-1])


@pytest.mark.parametrize(
    ("joint", "load", "says"),
    [
        (
            {"type": "universal"},
            {"moment": "1.0"},
            r"moment: expected 2 expressions, one for each coordinate of .* found 1",
        ),
        ({"type": "universal"}, {"moment": ["1", "2", "3"]}, "moment: expected 2 expressions, .* found 3"),
        (
            {"type": "spherical"},
            {"moment": ["1", "2", "3"]},
            "joint: expected one with coordinates, found .* a spherical",
        ),
    ],
)
def test_moments_that_do_not_fit_their_joint(joint, load, says):
    axes = TWO_OR_MORE["universal"] if joint["type"] == "universal" else {}
    with pytest.raises(ffrobot.InputError, match=says):
        ffrobot.solve(
            ffrobot.make_scene(
                name="driven", space="spatial", gravity=[0.0, 0.0, 0.0],
                body=[{"name": "body", "rigid": {"mass": 1.0, "center": [0.0] * 3, "inertia": [1.0] * 3,
                                                 "points": {"at": [0.0] * 3}}}],
                joint=[{"name": "J", "between": ["ground", "body.at"]} | joint | axes],
                load=[{"joint": "J"} | load],
                analysis=[{"name": "fall", "kind": "forward", "end": 0.1, "output_step": 0.1}],
            )
        )  # fmt: skip


@pytest.mark.parametrize("kind", ["prismatic", "universal"])
def test_forces_on_the_ground_of_a_link_alone(kind, tmp_path):
    """They follow from nothing else that steps are judged by: unobserved, they erred by up to 78 tolerances."""
    link = beam_link(0.8, rectangle(0.01, 0.02), 14, E=2.1e11, nu=0.3, rho=7850.0, modes={"count": 8, "family": "all"})
    joint = {"name": "O", "type": kind, "between": ["ground", "b.root"], "axis": [0.0, 0.6, 0.8]}
    runs = {"exact": 1e-9, "found": 1e-4}
    scene = ffrobot.make_scene(
        name="lone",
        space="spatial",
        gravity=[0.0, 0.0, -9.81],
        body=[{"name": "b", "link": link}],
        joint=[joint | ({"second_axis": [1.0, 0.0, 0.0]} if kind == "universal" else {})],
        load=[{"point": "b.tip", "y": "20+3*sin(9*t)", "z": "30"}],
        analysis=[
            {"name": name, "kind": "forward", "end": 0.06, "output_step": 2e-4, "tolerance": at, "integrator": "dop853"}
            for name, at in runs.items()
        ],
    )
    with h5py.File(ffrobot.solve(scene).save(tmp_path / "lone.h5")) as file:
        found, exact = (file[name]["joints/O/reaction"][()] for name in ("found", "exact"))
    assert np.abs(found - exact).max() < 1e-4 * np.abs(exact).max()


@pytest.mark.parametrize("integrator", ["auto", "dop853", "dopri5", "radau"])
@pytest.mark.parametrize("duration", [1e-9, 1e-5, 1e-3, 0.03])
def test_no_step_skips_a_pulse(duration, integrator):
    """A rod of inertia J at its hinge turns at impulse/J behind it, and not before."""
    start, end, impulse = 0.503, 0.503 + duration, 2.0
    body = {"mass": 1.0, "inertia": [0.1] * 3, "center": [0.25, 0, 0], "points": {"root": [0] * 3, "tip": [0.5, 0, 0]}}
    moment = f"where(t > {start!r} and {end!r} >= t, {impulse / (end - start)!r}, 0)"
    scene = ffrobot.make_scene(
        name="rod",
        space="spatial",
        gravity=[0.0, 0.0, 0.0],
        body=[{"name": "a", "rigid": body}],
        joint=[{"name": "j", "type": "revolute", "axis": [0.0, 1.0, 0.0], "between": ["ground", "a.root"]}],
        load=[{"joint": "j", "moment": moment}],
        analysis=[{"name": "run", "kind": "forward", "end": 1.0, "output_step": 0.25, "integrator": integrator}],
    )
    rate = ffrobot.solve(scene)["run/joints/j/rate"]
    rounded = np.spacing(start) / duration  # of its ends
    np.testing.assert_allclose(rate, [0.0, 0.0, 0.0, impulse / 0.1625, impulse / 0.1625], rtol=1e-9 + 2 * rounded)
