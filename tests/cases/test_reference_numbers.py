"""Scenes in 3D against numbers of other codes and closed forms."""

import numpy as np
import pytest
from beam_links import beam_link, circle, rectangle
from tables_3d import ORIGIN, Y, revolute, rigid, scene

import ffrobot
from ffrobot.mbs.model.build import build_model
from ffrobot.mbs.model.known_motion import KnownStates, required_forces
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.run.bodies import load_bodies

ALL_BENDING = ["in-plane-bending", "out-of-plane-bending"]


def link(length, section, count, family="all", E=70e9, elements=20, condition="cantilever", **keys):
    modes = {"count": count, "family": family, "attachment_modes": False}
    return beam_link(length, section, elements, E=E, condition=condition, modes=modes, damping={"ratio": 0.0}, **keys)


def solved(bodies, joints, *analyses, **tables):
    return ffrobot.solve(ffrobot.make_scene(**scene(bodies, joints, *analyses, **tables)))


def fallen(*bodies):
    """Tip (2, 3) of a double pendulum on hinges about y and (1, 1, 0)/√2, at 0.3 and 0.6 s."""
    joints = [
        revolute("upper", "ground", "first.root", Y, motor=False),
        revolute("lower", "first.tip", "second.root", [1.0, 1.0, 0.0], motor=False),
    ]
    fall = {"name": "fall", "kind": "forward", "end": 0.6, "output_step": 0.3, "tolerance": 1e-7}
    with solved(bodies, joints, fall) as results:
        return results["fall/points/second.tip/position"][1:]


def test_slanted_double_pendulum_of_soft_links():
    """MBDyn's tip, its steps of 1e-4 s and 5e-5 s extrapolated, ±1e-4 m."""
    soft = link(0.5, rectangle(0.02, 0.02), 8, E=0.7e9)
    expected = [[0.80563, 0.07046, -0.51826], [-0.58051, -0.05216, -0.81280]]
    found = fallen(*({"name": name, "link": soft} for name in ("first", "second")))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4)


def test_slanted_double_pendulum_of_rigid_links():
    """The same of rigid bars: MuJoCo's tip, by its method of Runge and Kutta."""
    along, across = 0.54 * 0.02**2 / 6, 0.54 * (0.5**2 + 0.02**2) / 12
    keys = {"inertia": [along, across, across], "center": [0.25, 0.0, 0.0], "tip": [0.5, 0.0, 0.0]}
    expected = [[0.79823124, 0.10313258, -0.49905709], [-0.64873297, 0.08379688, -0.69880379]]
    found = fallen(*(rigid(name, 0.54, **keys) for name in ("first", "second")))
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-6)


def shaft_model(shaft, **tables):
    """The model of a link that nothing holds."""
    tables = (
        scene([{"name": "shaft", "link": shaft}], [], {"name": "unused", "kind": "static"}, gravity=ORIGIN) | tables
    )
    made = ffrobot.make_scene(**tables)
    return build_model(made, [body.spatial for body in load_bodies(made, lambda _: None).values()])


def whirling(model, Omega):
    """Frequencies in 3D of small motions of a shaft that spins about its axis at Ω, both whirls of each, rad/s.

    In the frame that spins by the equations of its modes; seen from there forward whirls are Ω slower, backward Ω
    faster. By steps in p, ṗ and p̈, of which the forces on modes are of second degree.
    """
    (node,) = model.tree.nodes
    n, at_rest = node.body.n_modes, model.tree.at_rest({})

    def forces(k, h):
        """On modes, by steps h of p, ṗ or p̈ (k = 0, 1, 2), one mode in each row."""
        q, v, a = np.tile(at_rest, (n, 1)), *np.zeros((2, n, model.tree.n_v))
        v[:, node.v] = [0.0, 0.0, 0.0, Omega, 0.0, 0.0]
        (q[:, node.p_q], v[:, node.p_v], a[:, node.p_v])[k][:] = h * np.eye(n)
        state = KnownStates(q, v, a)
        return required_forces(MultibodySystem(model), state, np.zeros(n))[:, node.p_v].T

    K, D, M = ((forces(k, h) - forces(k, -h)) / (2 * h) for k, h in enumerate((1e-3, 1.0, 1.0)))
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    s = np.linalg.eigvals(A)
    assert np.abs(s.real).max() < 1e-6 * np.abs(s).max()
    return np.sort(s.imag[s.imag > 0])


@pytest.mark.parametrize("stiffening", [True, False])
def test_spinning_shaft_whirls_forward_and_backward(stiffening):
    """Pins, gyroscopic moments: ω² ∓ 2λω₀ω − ω₀² = 0, λ = ½ΩI_x/√(EIρS) (Code_Aster V2.02.141), seen from the shaft.

    With the rotary inertia of tilting sections, κ = r²k²/(1 + r²k²) of the mass (r radius of inertia, k = π/L), λω₀ is
    κΩ. Sections that tilt by ψ keep their height in u = x + Φp: what they lose in ψ², geometric stiffening gives back;
    without it κΩ² is missing in ω₀². The split is what gyroscopic moments make.
    """
    diameter, length, Omega = 0.02, 1.0, 3000.0
    shaft = link(length, circle(diameter), 2, ALL_BENDING, 2e11, 40, condition="simply-supported")
    model = shaft_model(shaft | {"model": {"theory": "timoshenko"}}, geometric_stiffening=stiffening)
    omega_0 = whirling(model, 0.0).mean()
    r_k = diameter / 4 * np.pi / length
    kappa = r_k**2 / (1 + r_k**2)
    mean = np.sqrt(omega_0**2 + (kappa * Omega) ** 2 - (0.0 if stiffening else kappa * Omega**2))
    forward, backward = mean + kappa * Omega, mean - kappa * Omega
    found = whirling(model, Omega)
    np.testing.assert_allclose(found, [Omega - forward, Omega + backward], rtol=2e-6)
    split = 2 * Omega - found.sum()
    np.testing.assert_allclose(split, forward - backward, rtol=2e-3)


def test_rod_that_spins_is_stretched():
    """About its root at Ω: u = sin αL/(α cos αL) − L at its tip, α² = ρΩ²/E (Code_Aster V3.04.105), by axial modes."""
    E, density, length, Omega = 7e9, 2700.0, 1.0, 500.0
    model = shaft_model(link(length, rectangle(0.02, 0.016), 8, "axial", E, 80))
    (node,) = model.tree.nodes
    n, step = node.body.n_modes, 1e-3
    q, v, a = np.tile(model.tree.at_rest({}), (n + 1, 1)), *np.zeros((2, n + 1, model.tree.n_v))
    v[:, node.v] = [0.0, 0.0, 0.0, 0.0, 0.0, Omega]
    q[1:, node.p_q] = step * np.eye(n)
    a[:, node.v] = 0.0
    state = KnownStates(q, v, a)
    forces = required_forces(MultibodySystem(model), state, np.zeros(n + 1))[:, node.p_v]
    K = (forces[1:] - forces[0]).T / step  # forces on modes are affine in p
    p = np.linalg.solve(K, -forces[0])
    alpha = Omega * np.sqrt(density / E)
    expected = np.tan(alpha * length) / alpha - length
    stretched = float(node.body.points["tip"].translation[0] @ p)
    np.testing.assert_allclose(stretched, expected, rtol=2e-4)
    assert expected > 1.01 * density * Omega**2 * length**3 / (3 * E)  # more than of the load at rest
