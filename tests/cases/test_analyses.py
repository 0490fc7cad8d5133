"""Analyses of scenes in 3D beside pcid, through `ffrobot solve`: an independent code's numbers, and identities."""

import warnings

import numpy as np
import pytest
from checkpoint_mechanisms import load
from checkpoint_scene_files import close, solved, write_scene
from robots_3d import random_scene_in_3d
from tables_3d import Y, pin, planar, revolute, rigid, scene

import ffrobot

FCID = ('kind = "pcid"', 'kind = "fcid"\nshape = "zero"')
STATIC = '\n[[analysis]]\nname = "rest"\nkind = "static"\n'


def rows_at(file, analysis, samples):
    """The outputs at which the samples are."""
    time = file[f"{analysis}/time"][()]
    rows = [int(np.abs(time - sample["t"]).argmin()) for sample in samples]
    np.testing.assert_allclose(time[rows], [sample["t"] for sample in samples], atol=1e-12)
    return rows


@pytest.mark.parametrize("name", ["arm3_line", "arm6"])
def test_links_that_are_held_straight(name, tmp_path, ffrobot):
    """FCID with p = 0 is algebraic: to rounding, position and pose alike."""
    samples = load(f"{name}_fcid")["samples"]
    with solved(ffrobot, write_scene(f"{name}_static", tmp_path, FCID)) as file:
        rows, group = rows_at(file, "inverse", samples), file["inverse"]
        assert group.attrs["kind"] == "fcid"
        for number in range(len(samples[0]["joints"])):
            joint = group[f"joints/q{number + 1}"]
            for key, dataset in (("joints", "coordinate"), ("joint_rates", "rate"), ("F_a", "moment")):
                expected = np.array([sample[key] for sample in samples])
                found = joint[dataset][()][rows]
                np.testing.assert_allclose(found, expected[:, number], atol=1e-11 * np.abs(expected).max())
        for body in samples[0]["F_p"]:
            expected = np.array([sample["F_p"][body] for sample in samples])
            found = group[f"bodies/{body}/modal_force"][()][rows]
            np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())
            assert not np.any(group[f"bodies/{body}/modal"])
        assert np.max(group["constraint_violation"]) < 1e-11


@pytest.mark.parametrize("name", ["arm3_line_static", "arm6_static"])
def test_equilibrium_is_where_static_starts_begin(name, tmp_path, ffrobot):
    """Paths that begin from rest: the first sample of an independent code."""
    sample = load(name)["samples"][0]
    scene = write_scene(name, tmp_path)
    text = scene.read_text()
    scene.write_text(text[: text.index("[[analysis]]")] + STATIC)
    with solved(ffrobot, scene) as file:
        group = file["rest"]
        np.testing.assert_array_equal(group["time"], [0.0])
        close(group["trajectories/path/force"], [sample["path_force"][: group["trajectories/path/force"].shape[1]]])
        moments = [group[f"joints/q{k + 1}/moment"][0] for k in range(len(sample["moments"]))]
        close(np.array(moments), sample["moments"])
        for name, body in sample["bodies"].items():
            for key in ("modal", "modal_force"):
                if key in body:
                    close(group[f"bodies/{name}/{key}"], [body[key]])
            assert not np.any(group[f"bodies/{name}/velocity"])


def forward_scene(folder):
    """Checkpoint arm3_forward: moments given to the motors, no path."""
    data = load("arm3_forward")
    scene = write_scene("arm3_line_undeformed", folder)
    text = scene.read_text()
    guess = ", ".join(f"q{k} = {x}" for k, x in enumerate(data["joints_at_0"], 1))
    lines = [text[: text.index("[initial]")], f"[initial]\njoints = {{ {guess} }}\n"]
    for k, (a, b, w) in enumerate(data["motor_parameters"], 1):
        lines.append(f'[[load]]\njoint = "q{k}"\nmoment = "{a} + ({b})*sin({w}*t)"\n')
    lines.append('[[analysis]]\nname = "free"\nkind = "forward"\nend = 0.3\noutput_step = 0.02\ntolerance = 1e-8\n')
    scene.write_text("\n".join(lines))
    return scene


def test_forward_motion_under_given_moments(tmp_path, ffrobot):
    samples = load("arm3_forward")["samples"]
    with solved(ffrobot, forward_scene(tmp_path)) as file:
        group = file["free"]
        for key, dataset in (("joints", "coordinate"), ("joint_rates", "rate")):
            found = np.column_stack([group[f"joints/q{k}/{dataset}"] for k in (1, 2, 3)])
            close(found, [sample[key] for sample in samples])
        close(group["points/fore.tip/position"], [sample["tip_position"] for sample in samples])
        modal = np.hstack([group[f"bodies/{body}/modal"] for body in ("upper", "fore")])
        expected = np.array([sample["modal"] for sample in samples])
        for found, wanted in zip(modal.T, expected.T, strict=True):
            close(found, wanted)
        assert "trajectories" not in group
        assert "moment" not in group["joints/q1"]


