"""Sampled control: against exact discrete models of rigid arms, closed forms of links, and what goes wrong."""

import runpy
from dataclasses import replace

import numpy as np
import pytest
from beam_links import beam_link, paper_link, rectangle, tube
from scipy.linalg import expm, solve_discrete_are

import ffrobot
from ffrobot.actuation.context import ActuatedContext
from ffrobot.actuation.control.lqr import gains
from ffrobot.actuation.control.robot import RigidArm, volts_on_file
from ffrobot.actuation.control.sampling import sampled
from ffrobot.common.errors import InputError, SolveError
from ffrobot.common.python_files import python_allowed
from ffrobot.mbs.quantities.motion import joint_motion, node_of
from ffrobot.mbs.quantities.supply import motor_moments
from ffrobot.pictures.figures.standard import standard_figures
from ffrobot.results.file import Results
from ffrobot.results.write import results_image
from ffrobot.run.solve import prepare_scene, solve_scene
from ffrobot.scene.load import make_scene

INERTIA, T = 0.5, 0.01
ROD = {"mass": 2.0, "inertia": 2.0 / 12, "center": [0.5, 0.0], "points": {"root": [0.0, 0.0], "tip": [1.0, 0.0]}}
ARM = {"O": {"joint": "O", "value": "0.4+0.9*sin(2*t)"}, "A": {"joint": "A", "value": "-1.1+0.7*cos(3*t)"}}
PID = {"kind": "joint-pid", "proportional": {"O": 20.0}, "derivative": {"O": 4.0}}


def loop(name="loop", **keys):
    return {"name": name, "kind": "closed-loop", "actuation": "inverse", "sample_time": T} | keys


def wheel(*analyses, joint=None, target="0", bodies=(), joints=(), gravity=(0.0, 0.0), **keys):
    """A wheel about O that is to stand still, or to follow `target`: I γ̈ = u, the simplest plant."""
    body = {"mass": 1.0, "inertia": INERTIA, "center": [0.0, 0.0], "points": {"root": [0.0, 0.0], "rim": [0.3, 0.0]}}
    revolute = {"name": "O", "type": "revolute", "between": ["ground", "w.root"]} | (joint or {})
    step = keys.pop("step", T)
    inverse = {"name": "inverse", "kind": "pcid", "end": 0.5, "output_step": step, "tolerance": 1e-9}
    return make_scene(
        name="wheel", gravity=gravity, body=[{"name": "w", "rigid": body}, *bodies], joint=[revolute, *joints],
        trajectory=[{"name": "stand", "joint": "O", "value": target}], analysis=[inverse, *analyses], **keys,
    )  # fmt: skip


def blow(force=5.0, until=0.1):
    return [{"point": "w.rim", "y": f"where(t <= {until}, {force}, 0)"}]


def two_rods(*analyses, **keys):
    joints = [
        {"name": "O", "type": "revolute", "between": ["ground", "a.root"]} | keys.pop("first", {}),
        {"name": "A", "type": "revolute", "between": ["a.tip", "b.root"]} | keys.pop("second", {}),
    ]
    inverse = {"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": 0.01, "tolerance": 1e-8}
    return make_scene(
        name="rods", gravity=[0.0, -9.81], body=[{"name": "a", "rigid": ROD}, {"name": "b", "rigid": ROD}],
        joint=joints, trajectory=[{"name": name} | path for name, path in keys.pop("paths", ARM).items()],
        initial={"angles": {"a": 0.4, "b": 0.0}}, analysis=[inverse, *analyses], **keys,
    )  # fmt: skip


def moving_at(rates, scene):
    """The closed loop of a wheel's scene about an inverse analysis that is to have found these rates (T,)."""
    context = ActuatedContext(model=prepare_scene(scene).model, outcomes={}, progress=lambda _: True, is_replayed=True)
    inverse, analysis = scene.analysis
    source = inverse.run(context)
    source = replace(source, v=rates(source.v), look_closer=None)
    return analysis.run(replace(context, outcomes={"inverse": source}))


