"""Linear models of robots against closed forms, Rayleigh quotients and python-control."""

import numpy as np
import pytest
from links import arm, ritz_link
from mechanisms import make_model, revolute
from scipy.io import loadmat
from scipy.optimize import brentq

from ffrobot.actuation.control.linear_model import LinearModel, robot_modes, state_space
from ffrobot.actuation.control.reachability import controllability, observability
from ffrobot.actuation.control.zeros import zeros
from ffrobot.common.errors import InputError
from ffrobot.mbs.linear.linearisation import LinearEquations
from ffrobot.mbs.model.masses import with_payload
from ffrobot.mbs.posture.start import undeformed_posture

EI, MASS, LENGTH = 30.0, 1.5, 0.8
RATE = np.sqrt(EI / (MASS * LENGTH**3))  # ω = λ² times this
CLAMPED = np.array([1.8751040687, 4.6940911330, 7.8547574382])  # of cos λ cosh λ = −1


def at_rest(robot, points=("link2.tip",)):
    model = robot.model.without_paths()
    state = undeformed_posture(model)
    rest = np.zeros(len(state.v))
    return state_space(LinearEquations(model, state.q, points).at(0.0, state.q, rest, rest))


def hub_and_beam(ratio, modes=8, damping_ratio=0.0):
    """A beam on a motor whose rotor has `ratio` times ρA L³ of inertia; no gravity."""
    link = ritz_link("arm", "cantilever", LENGTH, MASS, EI, modes, damping_ratio, extra=6)
    link = with_payload(link, "root", 0.0, np.zeros(3), np.diag([0.0, 0.0, ratio * MASS * LENGTH**2]))
    model = make_model([link], gravity=(0.0, 0.0), joint=[revolute("hub", "ground", "arm.root")])
    return at_rest(model, ("arm.tip",))


def roots(function, count, step=0.01):
    x = np.arange(0.5, 20.0, step)
    y = function(x)
    return np.array(
        [brentq(function, a, a + step) for a, u, v in zip(x[:-1], y[:-1], y[1:], strict=True) if u * v < 0][:count]
    )


@pytest.mark.parametrize("ratio", [0.01, 0.1, 1.0, 10.0])
def test_poles_are_those_of_a_beam_on_a_hub(ratio):
    """sin λ cosh λ − cos λ sinh λ + (J/ρAL³) λ³ (1 + cos λ cosh λ) = 0, from w(0) = 0, EI w'' = −J ω² w' there."""

    def characteristic(x):
        return np.sin(x) * np.cosh(x) - np.cos(x) * np.sinh(x) + ratio * x**3 * (1 + np.cos(x) * np.cosh(x))

    frequency = robot_modes(hub_and_beam(ratio)).frequency * 2 * np.pi / RATE
    assert frequency[0] == 0.0
    np.testing.assert_allclose(np.sqrt(frequency[1:4]), roots(characteristic, 3), rtol=2e-5)


def test_zeros_at_the_hub_are_the_clamped_frequencies():
    found = zeros(hub_and_beam(0.1), "joint/hub", "joint/hub")
    assert found.minimum_phase
    assert len(found.values) == 2 * 8
    np.testing.assert_allclose(np.sqrt(np.abs(found.values[:6:2].imag) / RATE), CLAMPED, rtol=1e-8)


def test_zeros_at_the_tip_are_real_pairs():
    """sin λ + sinh λ = 0 with λ = (1 + i) x, that is tan x = −tanh x: s = ±2x² RATE, whatever the hub."""
    x = roots(lambda x: np.sin(x) * np.cosh(x) + np.cos(x) * np.sinh(x), 2)
    for ratio in (0.1, 1.0):
        errors = []
        for modes in (4, 8, 16):
            found = zeros(hub_and_beam(ratio, modes), "joint/hub", "point/arm.tip/y")
            assert not found.minimum_phase
            errors.append(np.abs(np.sort(found.unstable.real)[:2] / RATE / (2 * x**2) - 1).max())
        assert errors[0] > 4 * errors[1] > 16 * errors[2]
        assert errors[2] < 1e-3
        assert "non-minimum phase" in found.describe()


