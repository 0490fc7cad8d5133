"""Forces of the user's that depend on how a point moves: springs and dampers to the ground."""

import numpy as np
import pytest
from beam_links import beam_link, circle
from tables_3d import joint, pin, planar, revolute, scene

import ffrobot

K, C, MASS = 40.0, 0.8, 2.0
SPRING = """
void spring(double t, const double *x_y_angle, const double *rates, double *f) {
  f[0] = -40.0 * (x_y_angle[0] - 0.6) - 0.8 * rates[0];
  f[1] = -40.0 * x_y_angle[1] - 0.8 * rates[1];
  f[2] = 0.0;
}
"""
ANCHOR = np.array([0.6, 0.0])


def spring(t, position, velocity):
    return -K * (position - ANCHOR) - C * velocity


def swung(force, **analysis):
    """A flexible link on a hinge, turned by 0.5 rad."""
    link = beam_link(0.6, circle(0.01), 4, modes={"count": 2, "family": "in-plane-bending"})
    load, initial = [{"point": "arm.tip", "force": force}], {"angles": {"arm": 0.5}}
    body, hinge = {"name": "arm", "link": link}, pin("O", "ground", "arm.root")
    run = FREE | {"end": 0.02, "output_step": 0.002} | analysis
    return ffrobot.make_scene(**planar([body], [hinge], run, gravity=(0.0, 0.0), load=load, initial=initial))


FREE = {"name": "free", "kind": "forward", "end": 1.0, "tolerance": 1e-9}


@pytest.mark.parametrize("integrator", ["dop853", "radau"])
def test_compiled_is_python(compiled, integrator):
    """On a flexible link that is swung by its hinge and pulled back."""
    forces = spring, compiled("spring", SPRING)
    runs = [ffrobot.solve(swung(force, integrator=integrator)) for force in forces]
    by_python, by_core = (run["free/points/arm.tip/position"] for run in runs)
    np.testing.assert_allclose(by_core, by_python, rtol=1e-12)
    assert np.ptp(by_core[:, 1]) > 1e-3  # it moves


AT = np.array([0.6, 0.1, -0.2])
AXIS = np.array([1.0, 2.0, 2.0]) / 3


def in_3d(force, analysis, *joints, **keys):
    """A body whose point "center" is its center of mass, free where no joint is given."""
    body = {"mass": MASS, "center": [0.3, 0.0, 0.0], "inertia": [0.01, 0.02, 0.03],
            "points": {"root": [0, 0, 0], "center": [0.3, 0.0, 0.0]}}  # fmt: skip
    keys = {"gravity": [0.0, 0.0, 0.0], "load": [{"point": "arm.center", "force": force}]} | keys
    return ffrobot.make_scene(
        **scene([{"name": "arm", "rigid": body}], list(joints), {"output_step": 0.01} | analysis, **keys)
    )


def pull_back(t, position, velocity):
    return -K * (position - AT) - C * velocity


def test_mass_on_a_spring_in_3d():
    """A free body at its center, from 0.3 m along x: a damped oscillation along each axis about AT + m g / k."""
    g = np.array([1.0, -2.0, -9.81])
    results = ffrobot.solve(in_3d(pull_back, FREE, gravity=g.tolist()))
    t, decay, rest = results.time("free")[:, None], C / (2 * MASS), AT + MASS * g / K
    omega = np.sqrt(K / MASS - decay**2)
    back = np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    found = results["free/bodies/arm/position"] + [0.3, 0.0, 0.0]
    np.testing.assert_allclose(found, rest + ([0.3, 0.0, 0.0] - rest) * back, atol=1e-8)


def test_torque_that_it_asks_of_a_motor_in_3d():
    """Held, a hinge about `AXIS` feels force and moment of the function: τ = −e·(r × F + M)."""
    moment = np.array([1.0, -2.0, 3.0])

    def force(t, position, velocity):
        return *pull_back(t, position, velocity), *(moment * (1 + t))

    hinge = revolute("O", "ground", "arm.root", AXIS.tolist())
    hold = {"name": "turn", "joint": "O", "value": "0"}
    results = ffrobot.solve(in_3d(force, {"name": "held", "kind": "pcid", "end": 0.1}, hinge, trajectory=[hold]))
    r = np.array([0.3, 0.0, 0.0])
    expected = -AXIS @ np.cross(r, -K * (r - AT)) - (1 + results.time("held")) * (AXIS @ moment)
    np.testing.assert_allclose(results["held/joints/O/moment"], expected, rtol=1e-10)


def test_static_equilibrium_and_linear_model_in_3d():
    """On an oblique slide: the way m g·e / k + AT·e − 0.3 e_x, ω² = k / m and damping c / m."""
    slide = joint("O", "prismatic", "ground", "arm.root", axis=AXIS.tolist())
    g = np.array([1.0, -2.0, -9.81])
    static = {"initial": {"state": "static"}, "gravity": g.tolist()}
    sagged = ffrobot.solve(in_3d(pull_back, FREE, slide | {"motor": False}, **static))
    way = MASS * g @ AXIS / K + (AT - [0.3, 0.0, 0.0]) @ AXIS
    np.testing.assert_allclose(sagged["free/joints/O/coordinate"], way, rtol=1e-9)
    about = {"name": "rest", "kind": "linear", "output_step": None}
    results = ffrobot.solve(in_3d(pull_back, about, slide))
    eigenvalues = np.linalg.eigvals(results["rest/linear/A"][0])
    np.testing.assert_allclose(eigenvalues.real, -C / (2 * MASS), rtol=1e-6)
    np.testing.assert_allclose(np.abs(eigenvalues), np.sqrt(K / MASS), rtol=1e-6)


def test_wrong_returns_and_errors_come_through():
    with pytest.raises(ffrobot.InputError, match=r"expected a force \(x, y, z\), or \(x, y, z, mx, my, mz\), found"):
        ffrobot.solve(in_3d(lambda t, x, v: (1.0, 2.0), FREE))
    with pytest.raises(ffrobot.InputError, match=r"<lambda>: expected a force \(x, y\), or \(x, y, moment\), found"):
        ffrobot.solve(swung(lambda t, x, v: 1.0))
    with pytest.raises(ZeroDivisionError):
        ffrobot.solve(swung(lambda t, x, v: (1 / 0, 0.0)))
    beside = [{"point": "arm.center", "x": "1", "force": pull_back}]
    with pytest.raises(ffrobot.InputError, match='expected "force" alone with "point", found "x", "force"'):
        in_3d(None, FREE, load=beside)
