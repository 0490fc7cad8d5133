"""Loads on points, payloads, friction and rotors in 3D, against forces written by hand and bodies welded to links."""

import re

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from checkpoint_scene_files import solved, write_scene
from moved_scenes import tables_of
from scipy.interpolate import CubicSpline
from tables_3d import ORIGIN, X, Y, Z, joint, revolute, rigid, scene

import ffrobot


def test_motors_carry_loads_friction_and_rotors():
    lifts = {"viscous_friction": 3.0, "coulomb_friction": 0.5, "friction_speed": 0.05}
    turns = {"viscous_friction": 0.2, "rotor_inertia": 1e-3, "gear_ratio": 20.0}
    tables = scene(
        [rigid("carriage", 2.0, side=[0.3, 0.0, 0.0]), rigid("wheel", 1.0, [0.02, 0.03, 0.05], rim=[0.0, 0.25, 0.0])],
        [
            joint("lift", "prismatic", "ground", "carriage.root", axis=Z, rotor_inertia=2e-4, gear_ratio=50.0, **lifts),
            revolute("turn", "carriage.side", "wheel.root", Z, **turns),
        ],
        {"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": 0.1, "tolerance": 1e-9},
        trajectory=[
            {"name": "way", "joint": "lift", "value": "0.1*sin(3*t)"},
            {"name": "angle", "joint": "turn", "value": "0.5*t**2"},
        ],
        load=[{"point": "wheel.rim", "x": "4*cos(t)", "z": "-7*t", "mz": "0.3"}],
    )
    with ffrobot.solve(ffrobot.make_scene(**tables)) as results:
        t = results["inverse/time"]
        lift, turn = (results[f"inverse/joints/{name}/moment"] for name in ("lift", "turn"))
        reaction, moment = (results[f"inverse/joints/lift/{key}"] for key in ("reaction", "reaction_moment"))
        dissipated, kinetic = (results[f"inverse/energy/{key}"] for key in ("dissipated_power", "kinetic"))
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
    path = write_scene("arm6_static", tmp_path)
    text = re.sub(r"end = .*\noutput_step = .*", "end = 0.004\noutput_step = 0.001", path.read_text())
    text = text.replace('type = "revolute"', 'type = "revolute"\ncoulomb_friction = 0.2')
    found = {}
    for integrator in ("auto", "dop853"):
        path.write_text(f'{text}\nintegrator = "{integrator}"\n')
        with solved(ffrobot, path) as file:
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


FALL = {"name": "fall", "kind": "forward", "end": 0.5, "output_step": 0.001, "tolerance": 1e-10}


def driven(kind, moment):
    """A body at rest under moments along a joint without a motor."""
    J = joint("J", kind, "ground", "body.root", motor=False, **TWO_OR_MORE.get(kind, {}))
    body = rigid("body", 2.0, [0.02, 0.03, 0.04], [0.1, 0.02, -0.05])
    return ffrobot.make_scene(**scene([body], [J], FALL, gravity=ORIGIN, load=[{"joint": "J", "moment": moment}]))


@pytest.mark.parametrize("kind", TWO_OR_MORE)
def test_moments_along_several_coordinates_do_their_work(kind):
    """One expression for each coordinate: the kinetic energy of a body from rest is the work Σ ∫ moment · rate dt."""
    moments = ["0.3 + t", "-0.2*cos(3*t)", "0.1"][: 3 if kind == "planar" else 2]
    with ffrobot.solve(driven(kind, moments)) as results:
        t, rates, energy = (results[f"fall/{key}"] for key in ("time", "joints/J/rate", "energy/kinetic"))
    power = np.sum(np.stack([0.3 + t, -0.2 * np.cos(3 * t), 0.1 + 0 * t], axis=1)[:, : len(moments)] * rates, axis=1)
    work = CubicSpline(t, power).antiderivative()(t)
    np.testing.assert_allclose(energy - energy[0], work, rtol=0, atol=1e-8 * work[-1])


@pytest.mark.parametrize(
    ("kind", "moment", "says"),
    [
        ("universal", "1.0", r"moment: expected 2 expressions, one for each coordinate of .* found 1"),
        ("universal", ["1", "2", "3"], "moment: expected 2 expressions, .* found 3"),
        ("spherical", ["1", "2", "3"], "joint: expected one with coordinates, found .* a spherical"),
    ],
)
def test_moments_that_do_not_fit_their_joint(kind, moment, says):
    with pytest.raises(ffrobot.InputError, match=says):
        ffrobot.solve(driven(kind, moment))