@pytest.mark.parametrize("damping", [0.0, 0.3])
@pytest.mark.parametrize("seed", range(4))
def test_zeros_at_infinity_are_left_out_however_coordinates_are_chosen(seed, damping):
    """Of masses in a row from the first to number 5: s² + c s are those of masses 6 to 8, clamped at number 5."""
    n, at = 8, 5
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    Q, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((n, n)))
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-Q.T @ K @ Q, -damping * np.eye(n)]])
    B, C = np.r_[np.zeros(n), Q[0]][:, None], np.r_[Q[at - 1], np.zeros(n)][None]
    states = tuple(f"joint/{k}" for k in range(2 * n))
    model = LinearModel(A, B, C, np.zeros((1, 1)), states, ("u",), ("y",), 0.0, np.eye(n), np.eye(n))
    found = zeros(model, "u", "y")
    squares = np.linalg.eigvalsh(K[at:, at:])
    expected = np.concatenate([np.roots([1.0, damping, square]) for square in squares])
    assert len(found.values) == len(expected) == 2 * (n - at)
    assert found.minimum_phase
    found, expected = (values[np.argsort(values.imag)] for values in (found.values, expected))
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_zeros_of_a_free_mass_and_of_a_damped_spring():
    """u moves a mass, y is where it is; zeros are motions of what else there is: λ² = 0, and λ² + 2 λ + 9 = 0."""
    K, D = np.diag([1.0, 0.0, 9.0]), np.diag([0.1, 0.0, 2.0])
    K[0, 2] = K[2, 0] = -0.5
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-K, -D]])
    B, C = np.eye(6)[:, 3:5], np.eye(6)[:2]
    states = tuple(f"x{k}" for k in range(6))
    model = LinearModel(A, B, C, np.zeros((2, 2)), states, ("u", "v"), ("y", "z"), 0.0, np.eye(3), np.eye(3))
    found = zeros(model, "u", "y")
    expected = [complex(-1.0, -np.sqrt(8.0)), complex(-1.0, np.sqrt(8.0)), 0.0, 0.0]
    np.testing.assert_allclose(found.values, expected, atol=1e-6)
    assert found.minimum_phase
    assert not zeros(model, "u", "z").values.size  # which u does not move


def test_damping_ratios_of_a_clamped_link_are_those_of_its_modes():
    """A hub as heavy as the ground."""
    modes = robot_modes(hub_and_beam(1e7, damping_ratio=0.03))
    np.testing.assert_allclose(modes.damping_ratio[1:5], 0.03, rtol=1e-4)
    assert np.isnan(modes.damping_ratio[0])


def test_frequency_response_of_python_control_is_the_same(tmp_path):
    control = pytest.importorskip("control")
    model = hub_and_beam(0.1, damping_ratio=0.02)
    omega = np.array([0.5, 7.0, 60.0, 400.0])
    wanted = model.frequency_response(omega, ["joint/hub"], ["point/arm.tip/y", "joint/hub"])
    system = model.to_control()
    assert system.input_labels[0] == "joint/hub"
    rows = [system.output_labels.index(name) for name in ("point/arm:tip/y", "joint/hub")]
    got = np.array([system(1j * w) for w in omega])[:, rows, :1]
    np.testing.assert_allclose(got, wanted, rtol=1e-8, atol=1e-12)
    some = model.to_control("joint/hub", ["joint/hub", "point/arm.tip/y"])
    assert (some.input_labels, some.output_labels) == (["joint/hub"], ["joint/hub", "point/arm:tip/y"])
    np.testing.assert_allclose(np.array([some(1j * w) for w in omega])[:, ::-1], wanted, rtol=1e-8, atol=1e-12)
    with pytest.raises(InputError, match=r'expected an output .*found "point/arm\.tpi/y"'):
        model.to_control(outputs="point/arm.tpi/y")
    path = tmp_path / "model.npz"
    model.save(path)
    stored = np.load(path)
    again = control.ss(stored["A"], stored["B"], stored["C"], stored["D"])
    np.testing.assert_allclose(again(60j), system(60j), rtol=1e-12)


def test_mat_file_names_its_columns(tmp_path):
    model = hub_and_beam(0.1)
    model.save(tmp_path / "model.mat")
    stored = loadmat(tmp_path / "model.mat", squeeze_me=True)
    np.testing.assert_array_equal(stored["A"], model.A)
    assert list(stored["input_names"]) == list(model.input_names)
    with pytest.raises(InputError, match=r"expected a file name that ends in .npz or .mat"):
        model.save(tmp_path / "model.txt")


def test_modes_without_reach_are_named():
    """One motor cannot stop two free joints, and a stretched arm's tip does not move along it, to first order."""
    model = at_rest(arm(gravity=(0.0, 0.0)))
    assert controllability(model, ["joint/O", "joint/A"]).lost == ()
    assert controllability(model, "joint/O").lost == ("mode 1 (0 Hz)", "mode 2 (0 Hz)")
    assert observability(model, "joint/O").lost == ("mode 1 (0 Hz)", "mode 2 (0 Hz)")
    straight = arm(gravity=(0.0, 0.0), initial={"angles": {"link1": 0.0, "link2": 0.0}}, trajectory=())
    along = observability(at_rest(straight), "point/link2.tip/x")
    assert len(along.lost) == model.freedom


@pytest.mark.parametrize("turned", [0.0, 0.7, np.pi])
def test_measures_do_not_depend_on_the_axes(turned):
    """A robot turned as a whole; straight, its tip moves along one axis, or across both, and not along it."""
    found = []
    for way in (0.0, turned):
        for bent in (0.0, 0.4):
            angles = {"link1": way, "link2": way + bent}
            model = at_rest(arm(gravity=(0.0, 0.0), initial={"angles": angles}, trajectory=()))
            outputs = [name for name in model.output_names if name.startswith("point/")]
            inputs = [name for name in model.input_names if name.startswith("force/")]
            found.append([observability(model, outputs).measure, controllability(model, inputs).measure])
    np.testing.assert_allclose(found[:2], found[2:], rtol=1e-6, atol=1e-9)
