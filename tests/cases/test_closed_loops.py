"""Closed loops of robots in 3D: those of planar robots put there, work, linear models, bad input."""

import numpy as np
import pytest
import scenes_in_3d
from checkpoints import CASES
from scenes_in_3d import CRANK
from scipy.linalg import expm

import ffrobot
from ffrobot.common.errors import InputError

CLOSE = 1e-6  # of the peak of each quantity
BLOW = [{"point": "link2.tip", "y": "where(t < 0.02, 0, where(t < 0.03, 30*sin(pi*(t - 0.02)/0.01), 0))"}]
PD = {"kind": "joint-pid", "proportional": {"O": 500.0, "A": 100.0}, "derivative": {"O": 40.0, "A": 8.0}}
ENCODERS = [{"joint": "O", "resolution": 9.587e-5}, {"joint": "A", "resolution": 9.587e-5}]
STRAINS = [{"pzt": "link1", "resolution": 0.005, "noise": 0.005}, {"pzt": "link2", "noise": 0.005}]
SPLIT = {"name": "split", "kind": "fcid", "shape": "static", "end": 0.1, "output_step": 0.001, "tolerance": 1e-9}
INVERSE = {"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.001, "tolerance": 1e-9}
TIP = [{"point": "link2.tip", "measure": measure} for measure in ("value", "rate", "acceleration")]


def loop(name, *controllers, actuation="split", **keys):
    return {
        "name": name, "kind": "closed-loop", "actuation": actuation, "sample_time": 0.001, "delay": 0.0005,
        "tolerance": 1e-9, "disturbance": BLOW, "controller": list(controllers),
    } | keys  # fmt: skip


def both(folder, analyses, **keys):
    """Results of the case in the plane and of the same robot in 3D."""
    planar = scenes_in_3d.read(CASES / "two_link_closed_loop" / "scene.toml") | keys
    planar["analysis"] = analyses
    spatial = scenes_in_3d.in_3d(planar) | {"pzt": planar["pzt"], "analysis": analyses}
    spatial["initial"] = {"joints": {"O": 0.0, "A": np.pi / 3}}
    return [
        ffrobot.solve(scenes_in_3d.write(tables, folder / f"{name}.toml"))
        for name, tables in (("planar", planar), ("spatial", spatial))
    ]


def same_loops(planar, spatial, name):
    """Readings, references and commands of all samples, what the motors did, and what is made of it in numbers."""
    about, there = (results.attributes(f"{name}/control") for results in (planar, spatial))
    assert list(about["inputs"]) == list(there["inputs"])
    columns = [list(there["outputs"]).index(output) for output in about["outputs"]]
    modal = [output.startswith("modal/") for output in about["outputs"]]
    assert len(about["outputs"]) == len(set(columns))
    for dataset, chosen in (("commands", slice(None)), ("wanted", slice(None)), ("readings", columns)):
        expected, found = planar[f"{name}/control/{dataset}"], spatial[f"{name}/control/{dataset}"][:, chosen]
        if dataset == "readings":  # modes may have the other sign
            expected, found = (np.where(modal, np.abs(values), values) for values in (expected, found))
        peaks = np.abs(expected).max(axis=0)
        assert (np.abs(found - expected).max(axis=0) <= CLOSE * peaks).all(), (
            dataset,
            np.abs(found - expected) / peaks,
        )
    for joint in ("O", "A"):
        for dataset in ("coordinate", "rate", "moment"):
            expected, found = (results[f"{name}/joints/{joint}/{dataset}"] for results in (planar, spatial))
            np.testing.assert_allclose(found, expected, atol=CLOSE * np.abs(expected).max())
    expected, found = (results[f"{name}/tip_error"] for results in (planar, spatial))
    np.testing.assert_allclose(found, expected, atol=CLOSE * np.abs(expected).max())
    for key in ("verdict", "advice"):
        assert np.all(about[key] == there[key])
    assert planar.verdict[name].margins == spatial.verdict[name].margins


def test_motors_and_patches_of_two_links(tmp_path):
    damper = {"kind": "modal-velocity", "bodies": ["link1", "link2"], "modes": 2, "damping_ratio": 0.05}
    patches = {"kind": "lqr", "inputs": "patches", "modes": 4, "deflection": 1e-4, "voltage": 200.0}
    together = {"kind": "lqr", "modes": 4, "rate": 0.1, "deflection": 2e-4, "moment": 3.0, "voltage": 500.0}
    analyses = [
        SPLIT, INVERSE,
        loop("pd", PD, sensor=[*ENCODERS, *TIP], start="scene"),
        loop("full", actuation="inverse", feed_forward="joints+pzt", unlimited=True),
        loop("limited", actuation="inverse", feed_forward="joints+pzt", delay=0.0),
        loop("ideal", PD, {**damper, "sensor": "ideal"}),
        loop("damper", PD, damper, sensor=STRAINS),
        loop("patches", PD, patches, sensor=[*ENCODERS, *STRAINS]),
        loop("lqr", together, delay=0.0025, sensor=STRAINS),
        loop("torque", {"kind": "computed-torque", "bandwidth": 20.0}),
    ]  # fmt: skip
    planar, spatial = both(tmp_path, analyses)
    with planar, spatial:
        assert planar.verdict["pd"].margins
        assert np.abs(planar["limited/control/commands"]).max() == 200.0
        for analysis in analyses[2:]:
            same_loops(planar, spatial, analysis["name"])


def test_motors_on_frames(tmp_path):
    """Links bend in the plane of the joints alone: rotors and sensors are between frames, too."""
    keys = {"motors": "frame", "pzt": []}
    held = loop("held", PD, actuation="inverse", sample_time=0.002, sensor=[{"joint": "O"}, {"joint": "A"}])
    planar, spatial = both(tmp_path, [INVERSE, held], **keys)
    with planar, spatial:
        same_loops(planar, spatial, "held")


def test_gears_that_give(tmp_path):
    """The gear on the ground alone: what the rotor of another does to its link is left out in 2D (docs/theory.md)."""
    geared = {"gear_ratio": 60.0, "rotor_inertia": 2e-4}
    compliant = geared | {"stiffness": 3e3, "damping": 2.0}
    rods = scenes_in_3d.read(CASES / "two_link_closed_loop" / "scene.toml")
    points = {"root": [0.0, 0.0], "tip": [1.0, 0.0]}
    for k, body in enumerate(rods["body"]):
        del body["link"]
        body["rigid"] = {"mass": 2.0 - k, "inertia": 0.15, "center": [0.5, 0.0], "points": points}
    joints = [joint | own for joint, own in zip(rods["joint"], (compliant, geared), strict=True)]
    hip, knee = (
        {"kind": "joint-pid", "proportional": {joint: p}, "derivative": {joint: d}}
        for joint, p, d in (("O", 300.0, 40.0), ("A", 100.0, 10.0))
    )
    analyses = [
        INVERSE,
        loop("motors", {**hip, "side": "motor"}, knee, actuation="inverse"),
        loop("joints", hip, knee, actuation="inverse", start="scene"),
    ]
    planar, spatial = both(tmp_path, analyses, body=rods["body"], joint=joints, pzt=[])
    with planar, spatial:
        assert spatial.attributes("motors/control")["outputs"][0] == "motor/O"
        for name in ("motors", "joints"):
            for dataset in ("control/commands", "control/readings", "joints/O/motor_angle", "tip_error"):
                expected, found = (results[f"{name}/{dataset}"] for results in (planar, spatial))
                np.testing.assert_allclose(found, expected, atol=CLOSE * np.abs(expected).max())


def test_a_crank_that_drives_a_slider(tmp_path):
    """A loop that a joint closes: its rows hold under the controller."""
    tables = scenes_in_3d.read(CASES / "slider_crank" / "scene.toml")
    crank = tables["joint"][0]["name"]
    pd = {"kind": "joint-pid", "proportional": {crank: 20.0}, "derivative": {crank: 0.5}}
    inverse = INVERSE | {"end": 0.05}
    keys = {"actuation": "inverse", "disturbance": [], "delay": 0.0002, "feed_forward": "none"}
    tables |= {"analysis": [inverse, loop("pd", pd, **keys)]}
    tables.pop("pzt", None)
    tables["joint"][0] |= {"motor": True, "gear_ratio": 20.0, "rotor_inertia": 1e-5}
    spatial = scenes_in_3d.in_3d(tables) | {"analysis": tables["analysis"], "initial": {"joints": CRANK}}
    with solve(tables, tmp_path, "planar") as planar, solve(spatial, tmp_path, "spatial") as found:
        for dataset in ("control/commands", "control/readings", "tip_error", f"joints/{crank}/moment"):
            expected = planar[f"pd/{dataset}"]
            np.testing.assert_allclose(found[f"pd/{dataset}"], expected, atol=CLOSE * np.abs(expected).max())
        assert found["pd/constraint_violation"].max() < 1e-9
        assert planar.verdict["pd"].margins == found.verdict["pd"].margins


HOLD = {"name": "hold", "kind": "pcid", "end": 0.1, "output_step": 0.0005, "tolerance": 1e-10}
GAINS = {"waist": 300.0, "shoulder": 300.0, "elbow": 80.0}
RATES = {"waist": 12.0, "shoulder": 12.0, "elbow": 3.0}
HOLDS = {"kind": "joint-pid", "proportional": GAINS, "derivative": RATES}


def arm(*analyses, still=False, rotors=True, **keys):
    """The case `arm_3r`, with rotors as motors have them; `still`: its tip stays where the line begins."""
    tables = scenes_in_3d.read(CASES / "arm_3r" / "scene.toml")
    for joint in tables["joint"] if rotors else ():
        joint |= {"gear_ratio": 80.0, "rotor_inertia": 3e-5}
    if still:
        tables["trajectory"][0] |= {"x": "0.95", "y": "0.15", "z": "0.55"}
    return tables | {"analysis": list(analyses)} | keys


def held(name, *controllers, **keys):
    return loop(name, *controllers, actuation="hold", disturbance=[], delay=0.0) | keys


def solve(tables, folder, name="scene"):
    return ffrobot.solve(scenes_in_3d.write(tables, folder / f"{name}.toml"))


PUSH = (1.0, -2.0, 1.5)  # N on the tip for each N of size


def push(size, begins=0.02):
    return [
        {"point": "fore.tip"}
        | {axis: f"{size * part}*where(t < {begins}, 0, 1)" for axis, part in zip("xyz", PUSH, strict=True)}
    ]


def predicted(model, times, begins):
    """(K, 3) m at samples: what a push of size 1 does to the tip by the linear model, under the PD controllers."""
    joints = [f"joint/{name}" for name in GAINS]
    axes = [f"fore.tip/{axis}" for axis in "xyz"]
    B = model.B[:, model.inputs([*joints, *(f"force/{axis}" for axis in axes)])]
    (n, inputs), f = B.shape, model.freedom
    step = expm(np.block([[model.A, B], [np.zeros((inputs, n + inputs))]]) * (times[1] - times[0]))
    C, tip = model.C[model.outputs(joints)], model.C[model.outputs([f"point/{axis}" for axis in axes])]
    P, D = np.diag([*GAINS.values()]), np.diag([*RATES.values()])
    feedback = -(P @ C + D @ np.hstack([np.zeros((3, f)), C[:, :f]]))
    x, found = np.zeros(n), np.zeros((len(times), 3))
    for k, t in enumerate(times):
        found[k] = tip @ x
        force = np.array(PUSH) * (t > begins - 1e-9)
        x = step[:n, :n] @ x + step[:n, n:] @ np.concatenate([feedback @ x, force])
    return found


def test_arm_at_rest_is_pushed_away_as_its_linear_model_says(tmp_path):
    """Of second order in the force is what the linear model leaves out."""
    linear = {"name": "linear", "kind": "linear", "about": "hold", "times": [0.0]}
    sizes = {"large": 0.4, "small": 0.1}
    loops = [held(name, HOLDS, disturbance=push(size)) for name, size in sizes.items()]
    sags = HOLD | {"kind": "fcid", "shape": "static"}  # at rest by its motors
    with solve(arm(sags, linear, held("quiet", HOLDS), *loops, still=True), tmp_path) as found:
        (model,) = found.linear("linear")
        rest, left = found["quiet/points/fore.tip/position"], []
        assert np.abs(rest - rest[0]).max() < 1e-8
        expected = predicted(model, found["quiet/time"][::2], 0.02)
        for name, size in sizes.items():
            moved = (found[f"{name}/points/fore.tip/position"] - rest)[::2]
            left.append(np.abs(moved - size * expected).max() / np.abs(size * expected).max())
        assert left[0] < 0.05
        assert left[1] == pytest.approx(left[0] / 4, rel=0.2)


def test_arm_keeps_to_its_line(tmp_path):
    """Moments of the sagging arm are fed forward. While it moves a push displaces the tip as a model frozen there says:
    for 30 ms, in which the joints turn by 0.1 rad.
    """
    line = {"name": "hold", "kind": "fcid", "shape": "static", "end": 0.3, "output_step": 0.001, "tolerance": 1e-8}
    linear = {"name": "linear", "kind": "linear", "about": "hold", "times": [0.25]}
    keys = {"tolerance": 1e-8, "end": 0.28}
    loops = [held("follows", HOLDS, **keys), held("pushed", HOLDS, disturbance=push(0.5, 0.25), **keys)]
    with solve(arm(line, linear, *loops), tmp_path) as found:
        path, moved = (found[f"{name}/points/fore.tip/position"] for name in ("follows", "pushed"))
        assert np.linalg.norm(path[-1] - path[0]) > 0.3
        assert found["follows/tip_error"].max() < 2e-4
        assert found.verdict["follows"].margins.startswith("margins (linear model): gains may grow")
        (model,) = found.linear("linear")
        after = found["pushed/time"] > 0.25 - 1e-9
        expected = 0.5 * predicted(model, found["pushed/time"][after], 0.25)
        off = np.abs((moved - path)[after] - expected)
        assert off.max() < 0.05 * np.abs(expected).max()


def test_work_of_motors_and_forces_is_what_energies_gain(tmp_path):
    """Of moments that are held, to the way of each sample; a constant force, to its way."""
    inverse = HOLD | {"end": 0.2, "output_step": 0.001}
    force = np.array([4.0, -3.0, 6.0])
    constant = [{"point": "fore.tip", **{axis: f"{part}" for axis, part in zip("xyz", force, strict=True)}}]
    wild = held("loop", HOLDS, sample_time=0.002, disturbance=constant, feed_forward="none", tolerance=1e-10)
    with solve(arm(inverse, wild), tmp_path) as found:
        commands = found["loop/control/commands"]
        ways = np.column_stack([found[f"loop/joints/{name}/coordinate"][::2] for name in GAINS])
        work = np.cumsum(np.sum(commands * np.diff(ways, axis=0), axis=1))
        tip = found["loop/points/fore.tip/position"][::2]
        work += (tip[1:] - tip[0]) @ force
        stored = sum(found[f"loop/energy/{kind}"] for kind in ("kinetic", "strain", "gravitational"))
        time, lost = found["loop/time"], found["loop/energy/dissipated_power"]
        lost = np.append(0.0, np.cumsum((lost[1:] + lost[:-1]) / 2 * np.diff(time)))
        gained = (stored + lost - stored[0])[2::2]
        assert np.abs(work).max() > 1.0
        np.testing.assert_allclose(gained, work, atol=2e-3 * lost[-1] + 1e-7 * np.abs(work).max())


def test_a_function_of_the_user_acts_like_the_same_controller_of_the_scene(tmp_path):
    (tmp_path / "mine.py").write_text(
        "import numpy as np\n\n"
        "GAINS = {'waist': (300.0, 12.0), 'shoulder': (300.0, 12.0), 'elbow': (80.0, 3.0)}\n\n"
        "def controller(setup):\n"
        "    where = [(*setup.places(f'joint/{n}'), *setup.columns(f'joint/{n}', f'joint/{n}/rate')) for n in GAINS]\n"
        "    def at_sample(k, y):\n"
        "        u, e = np.zeros(len(setup.inputs)), setup.reference[k] - y\n"
        "        for (place, value, rate), (P, D) in zip(where, GAINS.values()):\n"
        "            u[place] = P * e[value] + D * e[rate]\n"
        "        return u\n"
        "    return at_sample\n"
    )
    sensor = [{"joint": name, "measure": measure} for name in GAINS for measure in ("value", "rate")]
    mine = {"kind": "python", "python": "mine.py:controller"}
    loops = [
        held("theirs", HOLDS, sensor=sensor, disturbance=push(5.0)),
        held("mine", mine, sensor=sensor, disturbance=push(5.0)),
    ]
    with solve(arm(HOLD, *loops, still=True), tmp_path) as found:
        theirs, own = (found[f"{name}/control/commands"] for name in ("theirs", "mine"))
        np.testing.assert_allclose(own, theirs, atol=1e-9 * np.abs(theirs).max())
        assert np.abs(own - own[0]).max() > 0.1


def test_both_angles_of_a_universal_joint(tmp_path):
    """Named one after the other; gains are those of the joint, u = P e + D ė of each."""
    points = {"root": [0.0, 0.0, 0.0], "tip": [0.0, 0.0, 0.5]}
    body = {
        "name": "b",
        "rigid": {"mass": 1.0, "center": [0.0, 0.0, 0.2], "inertia": [0.02, 0.03, 0.01], "points": points},
    }
    joint = {
        "name": "U", "type": "universal", "between": ["ground", "b.root"], "axis": [1.0, 0.0, 0.0],
        "second_axis": [0.0, 1.0, 0.0], "motor": True,
    }  # fmt: skip
    path = {"name": "tip", "point": "b.tip", "x": "0.1*sin(3*t)", "y": "0.1*sin(2*t)"}
    pd = {"kind": "joint-pid", "proportional": {"U": 20.0}, "derivative": {"U": 1.0}}
    tables = {
        "name": "u", "space": "spatial", "gravity": [0.0, 0.0, -9.81], "body": [body], "joint": [joint],
        "trajectory": [path],
        "analysis": [HOLD, held("loop", pd, tip="b.tip", feed_forward="none"), held("fed", pd, tip="b.tip")],
    }  # fmt: skip
    with solve(tables, tmp_path) as found:
        about = found.attributes("loop/control")
        assert list(about["inputs"]) == ["joint/U 1", "joint/U 2"]
        outputs = list(about["outputs"])
        e = found["loop/control/reference"] - found["loop/control/readings"]
        at = {name: e[:, outputs.index(name)] for name in outputs}
        expected = np.column_stack([20.0 * at[f"joint/U {k}"] + at[f"joint/U {k}/rate"] for k in (1, 2)])
        np.testing.assert_allclose(found["loop/control/commands"], expected, atol=1e-12)
        np.testing.assert_allclose(found["loop/joints/U/moment"].shape, (len(found["loop/time"]), 2))
        assert found["fed/tip_error"].max() < 1e-6 < found["loop/tip_error"].max()
        assert found.attributes("fed/control")["gain_margin"] > 1


def test_a_loop_that_diverges_is_kept_and_advised(tmp_path):
    wild = {"kind": "joint-pid", "proportional": GAINS, "derivative": {name: 3000.0 for name in RATES}}
    loops = [held("wild", wild, disturbance=push(5.0)), held("calm", HOLDS)]
    with solve(arm(HOLD, *loops, still=True), tmp_path) as found:
        about = found.attributes("wild/control")
        assert about["verdict"] in ("grows", "diverges")
        assert about["spectral_radius"] > 1
        assert any("start with proportional" in text for text in about["advice"])
        assert found.attributes("calm/control")["verdict"] == "stable"
        assert list(found.verdict["wild"].warnings)


MISTAKES = [
    ({"delay": 0.6}, "expected a delay shorter than the run"),
    ({"sensor": [{"point": "fore.tpi"}]}, 'found "fore.tpi".*did you mean'),
    ({"sensor": [{"joint": "P"}]}, 'expected one of the joints .*found "P"'),
    ({"sensor": [{"motor": "waist"}]}, 'sensor no. 1: motor: expected a joint with stiffness .*found "waist"'),
    ({"sensor": [{"pzt": "fore"}]}, "expected a layout of patches"),
    ({"sensor": [{"modal": "column"}]}, "expected a flexible body"),
    ({"sensor": [{"joint": "waist", "measure": "acceleration"}]}, "measure"),
    ({"sensor": [{"joint": "waist", "resolution": -1.0}]}, "resolution"),
    ({"controller": [{"kind": "joint-pid", "proportional": {"B": 1.0}}]}, 'found "B"'),
    ({"controller": [{"kind": "modal-velocity", "bodies": ["fore"], "damping_ratio": 1.0}]}, "a body with patches"),
    ({"controller": [{"kind": "pid"}]}, "joint-pid"),
    ({"feed_forward": "joints+pzt"}, "feed_forward"),
    ({"tip": "fore.tpi"}, "fore.tpi"),
    ({"disturbance": [{"joint": "waist", "moment": "1"}]}, "disturbances at points"),
    ({"disturbance": [{"point": "fore.tip", "force": "x"}]}, "force"),
    ({"disturbance": [{"point": "fore.tip", "z": "log(t - 1)"}]}, "disturbance no. 1: z"),
    ({"actuation": "nothing"}, "actuation"),
]  # fmt: skip


@pytest.mark.parametrize(("keys", "expected"), MISTAKES)
def test_bad_keys_are_refused(tmp_path, keys, expected):
    path = scenes_in_3d.write(arm(HOLD, held("loop", HOLDS) | keys), tmp_path / "scene.toml")
    with pytest.raises(InputError, match=expected):
        ffrobot.solve(path)


def test_joints_that_no_sensor_reads_are_refused(tmp_path):
    points = {"root": [0.0, 0.0, 0.0], "tip": [0.0, 0.0, 0.5]}
    body = {
        "name": "b",
        "rigid": {"mass": 1.0, "center": [0.0, 0.0, 0.2], "inertia": [0.02, 0.03, 0.01], "points": points},
    }
    joint = {"name": "S", "type": "spherical", "between": ["ground", "b.root"]}
    tables = {
        "name": "s", "space": "spatial", "gravity": [0.0, 0.0, -9.81], "body": [body], "joint": [joint],
        "trajectory": [{"name": "tip", "point": "b.tip", "x": "0", "y": "0"}],
        "analysis": [HOLD, held("loop", sensor=[{"joint": "S"}])],
    }  # fmt: skip
    with pytest.raises(InputError, match='expected one with coordinates, found "S", a spherical joint'):
        solve(tables, tmp_path)
