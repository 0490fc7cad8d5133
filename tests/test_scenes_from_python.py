"""The Python interface and sweeps with scenes in 3D: what the command line does."""

import csv
import signal

import numpy as np
import pytest

import ffrobot

PENDULUM = {
    "name": "pendulum",
    "space": "spatial",
    "gravity": [0.0, 0.0, -9.81],
    "body": [
        {
            "name": "rod",
            "rigid": {
                "mass": 2.0,
                "center": [0.3, 0.0, 0.0],
                "inertia": [1e-3, 0.02, 0.02],
                "points": {"root": [0.0, 0.0, 0.0], "tip": [0.6, 0.0, 0.0]},
            },
        }
    ],
    "joint": [{"name": "pin", "type": "revolute", "between": ["ground", "rod.root"], "axis": [0.0, 1.0, 0.0]}],
    "trajectory": [{"name": "swing", "joint": "pin", "value": "0.4*sin(2*t)"}],
    "analysis": [{"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": 0.1}],
}
J = 0.02 + 2.0 * 0.3**2  # about the pin, kg·m²


def moment(t):
    """The equation of a pendulum that hangs along x at 0 and turns about y."""
    angle, acceleration = 0.4 * np.sin(2 * t), -1.6 * np.sin(2 * t)
    return J * acceleration - 2.0 * 9.81 * 0.3 * np.cos(angle)


def test_results_in_memory():
    scene = ffrobot.make_scene(**PENDULUM)
    assert isinstance(scene, ffrobot.Scene)
    with ffrobot.solve(scene) as results:
        t = results["inverse/time"]
        np.testing.assert_allclose(results["inverse/joints/pin/moment"], moment(t), rtol=1e-7)
        assert results.analyses == ["inverse"]


def test_functions_of_python_stand_for_expressions():
    def swing(t):
        return 0.4 * np.sin(2 * t), 0.8 * np.cos(2 * t), -1.6 * np.sin(2 * t)

    keys = PENDULUM | {"trajectory": [{"name": "swing", "joint": "pin", "value": swing}]}
    with ffrobot.solve(ffrobot.make_scene(**keys)) as results:
        np.testing.assert_allclose(results["inverse/joints/pin/moment"], moment(results["inverse/time"]), rtol=1e-7)


def test_files_and_warnings(tmp_path):
    import tomli_w

    scene = tmp_path / "scene.toml"
    scene.write_text(tomli_w.dumps(PENDULUM | {"joint": [PENDULUM["joint"][0] | {"motor": False}]}))
    assert isinstance(ffrobot.load_scene(scene), ffrobot.Scene)
    with pytest.warns(ffrobot.FfrobotWarning, match="joints without motor: pin"):
        ffrobot.solve(scene, tmp_path / "out.h5").close()
    with ffrobot.Results(tmp_path / "out.h5") as results:
        assert results["inverse/bodies/rod/position"].shape == (11, 3)
    written = (tmp_path / "out.h5").read_bytes()
    ffrobot.solve(scene, tmp_path / "out.h5", resume=True).close()  # complete: nothing is run
    assert (tmp_path / "out.h5").read_bytes() == written


def test_mistakes_are_input_errors():
    with pytest.raises(ffrobot.InputError, match="gravity"):
        ffrobot.make_scene(**PENDULUM | {"gravity": [0.0, -9.81]})


def test_earlier_analyses_are_kept_where_one_fails(tmp_path):
    """The first finds a pendulum; the second would have to find it beyond the domain of its load."""
    rest = {"name": "rest", "kind": "static"}
    steps = {"name": "long", "kind": "pcid", "end": 1.0, "output_step": 0.1, "max_steps": 2}
    scene = ffrobot.make_scene(folder=tmp_path, **PENDULUM | {"analysis": [rest, steps]})
    with pytest.raises(
        ffrobot.SolveError, match=r'analysis "long" ended at t = .* \(too many steps\): raise max_steps'
    ):
        ffrobot.solve(scene, tmp_path / "out.h5")
    with ffrobot.Results(tmp_path / "out.h5") as results:
        np.testing.assert_allclose(results["rest/joints/pin/moment"], [-2.0 * 9.81 * 0.3], rtol=1e-12)
        assert results.attributes("long")["status"] == "too many steps"


class Ends(ffrobot.Watcher):
    """Ends a run when it is first asked, by what it answers or by Ctrl-C."""

    def __init__(self, how):
        self.how = how

    def advance(self, t, end):
        if self.how == "Ctrl-C":
            signal.raise_signal(signal.SIGINT)
        return self.how == "Ctrl-C"


@pytest.mark.parametrize("how", ["answer", "Ctrl-C"])
def test_what_there_is_when_a_run_is_stopped_is_kept(how, tmp_path):
    long = {"name": "long", "kind": "pcid", "end": 2000.0, "output_step": 0.5, "tolerance": 1e-10}
    last = {"name": "last", "kind": "static"}
    scene = ffrobot.make_scene(folder=tmp_path, **PENDULUM | {"analysis": [long, last]})
    with pytest.raises(
        ffrobot.SolveError, match=r'analysis "long" ended at t = .* \(interrupted\): stopped on request'
    ):
        ffrobot.solve(scene, tmp_path / "out.h5", Ends(how))
    with ffrobot.Results(tmp_path / "out.h5") as results:
        t = results["long/time"]
        assert 1 <= len(t) < 4001
        assert results.attributes("long")["status"] == "interrupted"
        np.testing.assert_allclose(results["long/joints/pin/moment"], moment(t), rtol=1e-7)
        assert results.analyses == ["long"]


def test_sweep_over_the_mass(tmp_path, ffrobot):
    import tomli_w

    scene = tmp_path / "scene.toml"
    scene.write_text(tomli_w.dumps(PENDULUM))
    vary = "--vary", "body.rod.rigid.mass=1.0,2.0"
    done = ffrobot("sweep", scene, *vary, "--collect", "inverse/points/rod.tip/position")
    assert done.returncode == 0, done.stderr
    with (tmp_path / "scene.sweep" / "table.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["status"] for row in rows] == ["completed", "completed"]
    first, second = (float(row["inverse/joints/pin/moment max"]) for row in rows)
    assert second > 1.5 * first
    np.testing.assert_allclose([float(row["inverse/points/rod.tip/position max"]) for row in rows], 0.6)