@pytest.mark.parametrize("kind", ["prismatic", "universal"])
def test_forces_on_the_ground_of_a_link_alone(kind):
    """They follow from nothing else that steps are judged by: unobserved, they erred by up to 78 tolerances."""
    link = beam_link(0.8, rectangle(0.01, 0.02), 14, E=2.1e11, nu=0.3, rho=7850.0, modes={"count": 8, "family": "all"})
    second = {"second_axis": X} if kind == "universal" else {}
    run = {"kind": "forward", "end": 0.06, "output_step": 2e-4, "integrator": "dop853"}
    tables = scene(
        [{"name": "b", "link": link}],
        [joint("O", kind, "ground", "b.root", axis=[0.0, 0.6, 0.8], **second)],
        run | {"name": "exact", "tolerance": 1e-9},
        run | {"name": "found", "tolerance": 1e-4},
        load=[{"point": "b.tip", "y": "20+3*sin(9*t)", "z": "30"}],
    )
    with ffrobot.solve(ffrobot.make_scene(**tables)) as results:
        found, exact = (results[f"{name}/joints/O/reaction"] for name in ("found", "exact"))
    assert np.abs(found - exact).max() < 1e-4 * np.abs(exact).max()


@pytest.mark.parametrize("integrator", ["auto", "dop853", "dopri5", "radau"])
@pytest.mark.parametrize("duration", [1e-9, 1e-5, 1e-3, 0.03])
def test_no_step_skips_a_pulse(duration, integrator):
    """A rod of inertia J at its hinge turns at impulse/J behind it, and not before; then twice that of 0.6 ms more."""
    start, end, impulse = 0.503, 0.503 + duration, 2.0
    loads = [
        {"joint": "j", "moment": f"where(t > {start!r} and {end!r} >= t, {impulse / (end - start)!r}, 0)"},
        {"joint": "j", "moment": f"where(abs(t - 0.81234) < 3e-4, {impulse / 3e-4!r}, 0)"},
    ]
    run = {"name": "run", "kind": "forward", "end": 1.0, "output_step": 0.25, "integrator": integrator}
    hinge = revolute("j", "ground", "a.root", Y)
    tables = scene([rigid("a", center=[0.25, 0.0, 0.0])], [hinge], run, gravity=ORIGIN)
    rate = ffrobot.solve(ffrobot.make_scene(**tables, load=loads))["run/joints/j/rate"]
    rounded = np.spacing(start) / duration  # of its ends
    expected = [0.0, 0.0, 0.0, impulse / 0.1625, 3 * impulse / 0.1625]
    np.testing.assert_allclose(rate, expected, rtol=1e-9 + 2 * rounded)


MASS, CENTER = 0.3, [0.03, -0.02, 0.05]
SLIGHT = 1e-12  # kg·m²: rigid bodies have to have some; it is 1e-9 of that of the payload about the point
MOMENTS = {"upper": [0.0, 0.0, 0.0], "fore": [0.0, 2e-4, 2e-4]}  # a point mass next to the section, and a rod
DROP = {"name": "fall", "kind": "forward", "end": 0.04, "output_step": 0.02, "tolerance": 1e-9}
KEYS = (
    *(f"joints/{name}/{of}" for name in ("q1", "q2", "q3") for of in ("coordinate", "rate", "reaction",
                                                                      "reaction_moment")),
    "bodies/fore/modal", "bodies/upper/modal", "energy/kinetic", "energy/strain", "points/fore.tip/position",
    "points/fore.tip/quaternion",
)  # fmt: skip
MOMENTS_OF_MOTORS = tuple(f"joints/{name}/moment" for name in ("q1", "q2", "q3"))


def carried(is_welded):
    """The arm that carries both, as payloads or as bodies."""
    tables = tables_of("arm3_line_undeformed", 1e-9)
    inverse = tables["analysis"][0] | {"end": 0.1, "output_step": 0.02}
    tables["analysis"] = [inverse, DROP, DROP | {"name": "implicit", "integrator": "radau"}]
    if is_welded:
        for link, inertia in MOMENTS.items():
            tables["body"].append(rigid(f"of_{link}", MASS, [x + SLIGHT for x in inertia], CENTER))
            tables["joint"].append(joint(f"grip_of_{link}", "weld", f"{link}.tip", f"of_{link}.root"))
    else:
        mass = {"mass": MASS, "center": CENTER}
        tables["payload"] = [{"point": f"{link}.tip", "inertia": of} | mass for link, of in MOMENTS.items()]
    return ffrobot.solve(ffrobot.make_scene(**tables))


def test_payloads_are_bodies_welded_to_their_links():
    """Without inertia about some axis they turn with their section, too."""
    with carried(False) as found, carried(True) as expected:
        for analysis in ("inverse", "fall", "implicit"):
            for key in KEYS + (MOMENTS_OF_MOTORS if analysis == "inverse" else ()):
                name = f"{analysis}/{key}"
                size = np.abs(expected[name]).max()
                np.testing.assert_allclose(found[name], expected[name], rtol=0, atol=1e-7 * size, err_msg=name)
