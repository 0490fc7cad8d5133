"""Peaks, limits and RMS do not depend on `output_step`: closed forms, and runs with a hundred times as many outputs."""

import warnings

import numpy as np
import pytest
from beam_links import beam_link, tube

import ffrobot
from ffrobot.mbs.run.samples import telling

J, M, C, G = 0.024, 0.2, 0.3, 9.81  # kg m² about the joint, kg, m, m/s²
QUINTIC = 10 / np.sqrt(3)  # largest acceleration of a quintic over a unit way in a unit time
ROD = {"mass": M, "inertia": J - M * C**2, "center": [C, 0.0], "points": {"root": [0.0, 0.0], "tip": [0.6, 0.0]}}
LINK = beam_link(0.6, tube(0.02, 0.016), 10, modes={"count": 3, "family": "in-plane-bending"}, damping={"ratio": 0.01})


def rod(path, step, kind="pcid", joint=(), **keys):
    joint = {"name": "O", "type": "revolute", "between": ["ground", "arm.root"]} | dict(joint)
    analysis = {"name": "inverse", "kind": kind, "end": 1.0, "output_step": step}
    shape = {"shape": "zero"} if kind == "fcid" else {}
    return {
        "name": "rod", "gravity": [0.0, 0.0], "body": [{"name": "arm", "rigid": ROD}], "joint": [joint],
        "trajectory": [{"name": "swing", "joint": "O"} | path], "analysis": [analysis | shape],
    } | keys  # fmt: skip


def flexible(step, space):
    """An arm that rings at its first mode, 22 Hz, and others, since its path starts with a jolt."""
    spatial = {"space": "spatial", "gravity": [0.0, 0.0, -G]}
    axis = {"axis": [0.0, -1.0, 0.0]} if space else {}
    family = ["in-plane-bending", "out-of-plane-bending"]
    link = LINK | {"modes": {"count": 3, "family": family}} if space else LINK
    return {
        "name": "arm", "gravity": [0.0, -G], "body": [{"name": "arm", "link": link}],
        "joint": [{"name": "O", "type": "revolute", "between": ["ground", "arm.root"], "moment_limit": 6.0} | axis],
        "payload": [{"point": "arm.tip", "mass": 0.5}], "initial": {"state": "static"},
        "trajectory": [{"name": "swing", "joint": "O", "value": "pi/4*(1 - cos(pi*t))"}],
        "analysis": [{"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": step}],
    } | (spatial if space else {})  # fmt: skip


def solve(scene):
    with warnings.catch_warnings():  # what tests look for is in the results
        warnings.simplefilter("ignore", ffrobot.FfrobotWarning)
        return ffrobot.solve(ffrobot.make_scene(**scene))


def motor(results):
    return results.verdict["inverse"].motors["O"]


@pytest.mark.parametrize("kind", ["pcid", "fcid"])
@pytest.mark.parametrize("step", [0.5, 0.01])
def test_a_quintic_has_its_closed_form_at_any_output_step(kind, step):
    """τ = J θ̈ at most 10/√3 J/T², at (3 − √3)/6 T; θ̇ 15/8; RMS of θ̈ over the run √(120/7)."""
    found = motor(solve(rod({"via": [0.0, 1.0], "duration": 1.0, "smoothness": 2}, step, kind)))
    assert found.moment == pytest.approx(QUINTIC * J, rel=1e-7)
    assert min(abs(found.moment_time - t) for t in ((3 - np.sqrt(3)) / 6, (3 + np.sqrt(3)) / 6)) < 1e-5
    assert found.speed == pytest.approx(15 / 8, rel=1e-7)
    assert found.rms_moment == pytest.approx(J * np.sqrt(120 / 7), rel=1e-5)


@pytest.mark.parametrize(("begin", "lasts"), [(0.51, 0.02), (0.5001, 0.0005)])
@pytest.mark.parametrize("kind", ["pcid", "fcid"])
def test_a_jump_of_the_path_between_outputs_is_in_the_peaks_and_reported(tmp_path, kind, begin, lasts):
    table = tmp_path / "jump.csv"
    table.write_text(f"t,value\n0,0\n{begin},0\n{begin + lasts},0.1\n1,0.1\n", encoding="utf-8")
    scene = rod({"waypoints": str(table)}, 0.1, kind, joint={"moment_limit": 1.0, "speed_limit": 2.0})
    results = solve(scene)
    one, found = results.verdict["inverse"], motor(results)
    assert not one.feasible
    assert found.moment == pytest.approx(QUINTIC * 0.1 / lasts**2 * J, rel=1e-5)
    assert found.speed == pytest.approx(15 / 8 * 0.1 / lasts, rel=1e-5)
    assert any('trajectory "swing": moves between outputs' in text for text in one.warnings)
    scene["analysis"][0]["output_step"] = 1.0 / round(20 / lasts)
    assert not any("between outputs" in text for text in solve(scene).verdict["inverse"].warnings)