@pytest.mark.parametrize(("seed", "number"), [(301, 1), (303, 17)])
def test_equilibrium_whose_forces_are_all_of_the_links(seed, number):
    """Upright axes hold nothing: what is left of gravity and elasticity together is rounding, the same as all of it."""
    _, scene = random_scene_in_3d(seed, number, [("rest", 1e-3, "dop853")], 60_000)
    results = ffrobot.solve(scene)
    assert scene.initial.state == "static"
    modal = np.abs(results["rest/bodies/b1/modal"][0]).max()
    assert modal > 0.0
    assert np.abs(results["rest/bodies/b1/modal_velocity"][0]).max() < 1e-9 * modal


@pytest.mark.parametrize("kind", ["static", "linear", "forward"])
@pytest.mark.parametrize(
    ("upper", "lower", "is_stable"), [(1.4, 0.1, True), (-1.4, 3.0, False), (-1.4, 0.1, False), (1.4, 3.0, False)]
)
def test_a_double_pendulum_has_one_stable_equilibrium(kind, upper, lower, is_stable):
    """Both bars down, of four; joints about y carry x to -z."""
    bodies = [rigid(name, center=[0.25, 0.0, 0.0], tip=[0.5, 0.0, 0.0]) for name in "ab"]
    joints = [revolute("A", "ground", "a.root", Y, motor=False), revolute("B", "a.tip", "b.root", Y, motor=False)]
    start = {"state": "static", "joints": {"A": upper, "B": lower}}
    times = {"end": 0.01, "output_step": 0.01} if kind == "forward" else {}
    made = ffrobot.make_scene(**scene(bodies, joints, {"name": "rest", "kind": kind} | times, initial=start))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ffrobot.FfrobotWarning)
        results = ffrobot.solve(made)
    told = [text for text in results.warnings.get("rest", ()) if "equilibrium is unstable" in text]
    assert len(told) == (not is_stable)
    angles = [results[f"rest/joints/{name}/coordinate"][0] for name in "AB"]
    np.testing.assert_allclose(angles, [np.copysign(np.pi / 2, upper), np.pi * (lower > 1)], atol=1e-9)


@pytest.mark.parametrize(("kind", "angle", "told"), [("static", np.pi / 2, True), ("linear", 0.3, False)])
def test_a_motor_without_a_path_hangs_in_a_static_analysis_alone(kind, angle, told):
    bodies, joints = [rigid("a", center=[0.25, 0.0, 0.0])], [revolute("A", "ground", "a.root", Y)]
    made = ffrobot.make_scene(**scene(bodies, joints, {"name": "rest", "kind": kind}, initial={"joints": {"A": 0.3}}))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ffrobot.FfrobotWarning)
        results = ffrobot.solve(made)
    assert results["rest/joints/A/coordinate"][0] == pytest.approx(angle, abs=1e-9)
    assert any('"A" hang, away from [initial]' in text for text in results.warnings.get("rest", ())) == told


@pytest.mark.parametrize(
    ("guess", "angle", "told"),
    [
        (1.15, np.pi / 2 - 0.4, None),
        (0.3, np.pi / 2 - 0.4, '"B" hang, away from [initial]'),
        (-1.95, -np.pi / 2 - 0.4, "equilibrium is unstable"),
    ],
    ids=["hangs", "elsewhere", "upright"],
)
def test_joints_beside_a_path_start_in_an_equilibrium_that_is_told(guess, angle, told):
    """The second bar is upright or hangs where the first stands still at 0.4 rad."""
    bodies = [rigid(name, center=[0.25, 0.0, 0.0], tip=[0.5, 0.0, 0.0]) for name in "ab"]
    joints = [revolute("A", "ground", "a.root", Y), revolute("B", "a.tip", "b.root", Y, motor=False)]
    path = {"name": "path", "joint": "A", "value": "0.4"}
    inverse = {"name": "inverse", "kind": "pcid", "end": 0.01, "output_step": 0.01}
    start = {"state": "static", "joints": {"B": guess}}
    made = ffrobot.make_scene(**scene(bodies, joints, inverse, initial=start, trajectory=[path]))
    with pytest.warns(ffrobot.FfrobotWarning, match="not prescribed"):
        results = ffrobot.solve(made)
    np.testing.assert_allclose(results["inverse/joints/B/coordinate"][0], angle, atol=1e-9)
    found = [text for text in results.warnings["inverse"] if "hang, away" in text or "unstable" in text]
    assert [told in text for text in found] == ([True] if told else [])


def test_a_run_says_what_does_not_move_it():
    """It starts at zero and stays there, whatever the path, and a pulse that lasts 3e-8 s."""
    bar = {"mass": 1.0, "inertia": 0.1, "center": [0.0, 0.0], "points": {"root": [0.0, 0.0], "tip": [0.5, 0.0]}}
    keys = {"trajectory": [{"name": "turn", "joint": "j", "value": "0.2 + t"}], "gravity": [0.0, 0.0]}
    keys["load"] = [{"point": "a.tip", "x": "0", "y": "where(abs(t**2 - 1e-3) < 1e-9, 1e5, 0)"}]  # brief
    free = {"name": "free", "kind": "forward", "end": 0.1, "output_step": 0.1}
    with ffrobot.solve(
        ffrobot.make_scene(**planar([{"name": "a", "rigid": bar}], [pin("j", "ground", "a.root")], free, **keys))
    ) as results:
        pulse, path = results.notes["free"]
        assert pulse.startswith("load no. 1: y is 0 at all 16001 sampled times")
        assert path == "without actuation it does not follow the trajectories"
        assert not results["free/joints/j/coordinate"].any()