@pytest.mark.parametrize("delay", [0.0, 0.004, T, 2.5 * T])
@pytest.mark.parametrize("resolution", [0.0, 1e-4])
def test_a_sampled_loop_is_its_exact_discrete_model(delay, resolution):
    """x(k+1) = A x(k) + B u with the commands that are on their way as states; a start off the reference by a rate."""
    scene = wheel(
        loop(controller=[PID], delay=delay, sensor=[{"joint": "O", "resolution": resolution}]),
        initial={"rates": {"w": 0.0}},
    )
    start = 0.3
    outcome = moving_at(lambda v: np.where(np.arange(len(v))[:, None] == 0, start, 0.0), scene)
    record = outcome.details
    assert outcome.status == "completed"

    A, B = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1 / INERTIA]])
    model = sampled(A, B, T, delay)
    x = np.zeros(len(model.A))
    x[1] = start
    reference, y = record.reference, np.zeros((len(record.time), 2))
    for k in range(len(record.time)):
        y[k] = x[:2]
        if resolution:
            y[k, 0] = np.round(y[k, 0] / resolution) * resolution
        e = reference[k] - y[k]
        x = model.A @ x + model.B[:, 0] * (20.0 * e[0] + 4.0 * e[1])
    np.testing.assert_allclose(record.readings, y, atol=1e-7 * np.abs(y).max())
    assert np.abs(record.readings[:, 0]).max() > 1e-3


def test_units_of_commands_do_not_decide_on_the_discrete_model():
    A, B = np.array([[0.0, 1.0], [-2.0, -0.1]]), np.array([[0.0], [3.0]])
    plain, huge = (sampled(A, unit * B, T, 0.0) for unit in (1.0, 1e30))
    np.testing.assert_allclose(huge.A, plain.A, rtol=1e-12)
    np.testing.assert_allclose(huge.B, 1e30 * plain.B, rtol=1e-12)


def test_commands_stop_at_the_limits_of_the_motors():
    outcomes = solve_scene(wheel(loop(controller=[PID], disturbance=blow()), joint={"moment_limit": 0.5}))
    record = outcomes.outcomes["loop"].details
    assert np.abs(record.commands).max() == 0.5 == record.metrics.peak_moment
    assert np.abs(record.wanted).max() > 0.6
    cut = (np.abs(record.wanted) > 0.5).any(axis=1).mean()
    assert record.metrics.saturated == cut > 0


def test_noise_is_that_of_the_seed():
    def readings(seed):
        sensor = [{"joint": "O", "measure": "rate", "noise": 0.02}, {"joint": "O"}]
        scene = wheel(loop(sensor=sensor, seed=seed))
        record = solve_scene(scene).outcomes["loop"].details
        return record.readings[:, record.outputs.index("joint/O/rate")]

    first, again, other = readings(1), readings(1), readings(2)
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.01
    assert np.std(first) == pytest.approx(0.02, rel=0.3)  # 50 samples


def test_the_points_accelerometer_feels_the_blow():
    """F = 5 N at the rim, 0.3 m from O: a_y = r (F r)/I as long as the wheel has hardly turned."""
    sensor = [{"point": "w.rim", "measure": "acceleration"}]
    record = solve_scene(wheel(loop(sensor=sensor, disturbance=blow()))).outcomes["loop"].details
    column = record.outputs.index("point/w.rim/y/acceleration")
    assert record.readings[1, column] == pytest.approx(0.3 * 5.0 * 0.3 / INERTIA, rel=1e-3)
    assert record.readings[20, column] == pytest.approx(0.0, abs=0.2)


@pytest.mark.parametrize("lasts", [1e-3, 2e-5])
def test_brief_disturbances_are_felt(lasts):
    """Without control, I γ̇ = 0.3 m · 5 N for as long as it lasts, between two of the samples."""
    push = [{"point": "w.rim", "y": f"where(t < 0.2031, 0, where(t < {0.2031 + lasts!r}, 5, 0))"}]
    run = solve_scene(wheel(loop(disturbance=push, feed_forward="none", tip="w.rim"))).outcomes["loop"]
    assert run.v[-1, 0] == pytest.approx(0.3 * 5.0 * lasts / INERTIA, rel=1e-6)


@pytest.mark.parametrize(("delay", "step"), [(0.0, T), (0.004, 0.1), (2.5 * T, 0.1)])
def test_means_are_those_of_commands_that_are_held(delay, step):
    """RMS and work of a motor, ∫ τ γ̇ by ∫ τ dγ with constant τ from change to change, by sampled commands alone."""
    held = {"controller": [PID | {"integral": {"O": 30.0}}], "delay": delay, "feed_forward": "none"}
    held |= {"disturbance": blow(until=0.1), "sensor": [{"joint": "O", "resolution": 2e-3}]}
    with ffrobot.solve(wheel(loop(output_step=step, **held))) as results:
        moment, joint, error, seen = (
            results.attributes(f"loop/{name}") for name in ("joints/O/moment", "joints/O", "tip_error", "control")
        )
        commands = results["loop/control/commands"][:, 0]
        changes = np.minimum(np.append(results["loop/control/time"] + delay, 0.5), 0.5)
    lasts = np.diff(changes) / 0.5
    assert np.ptp(commands) > 0.1
    assert moment["rms"] == pytest.approx(np.sqrt(commands**2 @ lasts), rel=1e-6)
    assert moment["mean"] == pytest.approx(commands @ lasts, rel=1e-6, abs=1e-9)
    with ffrobot.solve(wheel(loop(output_step=1e-4, **held))) as fine:
        gamma = np.interp(changes, fine.time("loop"), fine["loop/joints/O/coordinate"])
        distance = fine["loop/tip_error"]
    assert joint["mean_power"] == pytest.approx(commands @ np.diff(gamma) / 0.5, rel=1e-3)
    assert (error["peak"], error["rms"]) == (seen["tip_error_max"], seen["tip_error_rms"])
    assert error["peak"] == pytest.approx(distance.max(), rel=1e-5)


