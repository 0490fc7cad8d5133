"""`ffrobot sensitivity`: closed forms, differences by hand, peaks with kinks, failed designs, mistakes."""

from copy import deepcopy

import numpy as np
import pytest
from small_robots import ARM, SWING, TUBE, rows

import ffrobot
from ffrobot.batch.batch import Batch, Processes
from ffrobot.design.designs import Designs, Runs, changes_for
from ffrobot.design.evaluations import Differentiation, Evaluations
from ffrobot.design.responses import read_problem
from ffrobot.design.variables import read_space
from ffrobot.sweep.files import set_key, value_of

PLANE = SWING | {
    "joint": [SWING["joint"][0] | {"gear_ratio": 40.0, "rotor_inertia": 2e-5, "viscous_friction": 0.2}],
    "analysis": [{"name": "inverse", "kind": "pcid", "end": 0.2, "output_step": 0.005}],
}
STILL = {"analysis": [{"name": "still", "kind": "static"}]}
STEP = 2e-4  # s, of outputs that responses are read from, however far apart those of the scene are
SPACE_LINK = TUBE | {"modes": {"count": 4, "family": ["in-plane-bending", "out-of-plane-bending"]}}
SPACE = SWING | {
    "space": "spatial",
    "gravity": [0.0, 0.0, -9.81],
    "body": [{"name": "arm", "link": SPACE_LINK}],
    "joint": [SWING["joint"][0] | {"axis": [0.3, 0.8, 0.5]}],
    "payload": [SWING["payload"][0] | {"center": [0.02, 0.0, 0.01], "inertia": [1e-3, 2e-3, 2e-3]}],
    "analysis": PLANE["analysis"],
}


def place(key):
    """Of a key of the scene or of the link in it."""
    first, *inner = key.split(".")
    return ("body", inner[0], "link", *inner[1:]) if first == "links" else (first, *inner)


def changed(scene, key, value):
    new = deepcopy(scene)
    set_key(new, place(key), value)
    return new


def value_at(scene, key):
    return value_of(scene, place(key))


def by_hand(scene, key):
    """The derivatives of `GOALS` by four runs in memory, of order h⁴, of the tightest tolerance."""
    theta = value_at(scene, key)
    h = 5e-4 * theta  # the second mode passes through 40 periods, whose number goes by 1/length²
    f = {}
    for n in (-2, -1, 1, 2):
        new = changed(scene, key, theta + n * h)
        new["analysis"][0] |= {"tolerance": 1e-10, "output_step": STEP}
        with ffrobot.solve(ffrobot.make_scene(**new)) as results:
            f[n] = np.array([quantity(results) for quantity in GOALS.values()])
    return (8 * (f[1] - f[-1]) - (f[2] - f[-2])) / (12 * h)


def rms(results):
    return np.sqrt(np.trapz(results["inverse/joints/shoulder/moment"] ** 2, dx=STEP) / 0.2)  # noqa: NPY201


def deflection(results):
    return np.linalg.norm(results["inverse/points/arm.tip/deflection"][500])


def energy(results):
    power = results["inverse/joints/shoulder/moment"] * results["inverse/joints/shoulder/rate"]
    return np.sum(0.5 * (power[1:] + power[:-1])) * STEP


GOALS = {
    "rms joints.shoulder.moment": rms,
    "at 0.1 points.arm.tip.deflection": deflection,
    "energy joints.shoulder": energy,
}


PLANE_KEYS = (
    "payload.0.mass", "gravity.1", "joint.shoulder.gear_ratio", "joint.shoulder.viscous_friction",
    "links.arm.geometry.length", "links.arm.material.density",
)  # fmt: skip
SPACE_KEYS = (
    "payload.0.center.0", "joint.shoulder.axis.2", "links.arm.geometry.section.inner",
    "links.arm.material.youngs_modulus", "links.arm.damping.ratio",
)  # fmt: skip