@pytest.mark.parametrize("space", [pytest.param(False, marks=pytest.mark.nightly), True])
def test_peaks_of_a_ringing_arm_are_those_of_a_hundred_times_as_many_outputs(space):
    fine = solve(flexible(5e-5, space))
    moment = np.abs(fine["inverse/joints/O/moment"])
    power = np.abs(fine["inverse/joints/O/moment"] * fine["inverse/joints/O/rate"])
    deflection = np.linalg.norm(fine["inverse/points/arm.tip/deflection"], axis=1)
    for step in (0.5, 0.05):
        results = solve(flexible(step, space))
        one, found = results.verdict["inverse"], motor(results)
        assert not one.feasible
        assert found.moment == pytest.approx(moment.max(), rel=1e-5)
        assert found.moment_time == pytest.approx(fine.time("inverse")[moment.argmax()], abs=1e-4)
        assert found.power == pytest.approx(power.max(), rel=1e-4)
        assert found.rms_moment == pytest.approx(np.sqrt(np.mean(moment**2)), rel=1e-4)
        assert one.deflection[0] == pytest.approx(deflection.max(), rel=1e-5)
        peak = results.attributes("inverse/joints/O/moment")["peak"]
        assert peak == found.moment > np.abs(results["inverse/joints/O/moment"]).max() * 1.02


def test_of_what_rings_for_long_all_states_are_looked_at():
    """Seven a period, of which none follows from its neighbors by straight lines: peaks of a part are 10 % lower."""
    times = np.arange(200_000) * 1e-5
    ringing = np.stack([np.sin(2 * np.pi * times / 7e-5), np.cos(2 * np.pi * times / 7e-5)], axis=1)
    np.testing.assert_array_equal(telling(times, ringing, np.ones(2)), np.arange(len(times)))


def test_looking_between_outputs_leaves_the_outputs_as_they_are():
    """Steps do not end elsewhere: outputs of a coarse run are those of a fine one, to rounding of the interpolation."""
    coarse, fine = (solve(flexible(step, space=False)) for step in (0.25, 0.125))
    assert coarse.attributes("inverse")["steps"] > 1000
    for name in ("joints/O/moment", "points/arm.tip/position"):
        of_both = fine[f"inverse/{name}"][::2], coarse[f"inverse/{name}"]
        assert np.abs(of_both[0] - of_both[1]).max() < 1e-6 * np.abs(of_both[0]).max()


@pytest.mark.parametrize(
    ("times", "text"),
    [
        ((0.0, 2.0), "beyond the end"),
        ((0.0, 0.2), "rests until 1 s"),
        ((-0.5, 1.0), "begins at t = -0.5 s"),
        ((0.0, 1.0), ""),
    ],
)
def test_way_points_outside_the_run_are_reported(tmp_path, times, text):
    table = tmp_path / "path.csv"
    table.write_text("t,value\n{},0\n{},0.3\n".format(*times), encoding="utf-8")
    told = solve(rod({"waypoints": str(table)}, 0.01)).verdict["inverse"].warnings
    assert any(text in line for line in told) if text else not told


def test_rms_of_motors_alone_is_that_of_the_path():
    """Pre- and post-actuation, half a second each, leave the mean over the path as it is."""
    scene = flexible(0.002, space=False)
    scene["trajectory"][0]["value"] = "0.3*(126*t**5 - 420*t**6 + 540*t**7 - 315*t**8 + 70*t**9)"
    scene["joint"][0] |= {"gear_ratio": 100.0, "rotor_inertia": 1e-5}
    more = {"kind": "motors-only", "pre_actuation": 0.5, "post_actuation": 0.5}
    scene["analysis"] = [scene["analysis"][0] | more]
    results = solve(scene)
    time, moment = results.time("inverse"), results["inverse/joints/O/moment"]
    assert time[[0, -1]].tolist() == pytest.approx([-0.5, 1.5])
    path = moment[(time >= 0.0) & (time <= 1.0)]
    assert motor(results).rms_moment == pytest.approx(np.sqrt(np.trapz(path**2, dx=0.002)), rel=1e-5)  # noqa: NPY201
    assert "RMS" in str(results.verdict)
    assert "over the path" in str(results.verdict)


def by_both(scene):
    """Results of inverse dynamics and of motors only."""
    (inverse,) = scene["analysis"]
    return [solve(scene | {"analysis": [inverse | {"kind": kind}]}) for kind in ("pcid", "motors-only")]


def test_a_jolt_of_a_joint_that_only_motors_move():
    """A path of joints leaves links to themselves, as inverse dynamics does; collocation has a break at the jolt."""
    rate = np.pi / 6e-4
    scene = flexible(0.1, space=False)
    jolt = f"where(t < 0.1001, 0, where(t < 0.1007, 1e-6*sin({rate}*(t - 0.1001))**4, 0))"
    scene["trajectory"][0]["value"] = jolt
    by_inverse, by_motors = (motor(results).moment for results in by_both(scene))
    assert by_motors == pytest.approx(by_inverse, rel=1e-4)