@pytest.mark.parametrize("step", [0.25, T])
def test_references_do_not_depend_on_outputs(step):
    """The path and its rate at samples; within these the tip, 0.3 m away, errs by no more than γ̈ T² of them."""
    target = "0.4*(10*(2*t)**3 - 15*(2*t)**4 + 6*(2*t)**5)"
    record = solve_scene(wheel(loop(controller=[PID], tip="w.rim"), target=target, step=step)).outcomes["loop"].details
    u = 2.0 * record.time
    path = 0.4 * u**3 * (10.0 - 15.0 * u + 6.0 * u**2), 24.0 * u**2 * (1.0 - u) ** 2
    np.testing.assert_allclose(record.reference.T, path, atol=1e-8)
    assert record.metrics.tip_error_max < 0.3 * 16.0 / np.sqrt(3.0) * T**2
    assert record.metrics.verdict == "stable"


def test_rigid_arm_knows_the_moments_of_the_inverse_analysis():
    built = {"gear_ratio": 30.0, "rotor_inertia": 1e-3, "viscous_friction": 0.2, "coulomb_friction": 0.5}
    solution = solve_scene(two_rods(first=built, second=built))
    inverse = solution.outcomes["inverse"]
    t = inverse.time
    gamma = np.column_stack([0.4 + 0.9 * np.sin(2 * t), -1.1 + 0.7 * np.cos(3 * t)])
    rate = np.column_stack([1.8 * np.cos(2 * t), -2.1 * np.sin(3 * t)])
    acceleration = np.column_stack([-3.6 * np.sin(2 * t), -6.3 * np.cos(3 * t)])
    arm = RigidArm(solution.model.without_paths(), inverse.q[0])
    moments = np.array([arm.moments(*state) for state in zip(gamma, rate, acceleration, strict=True)])
    found = motor_moments(solution.analyses["inverse"].run)
    tau = np.column_stack([found[joint] for joint in "OA"])
    np.testing.assert_allclose(moments, tau, atol=1e-8 * np.abs(tau).max())


def test_peaks_of_what_rings_do_not_depend_on_outputs():
    """A tube that is hit rings at 100 Hz and more between samples: outputs far apart, and closer than its periods."""

    def found(step):
        joint = {"name": "O", "type": "revolute", "between": ["ground", "arm.root"], "rotor_inertia": 0.05}
        link = beam_link(0.5, tube(0.03, 0.026), 10, nu=None, modes={"count": 5, "family": "in-plane-bending"})
        inverse = {"name": "inverse", "kind": "pcid", "end": 0.2, "output_step": step}
        hit = [{"point": "arm.tip", "y": "where(t < 0.0007, 200, 0)"}]
        control = loop(sample_time=1e-3, controller=[PID], disturbance=hit)
        scene = make_scene(
            name="rings", gravity=[0.0, 0.0], body=[{"name": "arm", "link": link}], joint=[joint],
            trajectory=[{"name": "stand", "joint": "O", "value": "0"}], analysis=[inverse, control],
        )  # fmt: skip
        results = ffrobot.solve(scene)
        seen = {of: results.attributes(f"loop/joints/O/{of}") for of in ("rate", "reaction", "moment")}
        rates = results["loop/joints/O/rate"]
        return [about[key] for about in seen.values() for key in ("peak", "rms")], np.abs(rates).max()

    (far, _), (near, highest) = found(0.1), found(1e-4)
    # the force has eight steps in a period of the fastest mode, between which its peak is that of a polynomial
    assert np.all(np.abs(np.array(far) / near - 1) < [1e-3, 1e-3, 6e-3, 1e-3, 1e-3, 1e-3])
    assert far[0] == pytest.approx(highest, rel=3e-3)  # a tenth of a period of the fastest mode between outputs


