"""Paths as machines run them, in 3D: poses, motors behind gears, shapers, time scaling."""

import numpy as np
import pytest
import scenes_in_3d
import tables_3d
from beam_links import beam_link, rectangle
from checkpoints import CASES
from scipy.integrate import solve_ivp

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.common.rotations import exponential, logarithm, of_quaternion, of_rpy
from ffrobot.mbs.fields.paths import Impulse, impulses, law_in, law_peak
from ffrobot.run.fastest import least_stretch

RUN = {"name": "inverse", "kind": "pcid", "end": 0.5, "output_step": 0.002, "tolerance": 1e-10}


@pytest.mark.parametrize("held", [{"value": "60*deg"}, {"waypoints": "constant.csv"}])
def test_a_shaper_that_asks_the_robot_beside_a_held_joint(held, tmp_path):
    """The motion is over half a period of the frequency later (a ZV shaper)."""
    (tmp_path / "constant.csv").write_text(f"t,value\n0,{np.pi / 3!r}\n1,{np.pi / 3!r}\n", encoding="utf-8")
    moved = {"name": "O", "joint": "O", "via": [0.0, "20*deg"], "duration": 0.2, "shaper": {"kind": "zv"}}
    tables = scenes_in_3d.in_3d(scenes_in_3d.read(CASES / "two_link" / "scene.toml")) | {
        "trajectory": [moved, {"name": "A", "joint": "A", **held}], "analysis": [RUN],
        "initial": {"joints": scenes_in_3d.TWO_LINK},
    }  # fmt: skip
    with ffrobot.solve(scenes_in_3d.write(tables, tmp_path / "scene.toml")) as results:
        np.testing.assert_allclose(results["inverse/joints/A/coordinate"], np.pi / 3, rtol=0, atol=1e-9)
        about = results.attributes("inverse/trajectories/O")
        (frequency,) = about["shaper_frequency"]
        assert about["end"] - about["begin"] == pytest.approx(0.2 + 0.5 / frequency, rel=1e-3)  # half a period later


INERTIA, TURN = 0.3, 1.2
STILL = [0.0, 0.0, 0.0]
BODY = tables_3d.rigid("arm", 2.0, [0.2, 0.2, INERTIA])


def arm(path, joint=None, end=2.0, body=BODY, **keys):
    """One body on a shoulder about z."""
    shoulder = tables_3d.revolute("shoulder", "ground", "arm.root", **(joint or {}))
    swing = {"name": "swing", "via": [0.0, TURN]} | ({} if "motor" in path else {"joint": "shoulder"}) | path
    run = {"name": "inverse", "kind": "pcid", "end": end, "output_step": 1e-3, **keys}
    return ffrobot.make_scene(**tables_3d.scene([body], [shoulder], run, gravity=STILL, trajectory=[swing]))


@pytest.mark.parametrize("limit", [0.5, 30.0])
def test_fastest_rigid_arm_takes_its_limit(limit):
    """I h p/(s T)² = limit, where p is the peak acceleration of the law."""
    results = ffrobot.solve(arm({"duration": 0.5, "fastest": True}, {"moment_limit": limit}, end=4.0))
    exact = np.sqrt(INERTIA * TURN * law_peak(4, 2) / limit) / 0.5
    found = results.attributes("inverse/trajectories/swing")["stretch"]
    assert exact <= found * (1 + 1e-4)  # a peak lies between outputs
    assert found <= 1.0051 * exact
    assert np.abs(results["inverse/joints/shoulder/moment"]).max() <= limit * (1 + 1e-9)


def test_limits_of_the_path_hold_for_the_fastest_motion():
    """Motors that are strong enough leave the path as it is."""
    results = ffrobot.solve(arm({"speed": 1.0, "acceleration": 5.0, "fastest": True}, {"moment_limit": 100.0}, end=3.0))
    assert results.attributes("inverse/trajectories/swing")["stretch"] == 1.0


@pytest.mark.parametrize(
    ("joint", "end", "says"),
    [
        ({}, 2.0, "expected limits of motors"),
        ({"moment_limit": 0.05}, 2.0, 'end = 2 s of "inverse", found motor shoulder, with required/available ='),
        ({"moment_limit": 0.05}, 0.4, "expected a path that is over before"),
    ],
)
def test_what_cannot_be_made_faster_says_so(joint, end, says):
    with pytest.raises(InputError, match=says):
        ffrobot.solve(arm({"speed": 4.0, "acceleration": 40.0, "fastest": True}, joint, end))


@pytest.mark.parametrize("limit", [0.013, 0.4, 1.0, 7.7])
def test_least_stretch_is_found_from_both_sides(limit):
    tried = []
    found = least_stretch(lambda stretch: tried.append(stretch) or stretch >= limit, 0.01, 10.0)
    assert limit <= found <= 1.005 * limit
    assert len(tried) < 22