@pytest.mark.parametrize(
    ("scene", "keys"),
    [
        pytest.param(PLANE, PLANE_KEYS, id="plane", marks=pytest.mark.nightly),
        pytest.param(SPACE, SPACE_KEYS, id="space", marks=pytest.mark.nightly),
        pytest.param(SPACE, SPACE_KEYS[1:3], id="space, axis and tube"),
    ],
)
def test_against_differences_by_hand(write, scene, keys):
    """Eleven kinds of key: 1e-6 of a percent per percent, as errors are of the response where it hardly depends on it.

    The estimate of the error is no less than the error, up to that of the differences by hand.
    """
    found = ffrobot.sensitivity(write(scene), list(GOALS), keys, processes=2)
    for k, key in enumerate(keys):
        for g, expected in enumerate(by_hand(scene, key)):
            scale = found.value[g] / value_at(scene, key)
            assert abs(found.derivative[g, k] - expected) <= 1e-6 * max(abs(expected), abs(scale)), (key, g)
            assert abs(found.derivative[g, k] - expected) <= found.error[g, k] + 1e-7 * abs(scale), (key, g)
    assert {entry.method for row in found.entries for entry in row} == {"repeated steps"}
    assert found.failures == ()
    assert found.runs == 1 + 3 * len(keys)


@pytest.mark.parametrize("step", [0.25, 0.05, 0.01])
def test_the_derivative_of_a_peak_is_that_of_its_top(write, step):
    """τ = (I + m c²) θ̈ + m g c cos θ along a quintic: at its top, which no output hits, ∂τ/∂m = c² θ̈ + g c cos θ."""
    inertia, c, m = 0.05, 0.3, 2.0  # of ARM
    scene = ARM | {
        "payload": [],
        "trajectory": [{"name": "swing", "joint": "shoulder", "value": "1.3*(10*t**3 - 15*t**4 + 6*t**5)"}],
        "analysis": [{"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": step}],
    }
    t = np.linspace(0.0, 1.0, 2_000_001)
    theta, theta_ddot = 1.3 * (10 * t**3 - 15 * t**4 + 6 * t**5), 1.3 * (60 * t - 180 * t**2 + 120 * t**3)
    tau = (inertia + m * c**2) * theta_ddot + m * 9.81 * c * np.cos(theta)
    top = tau.argmax()
    found = ffrobot.sensitivity(write(scene), ["peak joints.shoulder.moment"], ["body.arm.rigid.mass"])
    assert found.value[0] == pytest.approx(tau[top], rel=1e-9)
    expected = c**2 * theta_ddot[top] + 9.81 * c * np.cos(theta[top])
    assert abs(found.derivative[0, 0] - expected) < min(1e-6 * expected, 2.0 * found.error[0, 0])


def test_moment_of_a_rigid_arm(write):
    """M = 2 (J + m c² + m_p a²) + (m c + m_p a) g cos t²: largest at the start, where its angle is 0."""
    keys = ["payload.0.mass", "body.arm.rigid.center.0", "body.arm.rigid.inertia"]
    found = ffrobot.sensitivity(write(ARM), ["peak joints.shoulder.moment", "mass"], keys)
    expected = [2 * 0.36 + 0.6 * 9.81, 2 * 2.0 * 2 * 0.3 + 2.0 * 9.81, 2.0]
    rounding = 1e-10 * found.value[0] / np.array([0.5, 0.3, 0.05])  # of differences with a key 1e-5 of it larger
    assert np.all(np.abs(found.derivative[0] - expected) < rounding)
    np.testing.assert_array_equal(found.derivative[1], 0.0)
    assert next(iter(found.readings.values())).time == 0.0
    assert found.value[0] == pytest.approx(2 * (0.05 + 0.18 + 0.18) + (0.6 + 0.3) * 9.81, rel=1e-9)
    assert found.value[1] == pytest.approx(2.0)