def test_peaks_of_long_runs_do_not_depend_on_outputs():
    """68 000 steps, in the midst of which a load that lasts 3 ms jumps."""

    def found(step):
        link = beam_link(
            0.5, rectangle(0.012, 0.03), 8, nu=0.33, modes={"count": 2, "family": "in-plane-bending"},
            damping={"ratio": 0.003},
        )  # fmt: skip
        pid = {"kind": "joint-pid", "proportional": {"O": 60.0}, "derivative": {"O": 2.0}}
        hit = [{"point": "arm.tip", "y": "where(t < 1.85, 0, where(t < 1.8533, 300, 0))"}]
        scene = make_scene(
            name="long", gravity=[0.0, -9.81], body=[{"name": "arm", "link": link}],
            joint=[{"name": "O", "type": "revolute", "between": ["ground", "arm.root"], "rotor_inertia": 0.05}],
            trajectory=[{"name": "way", "joint": "O", "value": "0.3*sin(4.4*t)**3"}],
            analysis=[
                {"name": "inverse", "kind": "pcid", "end": 3.0, "output_step": 0.006},
                loop(sample_time=1e-3, delay=5e-4, controller=[pid], disturbance=hit, output_step=step),
            ],
        )  # fmt: skip
        with ffrobot.solve(scene) as results:
            seen = [results.attributes(f"loop/joints/O/{of}") for of in ("rate", "reaction", "moment")]
            assert results.attributes("loop")["steps"] > 50_000
        return np.array([about[key] for about in seen for key in ("peak", "rms")])

    np.testing.assert_allclose(found(0.01), found(1e-3), rtol=5e-4)


