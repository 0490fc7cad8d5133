"""Sensors against closed forms and differences of the motion."""

import numpy as np
import pytest
from beam_links import paper_link
from loop_scenes import INERTIA, T, loop, wheel
from one_link import one_link

import ffrobot
from ffrobot.actuation.control.records import Sensor
from ffrobot.actuation.control.signals import Filter, Signal
from ffrobot.exchange.fmu.linear_fmu import joint_units, linear_variables
from ffrobot.scene.load import make_scene


def test_high_pass_and_delay_of_a_sensor():
    """A ramp c t behind a corner 1/τ gives c τ (1 − e^{−t/τ}), three samples late; before the first sample it rests."""
    tau, c, t = 0.05, 3.0, T * np.arange(100)
    read = [
        Signal("a", Sensor(joint="a", high_pass=1 / (2 * np.pi * tau), delay=3 * T)),
        Signal("b", Sensor(joint="b")),
    ]
    through = Filter(read, T)
    found = np.array([through(np.array([7.0 + c * now, now])) for now in t])
    expected = c * tau * -np.expm1(-(t - 3 * T).clip(min=0.0) / tau)
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-13)
    np.testing.assert_array_equal(found[:, 1], t)


def test_sensors_are_outputs_of_linear_models():
    """A wheel: γ̇ = u/(I s), which a gyro reads, too; r u/I along y at r = 0.3 m, and u/(I s²) of an encoder."""
    sensors = [{"joint": "O", "measure": "rate"}, {"point": "w.rim", "measure": "accelerometer"},
               {"point": "w.rim", "measure": "gyro"}, {"joint": "O", "noise": 1.0}]  # fmt: skip
    results = ffrobot.solve(wheel({"name": "at_rest", "kind": "linear", "sensor": sensors}))
    model, omega = results.linear("at_rest")[0], np.array([0.5, 3.0, 20.0])
    s = 1j * omega
    names = [
        "joint/O/rate",
        "point/w.rim/y/accelerometer",
        "point/w.rim/z/gyro",
        "joint/O",
        "point/w.rim/x/accelerometer",
    ]
    expected = np.array([1 / (INERTIA * s), 0.3 / INERTIA + 0 * s, 1 / (INERTIA * s), 1 / (INERTIA * s**2), 0 * s])
    found = model.frequency_response(omega, "joint/O", names)[:, :, 0]
    np.testing.assert_allclose(found.T, expected, rtol=1e-9, atol=1e-12)
    control = pytest.importorskip("control")
    system = model.to_control("joint/O", names)
    np.testing.assert_allclose(control.frequency_response(system, omega).frdata[:, 0], expected, rtol=1e-9, atol=1e-12)
    _, _, outputs = linear_variables(model, joint_units(results.scene))
    units = {each.name: each.unit for each in outputs}
    assert [units[name] for name in names[:4]] == ["rad/s", "m/s2", "rad/s", "rad"]


@pytest.mark.parametrize("space", ["planar", "spatial"])
def test_accelerometer_and_gyro_against_differences_of_the_motion(space):
    """A rod that swings about O under gravity: in its axes, r̈ − g by differences of its tip's place, and γ̇."""
    rod = {"mass": 2.0, "points": {"root": [0.0] * 3, "tip": [1.0, 0.0, 0.0]}, "center": [0.5, 0.0, 0.0]}
    rod |= {"inertia": [0.01, 2.0 / 12, 2.0 / 12]}
    gravity, axis = [0.0, -9.81, 0.0], {"axis": [0.0, 0.0, 1.0]}
    if space == "planar":
        rod |= {"inertia": 2.0 / 12, "center": [0.5, 0.0], "points": {"root": [0.0, 0.0], "tip": [1.0, 0.0]}}
        gravity, axis = gravity[:2], {}
    sensors = [{"point": "rod.tip", "measure": measure} for measure in ("accelerometer", "gyro")]
    results = ffrobot.solve(make_scene(
        name="swing", space=space, gravity=gravity, body=[{"name": "rod", "rigid": rod}],
        joint=[{"name": "O", "type": "revolute", "between": ["ground", "rod.root"]} | axis],
        trajectory=[{"name": "swing", "joint": "O", "value": "0.9*sin(2*t)"}],
        analysis=[{"name": "inverse", "kind": "pcid", "end": 0.5, "output_step": T, "tolerance": 1e-9},
                  loop(sensor=sensors)],
    ))  # fmt: skip
    t, h = results["loop/control/time"][()], 1e-3
    angle = lambda t: 0.9 * np.sin(2 * t)  # noqa: E731
    place = lambda t: np.exp(1j * angle(t))  # noqa: E731
    second = sum(c * place(t + k * h) for k, c in zip(range(-2, 3), (-1, 16, -30, 16, -1), strict=True)) / (12 * h * h)
    force = (second + 9.81j) / place(t)
    names = list(results.attributes("loop/control")["outputs"])
    read = {name: results["loop/control/reference"][:, k] for k, name in enumerate(names)}
    np.testing.assert_allclose(read["point/rod.tip/x/accelerometer"], force.real, atol=1e-6)
    np.testing.assert_allclose(read["point/rod.tip/y/accelerometer"], force.imag, atol=1e-6)
    np.testing.assert_allclose(read["point/rod.tip/z/gyro"], 1.8 * np.cos(2 * t), atol=1e-6)


def test_strain_is_stress_over_modulus():
    """On the lower side of a beam under a force at its tip, which its attachment modes carry exactly."""
    link = paper_link(attachment_modes=True, count=3, stress={"points": {"gauge": [0.2, -0.0075, 0.0]}})
    inverse = {"name": "inverse", "kind": "pcid", "end": 0.02, "output_step": 0.01}
    keys = {"load": [{"point": "link.tip", "y": "10"}], "initial": {"state": "static"}}
    results = ffrobot.solve(one_link("link", link, inverse, loop(sensor=[{"strain": "link.gauge"}]), **keys))
    stress = results["loop/stress/link/points/gauge/stress"][0, 0]
    by_hand = 10.0 * (1.0 - 0.2) * 0.0075 / (0.025 * 0.015**3 / 12)
    assert abs(stress) == pytest.approx(by_hand, rel=1e-6)
    assert results["loop/control/readings"][0, 0] == pytest.approx(stress / 2.068427e11, rel=1e-6)