def test_a_kink_is_told(write):
    """Peaks of ± J A at opposite times are equal without gravity, and either is overtaken as gravity sets in."""
    scene = ARM | {
        "gravity": [0.0, 0.0],
        "trajectory": [{"name": "swing", "joint": "shoulder", "value": "-0.01*sin(4*pi*t)"}],
    }
    found = ffrobot.sensitivity(write(scene), ["peak joints.shoulder.moment"], ["gravity.1"])
    (entry,) = found.entries[0]
    assert any("a kink: with gravity.1 = " in note for note in entry.notes)
    time = next(iter(found.readings.values())).time
    J = 0.05 + 2.0 * 0.09 + 0.5 * 0.36
    assert found.value[0] == pytest.approx(0.01 * 16 * np.pi**2 * J * abs(np.sin(4 * np.pi * time)), rel=1e-9)
    sign = np.sign(np.sin(4 * np.pi * time))
    arm = (2.0 * 0.3 + 0.5 * 0.6) * np.cos(0.01 * np.sin(4 * np.pi * time))
    assert entry.derivative == pytest.approx(-sign * arm, rel=1e-9)
    assert "a kink" in str(found)


def test_a_design_that_fails_is_kept_and_told(write, tmp_path):
    """Friction of nothing has no smaller one: wrong input on that side, a derivative by the other."""
    scene = deepcopy(ARM)
    scene["joint"][0] |= {"viscous_friction": 0.0}
    folder = tmp_path / "designs"
    of, to = ["at 0.25 joints.shoulder.moment"], ["joint.shoulder.viscous_friction"]
    found = ffrobot.sensitivity(write(scene), of, to, folder)
    (entry,) = found.entries[0]
    assert entry.method == "one-sided"
    assert entry.derivative == pytest.approx(0.5, rel=1e-9)  # the rate, 2 t
    assert len(found.failures) == 1
    assert "expected a number of at least 0, found -1e-05" in found.failures[0]
    assert any("viscous_friction = -" in note for note in entry.notes)
    assert sorted(row["status"] for row in rows(folder / "table.csv")) == ["completed"] * 3 + ["wrong input"]
    done = {path: path.stat().st_mtime_ns for path in folder.glob("runs/*/row.json")}
    again = ffrobot.sensitivity(write(scene), of, to, folder)  # nothing is run again
    assert {path: path.stat().st_mtime_ns for path in folder.glob("runs/*/row.json")} == done
    assert again.derivative == found.derivative


def test_command(ffrobot, write):
    """The table on the screen, the file with all numbers, the picture; another key later runs only what is new."""
    scene = write(ARM)
    arguments = ("sensitivity", scene, "--of", "peak joints.shoulder.moment")
    done = ffrobot.ok(*arguments, "--to", "payload.0.mass", "-j", 2)
    assert "payload.0.mass" in done.stdout
    assert "4 runs" in done.stdout
    folder = scene.with_suffix(".sensitivity")
    (row,) = rows(folder / "sensitivity.csv")
    assert float(row["derivative"]) == pytest.approx(2 * 0.36 + 0.6 * 9.81, rel=1e-9)
    assert float(row["percent_per_percent"]) == pytest.approx(0.5 * float(row["derivative"]) / float(row["value"]))
    assert (folder / "tornado_peak_joints_shoulder_moment.png").exists()
    runs = set(folder.glob("runs/*"))
    assert ffrobot(*arguments, "--to", "payload.0.mass,gravity.1").returncode == 0
    assert len(set(folder.glob("runs/*")) - runs) == 3