def test_the_rigid_arm_says_where_its_links_do_not_reach():
    """A slider driven at 0.35 m from the crank's axis; crank and rod are 0.4 m long in all."""

    def bar(length):
        return {"mass": 1.0, "inertia": 0.01, "center": [0.0, 0.0], "points": {"a": [0.0, 0.0], "b": [length, 0.0]}}

    def joint(name, kind, *between, **keys):
        return {"name": name, "type": kind, "between": between} | keys

    scene = make_scene(
        name="slider", gravity=[0.0, 0.0],
        body=[{"name": name, "rigid": bar(length)} for name, length in (("c", 0.1), ("r", 0.3), ("s", 0.1))],
        joint=[joint("O", "revolute", "ground", "c.a"), joint("A", "revolute", "c.b", "r.a"),
               joint("B", "revolute", "r.b", "s.a"),
               joint("S", "prismatic", "ground", "s.a", axis=[1.0, 0.0], motor=True)],
        initial={"angles": {"c": 1.0, "r": -0.3, "s": 0.0}}, trajectory=[{"name": "t", "joint": "S", "value": "0.35"}],
        analysis=[{"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.1}],
    )  # fmt: skip
    solution = solve_scene(scene)
    arm = RigidArm(solution.model.without_paths(), solution.outcomes["inverse"].q[0])
    q, crank = arm.place(np.array([0.36]))[0], (0.36**2 + 0.1**2 - 0.3**2) / (2 * 0.36 * 0.1)  # law of cosines
    assert np.abs(np.cos(q) - crank).min() < 1e-9
    with pytest.raises(SolveError, match="expected joint angles that the rigid links can have, found"):
        arm.place(np.array([0.45]))


def test_gains_on_the_motors_side_stand_beside_a_rigid_gear():
    """Also where advice for the loop, which is not stable, tries gains for all motors."""
    still = {"O": {"joint": "O", "value": "0.4"}, "A": {"joint": "A", "value": "-1.1"}}
    wild = ON_MOTORS | {"derivative": {"O": 1e5}}
    record = solve_scene(two_rods(loop(controller=[wild]), first=GIVES, paths=still)).outcomes["loop"].details
    assert record.margins.radius > 1.0
    assert record.advice


def test_computed_torque_follows_without_any_feed_forward_better_the_faster_it_samples():
    def error(sample_time):
        control = [{"kind": "computed-torque", "bandwidth": 20.0}]
        scene = two_rods(loop(controller=control, sample_time=sample_time, feed_forward="none", tip="b.tip"))
        return solve_scene(scene).outcomes["loop"].details.metrics.tip_error_max

    coarse, fine = error(0.01), error(0.0025)
    assert coarse < 0.05
    assert fine < coarse / 3.5  # first order in the sample time


def test_lqr_gains_are_those_of_scipy():
    A, B = np.array([[0.0, 1.0], [-4.0, -0.1]]), np.array([[0.0], [2.0]])
    Q, R = np.diag([100.0, 1.0]), np.array([[0.04]])
    model = sampled(A, B, T, 0.0)
    X = solve_discrete_are(model.A, model.B, Q, R)
    expected = np.linalg.solve(R + model.B.T @ X @ model.B, model.B.T @ X @ model.A)
    np.testing.assert_allclose(gains(model, Q, R), expected, rtol=1e-9)


def test_lqr_damps_the_wheel_as_its_own_model_says():
    control = [{"kind": "lqr", "angle": 0.01, "rate": 0.1, "moment": 1.0}]
    scene = wheel(loop(controller=control, delay=0.015, disturbance=blow(until=0.1)))
    record = solve_scene(scene).outcomes["loop"].details
    assert record.metrics.verdict == "stable"
    assert np.abs(record.readings[-1, 0]) < 0.05 * np.abs(record.readings[:, 0]).max()
    assert not [line for line in record.warnings if "LQR" in line]


def test_a_function_of_the_user_acts_like_the_same_controller_of_the_scene(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(
        "import numpy as np\n\n"
        "def controller(setup):\n"
        "    y_O, y_rate = setup.columns('joint/O', 'joint/O/rate')\n"
        "    (u_O,) = setup.places('joint/O')\n"
        "    def at_sample(k, y):\n"
        "        u, e = np.zeros(len(setup.inputs)), setup.reference[k] - y\n"
        "        u[u_O] = 20.0 * e[y_O] + 4.0 * e[y_rate]\n"
        "        return u\n"
        "    return at_sample\n"
    )
    sensor = [{"joint": "O"}, {"joint": "O", "measure": "rate"}]
    mine = {"kind": "python", "python": f"{file}:controller"}
    itself = {"kind": "python", "python": runpy.run_path(str(file))["controller"]}
    loops = [
        loop("itself", controller=[itself], sensor=sensor, disturbance=blow()),
        loop("theirs", controller=[PID], sensor=sensor, disturbance=blow()),
        loop("mine", controller=[mine], sensor=sensor, disturbance=blow()),
    ]
    with python_allowed([tmp_path]):
        solution = solve_scene(wheel(*loops))
    theirs, own = solution.outcomes["theirs"].details, solution.outcomes["mine"].details
    np.testing.assert_allclose(own.commands, theirs.commands, atol=1e-12)
    np.testing.assert_array_equal(solution.outcomes["itself"].details.commands, own.commands)
    assert np.abs(own.commands).max() > 0.5


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("return np.full(3, np.nan)", r"expected 1 finite commands, shape \(1,\)"),
        ("return y[99]", r"IndexError: .* \(line \d+ of \w+\.py, in \w+\)"),
        ("return 10**400", r"OverflowError: int too large to convert to float"),
        (
            "return setup.columns('none')",
            r'InputError: .*expected readings, "joint/O", found "none" \(line \d+ of \w+\.py, in \w+\)',
        ),
    ],
)
def test_what_a_users_function_does_wrong_is_said(tmp_path, body, expected):
    file = tmp_path / "mine.py"
    file.write_text(f"import numpy as np\ndef controller(setup):\n    def act(k, y):\n        {body}\n    return act\n")
    mine = {"kind": "python", "python": f"{file}:controller"}
    with python_allowed([tmp_path]), pytest.raises(SolveError, match=f"sample 0, t = 0 s: {expected}"):
        solve_scene(wheel(loop(controller=[mine], sensor=[{"joint": "O"}])))


def test_unstable_gains_are_reported_and_the_results_kept():
    """Derivative gain beyond 2 I/T: every sample overshoots. The run after it is made all the same."""
    wild = {"kind": "joint-pid", "proportional": {"O": 1.0}, "derivative": {"O": 3 * INERTIA / T}}
    scene = wheel(loop("wild", controller=[wild], disturbance=blow(until=0.02)), loop("calm", controller=[PID]))
    solution = solve_scene(scene)
    wild, calm = solution.outcomes["wild"].details, solution.outcomes["calm"].details
    rate = wild.readings[:, wild.outputs.index("joint/O/rate")]
    # ω(k+1) = ω(k) (1 − 3) once the blow is over; the proportional part, T²/I of the rate, adds 2e-4.
    np.testing.assert_allclose(rate[4:] / rate[3:-1], -2.0, rtol=1e-3)
    assert calm.metrics.verdict == "stable"
    results = Results.from_image(results_image(solution), scene.path)
    assert results.has("wild/control/commands")
    assert results.attributes("calm/control")["verdict"] == "stable"
    assert len(results.time("calm/control/commands")) == len(results["calm/control/readings"]) == 50
    (figure,) = [figure for figure in standard_figures(results) if figure.name == "tip_error"]
    assert [curve.label for curve in figure.curves] == ["wild", "calm"]


@pytest.mark.parametrize(("factor", "verdict"), [(-1.1, "grows"), (-0.9, "stable")])
def test_verdict_is_that_of_the_sampled_rate(factor, verdict):
    """Derivative gain (1 − factor) I/T: the rate at the start is multiplied by `factor` at every sample."""
    gains = {"kind": "joint-pid", "derivative": {"O": (1 - factor) * INERTIA / T}}
    scene = wheel(loop(controller=[gains], tip="w.rim"), initial={"rates": {"w": 0.0}})
    record = moving_at(lambda v: np.where(np.arange(len(v))[:, None] == 0, 0.01, 0.0), scene).details
    rate = record.readings[:, record.outputs.index("joint/O/rate")]
    assert rate[0] == 0.01  # as the inverse analysis has it
    np.testing.assert_allclose(rate[1:], 0.01 * factor ** np.arange(49.0), rtol=1e-6)
    assert record.metrics.verdict == verdict


def test_slow_sampling_is_warned_of():
    stiff = {"kind": "joint-pid", "proportional": {"O": 5000.0}}
    record = solve_scene(wheel(loop(controller=[stiff]))).outcomes["loop"].details
    assert any("sampling at 100 Hz is slow" in line for line in record.warnings)
    assert not solve_scene(wheel(loop(controller=[PID]))).outcomes["loop"].details.warnings


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"delay": 0.6}, "expected a delay shorter than the run"),
        ({"sensor": [{"point": "w.rimm"}]}, 'found "w.rimm".*did you mean'),
        ({"sensor": [{"pzt": "w"}]}, "expected a layout of patches"),
        ({"sensor": [{"joint": "O", "measure": "acceleration"}]}, "measure"),
        ({"controller": [{"kind": "joint-pid", "proportional": {"B": 1.0}}]}, 'found "B"'),
        ({"controller": [{"kind": "python", "python": "nowhere.py:f"}]}, "expected an existing file"),
        ({"apply": "joints"}, 'expected the key "apply" only in kind = "forward", found kind = "closed-loop"'),
        ({"controller": [{"kind": "lqr", "time": 7.0}]}, "controller no. 1: time: expected at most .* ends, found 7.0"),
        ({"disturbance": [{"joint": "O", "moment": "1"}]}, "disturbances at points"),
    ],
)
def test_bad_keys_are_refused(keys, expected):
    with pytest.raises(InputError, match=expected):
        prepare_scene(wheel(loop(**keys)))


