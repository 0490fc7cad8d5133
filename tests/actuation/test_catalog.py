"""Choice of motors from a catalog: closed forms of a load with friction and inertia, and wrong catalogs."""

import numpy as np
import pytest

import ffrobot
from ffrobot.actuation.motor_catalog import CatalogMotor, JointTask, choices, read_catalog
from ffrobot.common.errors import InputError
from ffrobot.present.feasibility import joint_tasks

OMEGA, INERTIA, AMPLITUDE = 3.0, 2.0, 0.8


def swinging():
    """A load of pure inertia: θ = a sin ωt over whole periods."""
    t = np.linspace(0.0, 2 * np.pi / OMEGA, 4001)
    acceleration = -AMPLITUDE * OMEGA**2 * np.sin(OMEGA * t)
    return JointTask(t, INERTIA * acceleration, AMPLITUDE * OMEGA * np.cos(OMEGA * t), acceleration)


def motor(**keys):
    return CatalogMotor(**({"name": "m", "rated_torque": 1.0, "peak_torque": 3.0, "max_speed": 500.0} | keys))


@pytest.mark.parametrize("ratio", [10.0, 50.0, 100.0])
def test_inertia_alone(ratio):
    """τ = (J_L/N + J N) a ω²; its RMS is 1/√2 of it."""
    J = 4e-4
    (found,) = choices(swinging(), [motor(rotor_inertia=J, gear_ratio=(ratio,))])
    peak = (INERTIA / ratio + J * ratio) * AMPLITUDE * OMEGA**2
    assert found.peak == pytest.approx(peak, rel=1e-6)
    assert found.rms == pytest.approx(peak / np.sqrt(2), rel=1e-6)
    assert found.speed == pytest.approx(ratio * AMPLITUDE * OMEGA, rel=1e-12)


def test_a_rotor_before_a_compliant_gear_moves_with_the_motor():
    """The load of a task is what the gear passes on, whose torque the rotor adds to."""
    body = {"mass": 2.0, "center": [0.0, 0.0], "inertia": 0.2, "points": {"root": [0.0, 0.0]}}
    gear = {"gear_ratio": 50.0, "rotor_inertia": 1e-4, "stiffness": 300.0, "damping": 0.05}
    results = ffrobot.solve(ffrobot.make_scene(
        name="turn", gravity=[0.0, 0.0], body=[{"name": "b", "rigid": body}],
        joint=[{"name": "O", "type": "revolute", "between": ["ground", "b.root"], **gear}],
        trajectory=[{"name": "turn", "motor": "O", "via": [0.0, 1.0], "duration": 0.3}],
        analysis=[{"name": "run", "kind": "pcid", "end": 0.5, "output_step": 0.002}],
    ))  # fmt: skip
    ((_, task),) = joint_tasks(results, "run")
    passed = results["run/joints/O/gear_moment"]
    np.testing.assert_allclose(task.load, passed, atol=1e-3 * np.abs(passed).max())
    assert np.abs(task.rate).max() == np.abs(results["run/joints/O/motor_rate"]).max()


def test_losses_of_the_gear_take_when_driving_and_help_when_braking():
    t = np.linspace(0.0, 1.0, 101)
    for sign, expected in ((1.0, 1 / 0.8), (-1.0, 0.8)):
        task = JointTask(t, np.full(101, 8.0), np.full(101, sign), np.zeros(101))
        (found,) = choices(task, [motor(efficiency=0.8, gear_ratio=(10.0,))])
        assert found.peak == pytest.approx(0.8 * expected)


def test_the_lightest_that_fits_comes_first_and_then_the_nearest():
    heavy, light, weak = motor(name="heavy", mass=2.0), motor(name="light", mass=1.0), motor(name="weak", mass=0.1)
    weak = weak.model_copy(update={"peak_torque": 1e-3, "rated_torque": 1e-3})
    strong = {"rated_torque": 100.0, "peak_torque": 100.0}
    heavy, light = heavy.model_copy(update=strong), light.model_copy(update=strong)
    found = choices(swinging(), [weak, heavy, light])
    assert [one.motor.name for one in found] == ["light", "heavy", "weak"]
    assert [one.fits for one in found] == [True, True, False]


CSV = "name, rated_torque, peak_torque, max_speed, gear_ratio\nA, 0.1, 0.3, 600, 50 100\n"
TOML = '[[motor]]\nname = "A"\nrated_torque = 0.1\npeak_torque = 0.3\nmax_speed = 600\ngear_ratio = [50, 100]\n'


def test_csv_and_toml_say_the_same(tmp_path):
    (tmp_path / "m.csv").write_text(CSV)
    (tmp_path / "m.toml").write_text(TOML)
    assert read_catalog(tmp_path / "m.csv") == read_catalog(tmp_path / "m.toml")
    assert read_catalog(tmp_path / "m.csv")[0].gear_ratio == (50.0, 100.0)
    (tmp_path / "excel.csv").write_text("sep=;\n" + CSV.replace(",", ";").replace(".", ","))
    assert read_catalog(tmp_path / "excel.csv") == read_catalog(tmp_path / "m.toml")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "expected a line of columns"),
        (CSV.replace("max_speed", "peak_torque"), "each column once, found 'name,rated_torque,peak_torque,peak"),
        (CSV.replace("0.3", "strong"), "peak_torque"),
        (CSV + "B, 1\n", "line 3: expected 5 cells with commas, semicolons or tabs between them"),
    ],
)
def test_wrong_catalogs(tmp_path, text, message):
    path = tmp_path / "m.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_catalog(path)