def test_shapers_know_the_robot():
    """With its joint held the arm is a cantilever: 1.8751² √(EI/ρA)/(2π L²) of its weaker plane, out of the swing.

    Its damping ratios πbf differ, and the shaper of each takes its own period, 1/(f √(1 − (πbf)²)).
    """
    link = beam_link(
        0.8,
        rectangle(4e-3, 3e-3),
        12,
        modes={"count": 3, "family": ["in-plane-bending", "out-of-plane-bending"], "attachment_modes": False},
        damping={"rayleigh": [0.0, 0.01]},
    )
    found = ffrobot.solve(
        arm({"duration": 0.5, "shaper": {"kind": "zvd", "modes": 2}}, body={"name": "arm", "link": link})
    )
    exact = [1.8751041**2 * np.sqrt(70e9 * h**2 / 12 / 2700.0) / (2 * np.pi * 0.8**2) for h in (3e-3, 4e-3)]
    about = found.attributes("inverse/trajectories/swing")
    f = about["shaper_frequency"]
    assert f == pytest.approx(exact, rel=1e-4)
    assert about["end"] == pytest.approx(0.5 + np.sum(1 / (f * np.sqrt(1 - (0.01 * np.pi * f) ** 2))), rel=1e-9)


GEAR = {"gear_ratio": 50.0, "rotor_inertia": 2e-5, "stiffness": 400.0, "damping": 0.5}


@pytest.mark.parametrize("shaper", [None, {"kind": "zvd"}])
def test_a_motor_goes_and_its_gear_swings(shaper):
    """I γ̈ = k (θ − γ) + c (θ̇ − γ̇) with θ(t) given; the motor does J N² θ̈ besides. ω² = k/I, ζ = c/(2 I ω)."""
    path = {"motor": "shoulder", "profile": "s-curve", "duration": 0.2} | ({"shaper": shaper} if shaper else {})
    found = ffrobot.solve(arm(path, GEAR, end=1.0, tolerance=1e-10))
    k, c, J = GEAR["stiffness"], GEAR["damping"], GEAR["rotor_inertia"] * GEAR["gear_ratio"] ** 2
    omega = np.sqrt(k / INERTIA)
    zeta, motion = c / (2 * INERTIA * omega), law_in(0.2, "s-curve", 2)
    parts = impulses("zvd", omega / (2 * np.pi), zeta) if shaper else [Impulse(1.0, 0.0)]

    def target(t, order):
        return TURN * sum(part.share * motion.sample(np.atleast_1d(t) - part.delay, order)[:, 0] for part in parts)

    def slope(t, y):
        twist, rate = target(t, 0)[0] - y[0], target(t, 1)[0] - y[1]
        return [y[1], (k * twist + c * rate) / INERTIA]

    t = found["inverse/time"]
    y = solve_ivp(slope, (0.0, t[-1]), [0.0, 0.0], t_eval=t, rtol=1e-10, atol=1e-13, max_step=2e-3).y
    np.testing.assert_allclose(found["inverse/joints/shoulder/coordinate"], y[0], atol=1e-7)
    np.testing.assert_allclose(found["inverse/joints/shoulder/motor_angle"], target(t, 0), atol=1e-9)
    expected = J * target(t, 2) + k * (target(t, 0) - y[0]) + c * (target(t, 1) - y[1])
    smooth = np.min([np.abs(t - b - p.delay) for b in motion.breaks for p in parts], axis=0) > 2e-3  # jerk jumps there
    np.testing.assert_allclose(
        found["inverse/joints/shoulder/moment"][smooth], expected[smooth], atol=1e-5 * np.abs(expected).max()
    )
    if shaper:
        of_path = found.attributes("inverse/trajectories/swing")
        assert of_path["shaper_frequency"] == pytest.approx([omega / (2 * np.pi)], rel=1e-9)
        late = t > of_path["end"]
        assert np.abs(y[0][late] - TURN).max() < 1e-4 * TURN
        assert np.abs(found["inverse/joints/shoulder/coordinate"][late] - TURN).max() < 1e-6 * TURN


def posed(via, **keys):
    """A body without joints that goes through poses."""
    body = {"mass": 2.0, "inertia": [0.2, 0.3, 0.4], "center": [0.1, 0.0, 0.05]}
    return ffrobot.make_scene(
        name="posed", space="spatial", gravity=[0.0, 0.0, -9.81],
        body=[{"name": "part", "rigid": body | {"points": {"grip": [0.2, -0.1, 0.3]}}}],
        trajectory=[{"name": "way", "point": "part.grip", "via": via, **keys}],
        analysis=[{"name": "inverse", "kind": "pcid", "end": 1.5, "output_step": 0.005, "tolerance": 1e-9}],
    )  # fmt: skip


FROM, TO = [0.1, 0.2, 0.3, 0.0, "90*deg", -0.3], [0.5, -0.1, 0.4, 0.4, "80*deg", 1.3]