def test_keys_of_other_kinds_are_named_one_by_one():
    """Not those that an actuation would bring along; of a list with a wrong entry nothing else."""
    keys = {"actuation": "inverse", "times": [-1.0], "sample_time": 1.0}
    with pytest.raises(InputError) as caught:
        prepare_scene(wheel({"name": "c", "kind": "linear", "about": "inverse", **keys}))
    lines = [line.partition('analysis "c": ')[2] for line in str(caught.value).splitlines()]
    assert lines == [
        "times[0]: expected a number of at least 0, found -1.0",
        'expected the key "actuation" only in kind = "forward" or "closed-loop", found kind = "linear"',
        'expected the key "sample_time" only in kind = "closed-loop", found kind = "linear"',
    ]


PATCHES = {
    "body": "link", "count": 10, "length": 0.05, "width": 0.025, "thickness": 0.75e-3, "modulus": 63e9,
    "d31": 110e-12, "structural": False,
}  # fmt: skip


def held_link(link, *analyses, **keys):
    """A cantilever whose root a rotor holds like a wall, sagging; its tip is hit for 2 ms."""
    inverse = {"name": "inverse", "kind": "fcid", "shape": "static", "end": keys.pop("end", 0.4), "output_step": 5e-4}
    hit = [{"point": "link.tip", "y": "where(t < 0.002, 20*sin(pi*t/0.002), 0)"}]
    joint = {"name": "O", "type": "revolute", "between": ["ground", "link.root"], "rotor_inertia": 1e4}
    return make_scene(
        name="held", gravity=[0.0, -9.81], body=[{"name": "link", "link": link}], joint=[joint],
        trajectory=[{"name": "stand", "joint": "O", "value": "0"}], pzt=[PATCHES | keys.pop("pzt", {})],
        analysis=[inverse, *(analysis | {"disturbance": hit, "tolerance": 1e-6} for analysis in analyses)], **keys,
    )  # fmt: skip


