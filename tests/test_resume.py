"""Runs that were stopped go on from their results file as if they had never been."""

import os
import re
import signal

import h5py
import pytest
import tomli_w
from small_robots import ARM
from stopped_runs import SAME, Stops, check_attributes, differences, edit, go_on, stop

import ffrobot
from ffrobot.mbs import _core
from ffrobot.run.watcher import Watcher

END = 0.12
SHORT = {"end = 1.0": f"end = {END}"}


@pytest.fixture
def arm(case_copy):
    """The two-link case, shorter, with texts replaced."""

    def copy(**edits):
        scene = case_copy("two_link")
        edit(scene, SHORT | edits)
        return scene

    return copy


@pytest.mark.parametrize("stopped", [pytest.param("inverse", marks=pytest.mark.nightly), "forward"])
def test_a_resumed_run_is_the_uninterrupted_one(arm, stopped):
    """To the last bit: the explicit methods go on with the same step.

    "auto" has tried Radau before: what it found, and steps by two methods to be replayed, go on as well.
    """
    scene, after, end = arm(**{"tolerance = 1e-7": "tolerance = 1e-2", "end = 1.0": "end = 0.2"}), 0.1, 0.2
    expected = ffrobot.solve(scene)
    assert expected.attributes("inverse")["integrator"] == "dop853 after radau"
    message = stop(scene, stopped, after)
    with h5py.File(scene.with_suffix(".h5")) as file:
        reached = _core.TreeCheckpoint.of_bytes(file[f"{stopped}/resume/checkpoint"][()].tobytes()).time
        outputs = len(file[stopped]["time"])
    assert after <= reached < end
    assert message.endswith(f"solve(…, resume=True) resumes from t = {reached:.9g} s")
    watcher = Stops("none", end)
    results = go_on(scene, watcher)
    assert watcher.asked[0] == (f'analysis "{stopped}"', reached)
    for name, difference in differences(results, expected):
        assert difference < SAME, name
    check_attributes(results, expected)
    assert 1 < outputs < len(expected.time(stopped))
    assert not results.has(f"{stopped}/resume")


@pytest.mark.parametrize("integrator", ["radau", pytest.param("generalized-alpha", marks=pytest.mark.nightly)])
def test_implicit_methods_go_on_within_the_tolerance(arm, integrator):
    tolerance = 1e-3
    keys = f'tolerance = {tolerance}\nintegrator = "{integrator}"\nmax_steps = 50'
    scene = arm(**{"tolerance = 1e-7": keys, f"end = {END}": "end = 0.02"})
    inverse_alone(scene)
    with pytest.raises(ffrobot.SolveError, match="too many steps"):
        go_on(scene)
    edit(scene, {"max_steps = 50": "max_steps = 100_000"})
    expected = ffrobot.solve(scene)
    found = dict(differences(go_on(scene), expected))
    for name in ("joints/O/moment", "joints/A/moment", "trajectories/tip/force[0]", "pzt/link1/required_voltage[4]"):
        assert 0.0 < found[name] < tolerance, name


def inverse_alone(scene):
    text = scene.read_text(encoding="utf-8")
    scene.write_text(text[: text.index("# The same moments and voltages")], encoding="utf-8")


def test_max_steps_may_be_raised_and_count_anew(arm):
    scene = arm(**{"tolerance = 1e-7": 'tolerance = 1e-7\nintegrator = "dop853"\nmax_steps = 800'})
    inverse_alone(scene)
    for _ in range(2):
        with pytest.raises(ffrobot.SolveError, match=r"raise max_steps.*resumes from t = 0\.0"):
            go_on(scene)  # from the start where there is nothing to go on with
    edit(scene, {"max_steps = 800": "max_steps = 100_000"})
    results = go_on(scene)
    assert max(difference for _, difference in differences(results, ffrobot.solve(scene))) < 1e-12
    watcher = Stops("none", END)
    assert repr(go_on(scene, watcher)) == repr(results)
    assert watcher.asked == []  # complete: nothing was run


@pytest.mark.parametrize(
    ("file", "old", "new", "change"),
    [
        ("scene.toml", "tolerance = 1e-7", "tolerance = 1e-6", 'the scene (analysis "inverse": tolerance)'),
        ("scene.toml", "limit = 200.0", "limit = 250.0", 'the scene (pzt "link1": limit)'),
        ("link2.toml", "2.068427e11", "2.1e11", 'the modal body of "link2"'),
        ("path.csv", "1,1.5", "1,1.4", "the waypoints path.csv"),
    ],
)
def test_input_that_has_changed(arm, file, old, new, change):
    scene = arm()
    text = scene.read_text(encoding="utf-8").replace("max_steps", "")
    start = text.index("x = ")
    end = text.index("[[pzt]]")
    (scene.parent / "path.csv").write_text("t,x,y\n0,1.5,0.8660254\n1,1.5,0.8660254\n", encoding="utf-8")
    text = text[:start] + 'waypoints = "path.csv"\n' + text[end:]
    scene.write_text(text.replace("tolerance = 1e-7", "max_steps = 5\ntolerance = 1e-7"), encoding="utf-8")
    with pytest.raises(ffrobot.SolveError):
        go_on(scene)
    edit(scene.parent / file, {old: new})
    with pytest.raises(ffrobot.InputError, match="resume: expected results of the same input") as error:
        go_on(scene)
    assert f"found that {change} has changed" in str(error.value)


def test_other_kinds_and_searches_for_modes_start_again(arm):
    scene = arm(**{'link = "link1.toml"': 'link = "link1.toml"\nmodes = "auto"'})
    inverse_alone(scene)
    assert 'resume=True) runs "inverse" again from its start' in stop(scene, "inverse", 0.0)
    results = go_on(scene)
    assert results.attributes("inverse")["status"] == "completed"


class Told(Watcher):
    """Gets Ctrl-C as the analysis begins."""

    def stage(self, title):
        if "again" in title:
            os.kill(os.getpid(), signal.SIGINT)


def test_a_stop_before_the_run_that_was_stopped_keeps_it(tmp_path):
    """Analyses before it are complete, a replay among them."""
    path, again = tmp_path / "scene.toml", {"name": "again", "kind": "forward", "actuation": "inverse"}
    free = {"name": "free", "kind": "forward", "end": 200.0, "output_step": 0.5}
    path.write_text(tomli_w.dumps(ARM | {"analysis": [*ARM["analysis"], again | {"apply": "joints"}, free]}))
    message = stop(path, "free", 0.1)
    kept = path.with_suffix(".h5").read_bytes()
    with pytest.raises(ffrobot.SolveError, match=re.escape(message[message.index("; solve") :])):
        go_on(path, Told())
    assert path.with_suffix(".h5").read_bytes() == kept
    for name, difference in differences(go_on(path), ffrobot.solve(path)):
        assert difference < SAME, name