def test_a_part_turns_about_a_fixed_axis_between_two_poses():
    """r = r₀ + s Δr and A = exp(s φ~) A₀, φ the rotation vector of A₁ A₀ᵀ, with the s of the law for both."""
    found = ffrobot.solve(posed([FROM, TO], duration=0.8, start=0.2))
    s = law_in(0.8, "rest-to-rest", 4).sample(found["inverse/time"] - 0.2)
    begin, end = np.array([0.1, 0.2, 0.3]), np.array([0.5, -0.1, 0.4])
    A_0, A_1 = of_rpy(0.0, np.pi / 2, -0.3), of_rpy(0.4, np.radians(80.0), 1.3)
    np.testing.assert_allclose(found["inverse/points/part.grip/position"], begin + s * (end - begin), atol=1e-8)
    A = of_quaternion(found["inverse/points/part.grip/quaternion"])
    np.testing.assert_allclose(A, exponential(s * logarithm(A_1 @ A_0.T)) @ A_0, atol=1e-8)


def test_a_part_rests_in_every_pose():
    via = [FROM, [0.3, 0.2, 0.5, 0.0, 1.2, 0.5], [0.3, 0.2, 0.5, 0.6, 0.9, 0.8], TO]  # it turns in place from 1 to 2
    found = ffrobot.solve(posed(via, duration=[0.5, 0.3, 0.4], hold=0.05, profile="s-curve"))
    t, name = found["inverse/time"], "inverse/bodies/part"
    for instant, place in ((0.0, via[0]), (0.5, via[1]), (0.55, via[1]), (0.85, via[2]), (0.9, via[2]), (1.3, via[3])):
        k = int(np.abs(t - instant).argmin())
        np.testing.assert_allclose(found["inverse/points/part.grip/position"][k], place[:3], atol=1e-8)
        angles = [np.radians(float(x.removesuffix("*deg"))) if isinstance(x, str) else x for x in place[3:]]
        A = of_quaternion(found["inverse/points/part.grip/quaternion"][k])
        np.testing.assert_allclose(A, of_rpy(*angles), atol=1e-8)
        for rate in ("velocity", "angular_velocity"):
            np.testing.assert_allclose(found[f"{name}/{rate}"][k], 0.0, atol=1e-7)
    turning = (t > 0.56) & (t < 0.84)
    place = found["inverse/points/part.grip/position"][turning]
    np.testing.assert_allclose(place, [[0.3, 0.2, 0.5]] * len(place), atol=1e-8)
    assert np.abs(found[f"{name}/angular_velocity"][turning]).max() > 1.0


def test_places_go_with_an_orientation_of_their_own():
    """via of three numbers beside rpy: both are followed."""
    found = ffrobot.solve(posed([FROM[:3], TO[:3]], duration=0.8, rpy=["0.1", "0.2*t", "-0.3"]))
    t = found["inverse/time"]
    A = of_quaternion(found["inverse/points/part.grip/quaternion"])
    np.testing.assert_allclose(A, np.array([of_rpy(0.1, 0.2 * x, -0.3) for x in t]), atol=1e-8)
    np.testing.assert_allclose(found["inverse/points/part.grip/position"][-1], TO[:3], atol=1e-8)


@pytest.mark.parametrize(
    ("via", "keys", "told"),
    [
        (
            [[0.0] * 4, [1.0] * 4],
            {"duration": 1.0},
            r"expected places \[x, y\] or \[x, y, z\] or .*, all alike, in via",
        ),
        ([[0.0] * 3, [1.0] * 6], {"duration": 1.0}, "all alike, in via"),
        ([FROM, TO], {"speed": 1.0}, 'expected a "duration" with poses in via'),
        ([FROM, TO], {"duration": 1.0, "rpy": ["0", "0", "0"]}, 'expected an orientation either in via or by "rpy"'),
        ([FROM[:3], TO[:3]], {"duration": 1.0, "x": "t"}, "expected either waypoints, via or expressions"),
        ([FROM[:3], TO[:3]], {}, r'expected either limits \(.*\) or a "duration" with "via", found neither'),
        ([[0.0] * 3 + [0, 0, a] for a in (0, 3, 6)], {"duration": 1.0}, "place no. .: expected orientations within"),
    ],
)
def test_mistakes_in_places_are_told(via, keys, told):
    with pytest.raises(InputError, match=told):
        ffrobot.solve(posed(via, **keys))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"joint": {"motor": False}}, 'motor: expected a joint with a motor, found "shoulder", which has none'),
        ({"analysis": {"kind": "fcid", "shape": "zero"}}, 'expected "pcid" or "static" with trajectories of motors'),
        ({"path": {"joint": "shoulder"}}, 'exactly one of the keys "point", "joint", "angle", "motor"'),
    ],
)
def test_mistakes_with_motors_are_told(change, told):
    joint = change.get("joint", {"stiffness": 400.0, "rotor_inertia": 2e-5})
    scene_keys = change.get("analysis", {})
    with pytest.raises(InputError, match=told):
        ffrobot.solve(arm({"motor": "shoulder", "duration": 0.2} | change.get("path", {}), joint, **scene_keys))