def decay(solution, name):
    """Damping ratio and amplitude of the lowest mode after the hit, from the envelope of its vibration."""
    outcome, node = solution.outcomes[name], node_of(solution.analyses[name].run, "link")
    p = outcome.q[:, node.p_q.start] - solution.outcomes["inverse"].q[:, node.p_q.start]
    omega = np.sqrt(node.body.stiffness[0])
    envelope = np.hypot(p, outcome.v[:, node.p_v.start] / omega)
    ring = (outcome.time > 0.01) & (envelope > 0.02 * envelope.max())
    return -np.polyfit(outcome.time[ring], np.log(envelope[ring]), 1)[0] / omega


@pytest.mark.parametrize("sensor", [pytest.param("ideal", marks=pytest.mark.nightly), "pzt"])
def test_patches_add_the_damping_that_is_asked_for(sensor):
    control = {"kind": "modal-velocity", "bodies": ["link"], "modes": 1, "damping_ratio": 0.05, "sensor": sensor}
    loops = loop(sample_time=1e-4, controller=[control]), loop("free", sample_time=1e-4)
    scene = held_link(paper_link(count=3), *loops, end=0.2)
    solution = solve_scene(scene)
    assert abs(decay(solution, "free")) < 1e-4
    assert decay(solution, "loop") == pytest.approx(0.05, rel=0.05)


@pytest.mark.parametrize(
    ("space", "inverse"),
    [("planar", {"kind": "pcid"}), ("planar", {"kind": "fcid", "shape": "zero"}),
     ("spatial", {"kind": "fcid", "shape": "static"})],
)  # fmt: skip
def test_a_beam_that_is_welded_needs_no_trajectory(space, inverse):
    """Its tip is hit, and patches damp it as is asked for: nothing moves but the link."""
    control = {"kind": "modal-velocity", "bodies": ["link"], "modes": 1, "damping_ratio": 0.05, "sensor": "ideal"}
    hit = [{"point": "link.tip", "y": "where(t < 0.002, 20*sin(pi*t/0.002), 0)"}]
    solution = solve_scene(make_scene(
        name="welded", space=space, gravity=[0.0, 0.0] if space == "planar" else [0.0, 0.0, 0.0],
        body=[{"name": "link", "link": paper_link(count=3)}], pzt=[PATCHES],
        joint=[{"name": "O", "type": "weld", "between": ["ground", "link.root"]}],
        analysis=[{"name": "inverse", "end": 0.15, "output_step": 5e-4} | inverse,
                  loop(sample_time=1e-4, controller=[control], disturbance=hit)],
    ))  # fmt: skip
    assert decay(solution, "loop") == pytest.approx(0.05, rel=0.05)


def test_all_integrators_go_from_sample_to_sample_alike():
    """Loads jump at every sample: methods that look back must not look across."""
    control = {"kind": "modal-velocity", "bodies": ["link"], "damping_ratio": 0.05, "sensor": "ideal"}
    names = ["dop853", "dopri5", "radau", "generalized-alpha"]
    loops = [loop(name, integrator=name, sample_time=2e-3, controller=[control]) for name in names]
    solution = solve_scene(held_link(paper_link(count=3), *loops, end=0.04))
    first = solution.outcomes["dop853"].q
    sag = solution.outcomes["inverse"].q
    for name in names[1:]:
        assert solution.outcomes[name].status == "completed"
        assert np.abs(solution.outcomes[name].q - first).max() < 1e-3 * np.abs(first - sag).max(), name


def test_lqr_names_the_modes_out_of_reach():
    """A second wheel that hangs on its own, without motor and sensor: it swings with √(m g d/(I + m d²))."""
    pendulum = {"mass": 1.0, "inertia": 0.3, "center": [0.1, 0.0], "points": {"root": [0.0, 0.0], "tip": [0.2, 0.0]}}
    scene = wheel(
        loop(controller=[{"kind": "lqr", "moment": 1.0}], disturbance=blow()),
        bodies=[{"name": "p", "rigid": pendulum}], gravity=[0.0, -9.81], initial={"angles": {"p": -np.pi / 2}},
        joints=[{"name": "P", "type": "revolute", "between": ["ground", "p.root"], "motor": False,
                 "viscous_friction": 0.1}],
    )  # fmt: skip
    frequency = np.sqrt(9.81 * 0.1 / 0.31) / (2 * np.pi)
    lines = solve_scene(scene).outcomes["loop"].details.warnings
    for word in ("uncontrollable", "unobservable"):
        assert any(word in line and f"({frequency:.4g} Hz)" in line for line in lines), lines
    assert any("no sensor reads joint/P" in line for line in lines), lines