@pytest.mark.parametrize(
    ("of", "message"),
    [
        ("peak joints.sholder.moment", 'did you mean "joints.shoulder.moment"?'),
        ("rms joints.shoulder.reaction[2]", "expected a column below 2"),
        ("at 0.7 joints.shoulder.moment", "expected a time from 0 to 0.5 s, found 0.7"),
        ("rms constraint_violation", 'expected one column, such as "constraint_violation[0]", found 3'),
        ("frequency 1 arm", "expected a body with a link (none)"),
        ("mass leg", 'expected a body ("arm"), found "leg"'),
    ],
)
def test_responses_that_are_none_are_told_by_the_first_run(write, tmp_path, of, message):
    with pytest.raises(ffrobot.InputError) as told:
        ffrobot.sensitivity(write(ARM), [of], ["payload.0.mass"], tmp_path / "designs")
    assert message in str(told.value)


def test_a_count_has_no_derivative(write):
    with pytest.raises(ffrobot.InputError, match="expected keys that may be a little larger or smaller") as told:
        ffrobot.sensitivity(write(PLANE | STILL), ["frequency 1 arm"], ["links.arm.mesh.elements"])
    assert "expected a whole number" in str(told.value)


@pytest.mark.parametrize("kind", ["pcid", "fcid"])
def test_means_that_outputs_miss_have_their_closed_forms(write, kind):
    """A load of 8 N m for 3 ms on a joint that turns at 0.1 rad/s, which outputs miss or end with."""
    load = [{"joint": "shoulder", "moment": "where(t < 2.0011, 0, where(t < 2.0041, 8, 0))"}]
    keys = {"gravity": [0.0, 0.0], "load": load, "trajectory": [{"name": "s", "joint": "shoulder", "value": "0.1*t"}]}
    shape = {"shape": "zero"} if kind == "fcid" else {}
    for end in (4.0, 4.0041):
        of = {"name": "inverse", "kind": kind, "end": end, "output_step": end / 10} | shape
        expected = {
            "energy joints.shoulder": -8.0 * 0.1 * 3e-3,
            "integral joints.shoulder.moment": -8.0 * 3e-3,
            "mean joints.shoulder.moment": -8.0 * 3e-3 / end,
            "rms joints.shoulder.power": 0.8 * np.sqrt(3e-3 / end),
        }
        found = ffrobot.sensitivity(write(ARM | keys | {"analysis": [of]}), of=list(expected), to=["payload.0.mass"])
        assert found.value == pytest.approx(list(expected.values()), rel=1e-5)
        assert sum("between them, which counts" in line for line in found.remarks()) == len(expected)


def test_gradients_of_a_search_take_one_run_for_each_number(write, tmp_path):
    """Steps of 6e-6 of a number: truncation is 1e-5 of the derivative or so, and the estimate says so."""
    keys = ["links.arm.geometry.section.outer", "payload.0.mass"]
    goals = ["rms joints.shoulder.moment", "rms points.arm.tip.deflection"]
    path, problem = write(SWING), read_problem(goals[0], None, [f"{goals[1]} <= 1"])
    space = read_space(path, [f"{keys[0]}=0.018:0.03", f"{keys[1]}=0.1:1:log"])
    fixed = changes_for(path, problem.responses, 1e-7, keep_steps=True)
    designs = Designs(Runs(path, tmp_path / "runs", Batch(lambda: Processes(2))), space.keys, space.own, fixed)
    evaluations = Evaluations(designs, space, problem)
    (first,) = evaluations.at([space.start_place])
    found = Differentiation(evaluations, 1e-7)
    slopes = found.slopes(first)
    assert designs.count == 1 + 2 + 1
    by_keys = [variable.slope(u) for variable, u in zip(space.variables, first.place, strict=True)]
    expected = ffrobot.sensitivity(path, goals, keys, processes=2).derivative * by_keys
    difference, scale = np.abs(slopes.gradient - expected), np.abs(expected)
    assert np.all(difference <= 1e-4 * scale)
    assert np.all(difference <= slopes.error + 1e-6 * scale)
    assert np.all(slopes.error <= 1e-3 * scale)
    assert found.slopes(first).gradient == pytest.approx(slopes.gradient, rel=0, abs=0)
    assert designs.count == 4