@pytest.mark.parametrize("kind", ["pcid", "fcid"])
@pytest.mark.parametrize(
    ("pulse", "square"),
    [
        ("where(t < 0.5011, 0, where(t < 0.5011 + {w}, 8, 0))", 1.0),
        ("where(t < 0.5011, 0, where(t < 0.5011 + {w}, 8*sin(pi*(t - 0.5011)/{w}), 0))", 0.5),
        ("where(t < {w}, 8*sin(pi*t/{w}), 0)", 0.5),
        ("where(t <= 0.5011, 0, 8*exp(-(t - 0.5011)/{w}))", 0.5),
        ("8*exp(-((t - 0.50113)/{w})**2)", np.sqrt(np.pi / 2)),
    ],
)
def test_a_pulse_of_a_load_between_outputs(kind, pulse, square):
    """The motor alone bears a torque on its joint: its peak, and the RMS by ∫ of its square, 8² `square` w."""
    w = 1.5e-4
    load = [{"joint": "O", "moment": pulse.format(w=w)}]
    found = motor(solve(rod({"value": "0.05*t"}, 0.1, kind, load=load)))
    assert found.moment == pytest.approx(8.0, rel=1e-3)
    assert found.rms_moment == pytest.approx(8.0 * np.sqrt(square * w), rel=0.02)


BRIEF_STEP = "where(t < 0.5011, 0, where(t < 0.5011 + {w}, 1e-4*(10*{u}**3 - 15*{u}**4 + 6*{u}**5), 1e-4))"


@pytest.mark.parametrize("kind", ["pcid", "fcid"])
def test_a_brief_motion_is_followed_by_a_replay(kind):
    """The torque of a quintic between two outputs, in the peaks and in a simulation under it."""
    w = 5e-5
    path = {"value": BRIEF_STEP.format(w=w, u=f"((t - 0.5011)/{w})")}
    scene = rod(path, 0.1, kind)
    scene["analysis"].append({"name": "replay", "kind": "forward", "actuation": "inverse", "apply": "joints"})
    results = solve(scene)
    assert motor(results).moment == pytest.approx(QUINTIC * 1e-4 / w**2 * J, rel=1e-3)
    reached = results["replay/joints/O/coordinate"]
    assert reached[-1] == pytest.approx(1e-4, rel=1e-6)
    assert np.abs(reached - results["inverse/joints/O/coordinate"]).max() < 1e-10


@pytest.mark.parametrize("lasts", [5e-2, 1e-3, 1e-4])
def test_a_brief_load_while_only_motors_move(lasts):
    """A path of joints leaves links to themselves, as inverse dynamics does; collocation has breaks at the jumps."""
    scene = flexible(0.01, space=False)
    scene["trajectory"][0]["value"] = "0.3*(35*t**4 - 84*t**5 + 70*t**6 - 20*t**7)"
    force = f"where(t < 0.5011, 0, where(t < {0.5011 + lasts}, {2.5e-3 / lasts}, 0))"
    scene["load"] = [{"point": "arm.tip", "y": force}]
    by_inverse, by_motors = (
        one["inverse/joints/O/moment"][np.isin(one.time("inverse").round(9), np.arange(101) / 100)]
        for one in by_both(scene)
    )
    assert np.abs(by_motors - by_inverse).max() < 1e-5 * np.abs(by_inverse).max()


@pytest.mark.parametrize("body", [{"rigid": ROD}, {"link": LINK}], ids=["rigid", "flexible"])
def test_a_smooth_pulse_of_a_function_between_outputs(body):
    """80 exp(−((t − 0.50037)/w)²) N m on a joint that turns evenly: its motor bears that, RMS² = 80² w √(π/2)."""
    width = 1e-4
    load = [{"joint": "O", "moment": lambda t: 80 * np.exp(-(((t - 0.50037) / width) ** 2))}]
    found = motor(solve(rod({"value": "0.1*t"}, 0.1, body=[{"name": "arm"} | body], load=load)))
    assert found.moment == pytest.approx(80.0, rel=1e-2)
    assert found.rms_moment == pytest.approx(80.0 * np.sqrt(width * np.sqrt(np.pi / 2)), rel=2e-2)


def test_peaks_of_components_are_their_own():
    """Of a rod at rest, whose joint bears its weight alone."""
    results = solve(rod({"value": "0"}, 0.5, gravity=[0.0, -G]))
    found = [results.peak(f"inverse/joints/O/reaction{column}")[0] for column in ("[0]", "[1]", "")]
    assert found == pytest.approx([0.0, M * G, M * G], abs=1e-12)