@pytest.mark.parametrize(("sensor", "unread"), [("pzt", ["LQR: no sensor reads modal/link/2"]), ("ideal", [])])
def test_lqr_names_what_no_sensor_reads(sensor, unread):
    """One patch tells one mode of two."""
    control = {"kind": "lqr", "modes": 2, "sensor": sensor}
    patch = {"count": 1, "allocation": "least-squares"}
    scene = held_link(paper_link(count=3), loop(sample_time=1e-3, controller=[control]), end=5e-3, pzt=patch)
    lines = solve_scene(scene).outcomes["loop"].details.warnings
    assert [line.partition(",")[0] for line in lines if "no sensor reads" in line] == unread


def test_a_patch_reads_the_charge_of_its_bending():
    """A force at the tip of a cantilever turns its sections by F (L x − x²/2)/(E I)."""
    solution = prepare_scene(held_link(paper_link(), loop()))
    of_link, link = solution.patches["link"], solution.bodies["link"].carrying
    EI = 2.068427e11 * 0.025 * 0.015**3 / 12
    p = link.modal_transform @ (link.points["tip"].translation[1] / link.stiffness)
    edges = of_link.arrays["link"].edges
    turn = np.diff(edges - edges**2 / 2, axis=1)[:, 0] / EI
    capacitance = 1e-7
    expected = 63e9 * 110e-12 * 0.025 * (0.75e-3 + 0.015) / 2 * turn / capacitance
    volts = volts_on_file(of_link, "link", capacitance)["link"] @ p  # of ten modes: patches at the ends miss the others
    np.testing.assert_allclose(volts, expected, atol=2e-2 * expected.max())


GIVES = {"gear_ratio": 50.0, "rotor_inertia": 1e-4, "stiffness": 2e3, "damping": 1.0}
ON_MOTORS = {"kind": "joint-pid", "side": "motor", "proportional": {"O": 200.0}, "derivative": {"O": 10.0}}


def test_gears_that_give_are_wound_at_the_start():
    """Rods that stand still under gravity: the feed-forward holds them, and no controller has anything to do."""
    still = {"O": {"joint": "O", "value": "0.4"}, "A": {"joint": "A", "value": "-1.1"}}
    scene = two_rods(
        loop(controller=[ON_MOTORS]), loop("from_scene", controller=[ON_MOTORS], start="scene"),
        first=GIVES, second=GIVES, paths=still,
    )  # fmt: skip
    solution = solve_scene(scene)
    for name in ("loop", "from_scene"):
        record = solution.outcomes[name].details
        assert record.tip_error.max() < 1e-9
        assert np.abs(record.readings - record.reference).max() < 1e-9
        assert "motor/O" in record.outputs


def test_a_motor_behind_a_spring_is_its_two_masses():
    """P on the motor of a free wheel: γ of a step in the reference rate against the two masses, sampled finely."""
    I_m, k, c, P, D, T_fine = 1e-4 * 50.0**2, 2e3, 1.0, 200.0, 10.0, 1e-4
    scene = wheel(
        loop(controller=[ON_MOTORS], sample_time=T_fine, disturbance=blow(), feed_forward="none"), joint=GIVES
    )
    solution = solve_scene(scene)
    outcome, (angle, _) = solution.outcomes["loop"], joint_motion(solution.analyses["loop"].run, "O")
    # x = (θ_m, γ, rates); the blow is a moment of 5 N times 0.3 m on the wheel for 0.1 s, which turns by little
    M, K = np.diag([I_m, INERTIA]), np.array([[k + P, -k], [-k, k]])
    damping = np.array([[c + D, -c], [-c, c]])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, damping)]])
    b = np.array([0.0, 0.0, 0.0, 5.0 * 0.3 / INERTIA])
    settled = np.linalg.solve(A, b)
    t = outcome.time
    x = np.array([expm(A * min(s, 0.1)) @ settled - settled for s in t])
    x = np.array([expm(A * max(s - 0.1, 0.0)) @ row for s, row in zip(t, x, strict=True)])
    assert np.abs(angle[:, 0] - x[:, 1]).max() < 5e-3 * np.abs(x[:, 1]).max()


@pytest.mark.parametrize(
    "keys", [{"controller": [ON_MOTORS]}, {"sensor": [{"motor": "O"}]}, {"sensor": [{"motor": "P"}]}]
)
def test_motors_are_read_behind_gears_that_give_alone(keys):
    with pytest.raises(InputError, match="expected a joint with stiffness"):
        wheel(loop(**keys))
