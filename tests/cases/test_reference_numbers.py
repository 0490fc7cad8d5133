"""Scenes in 3D against numbers of other codes and closed forms, and what cannot change over a long time."""

import numpy as np
import pytest
from checkpoint_scene_files import solved

from ffrobot.mbs.model.known_motion import KnownStates, required_forces
from ffrobot.mbs.model.model import build_model
from ffrobot.run.bodies import load_bodies
from ffrobot.scene.load import load_scene

LINK = """
name = "{name}"
[material]
youngs_modulus = {E}
poissons_ratio = 0.33
density = 2700.0
[geometry]
kind = "beam"
length = {length}
section = {section}
[mesh]
elements = 20
[reference]
condition = "{condition}"
[modes]
{modes}
attachment_modes = false
[damping]
ratio = {damping}
"""
TUBE = '{ shape = "tube", outer = 0.02, inner = 0.016 }'
BAR = '{ shape = "rectangle", height = 0.02, width = 0.016 }'
SLEW = """
name = "slew"
space = "spatial"
gravity = [0.0, 0.0, 0.0]
[[body]]
name = "arm"
link = "arm.toml"
[[joint]]
name = "hub"
type = "revolute"
between = ["ground", "arm.root"]
axis = [1.0, 2.0, 2.0]
[[trajectory]]
name = "turn"
joint = "hub"
value = "pi/2*(t - sin(2*pi*t)/(2*pi))"
[[analysis]]
name = "slew"
kind = "pcid"
end = 0.75
output_step = 0.25
tolerance = 1e-9
"""
# interop.md C 1: from the invariants by DOP853 (1e-11); MBDyn is 2.7e-11 m apart, 5e-7 of the deflection
SLEW_TIP = [
    [0.594587486, 0.058191729, -0.055492779],
    [0.443788239, 0.321884465, -0.243808102],
    [0.142455153, 0.510324327, -0.281559257],
]
SLEW_DEFLECTION = [[-4.813578e-5, 4.082894e-5], [-1.462809e-5, -1.488957e-5], [4.046667e-5, -4.782016e-5]]


def write_slew(folder, link):
    folder.mkdir(exist_ok=True)
    (folder / "arm.toml").write_text(link)
    (folder / "scene.toml").write_text(SLEW)
    return folder / "scene.toml"


def tube(modes='count = 6\nfamily = "all"'):
    return LINK.format(
        name="arm", E="70e9", length=0.6, section=TUBE, condition="cantilever", modes=modes, damping=0.01
    )


def test_oblique_slew(tmp_path, ffrobot):
    """A tube whose frame turns by 90° about (1, 2, 2)/3: MBDyn's motion."""
    with solved(ffrobot, write_slew(tmp_path, tube())) as file:
        tip = file["slew/points/arm.tip"]
        np.testing.assert_allclose(tip["position"][1:], SLEW_TIP, rtol=0, atol=6e-10)
        np.testing.assert_allclose(tip["deflection"][1:, 1:], SLEW_DEFLECTION, rtol=0, atol=6e-12)


def test_solid_link_bends_as_the_beam(tmp_path, ffrobot):
    """The same slew with tetrahedra for a link: deflection and moment within 1 % of the beam's."""
    solid = tube('count = 4\nfamily = "all"').replace('kind = "beam"', 'kind = "solid"')
    solid = solid.replace("[mesh]\nelements = 20\n", "").replace(
        TUBE, '{ shape = "rectangle", height = 0.02, width = 0.016 }'
    )
    beam = tube('count = 4\nfamily = "all"').replace(TUBE, '{ shape = "rectangle", height = 0.02, width = 0.016 }')
    found = {}
    for name, link in (("solid", solid), ("beam", beam)):
        with solved(ffrobot, write_slew(tmp_path / name, link)) as file:
            found[name] = [file["slew/points/arm.tip/deflection"][:, 1:], file["slew/joints/hub/moment"][()]]
    for one, other in zip(found["solid"], found["beam"], strict=True):
        np.testing.assert_allclose(one, other, atol=1e-2 * np.abs(other).max())


PENDULUM = """
name = "slanted"
space = "spatial"
gravity = [0.0, 0.0, -9.81]
{bodies}
[[joint]]
name = "upper"
type = "revolute"
between = ["ground", "first.root"]
axis = [0.0, 1.0, 0.0]
motor = false
[[joint]]
name = "lower"
type = "revolute"
between = ["first.tip", "second.root"]
axis = [1.0, 1.0, 0.0]
motor = false
[[analysis]]
name = "fall"
kind = "forward"
end = 0.6
output_step = 0.3
tolerance = 1e-7
"""
SQUARE = '{ shape = "rectangle", height = 0.02, width = 0.02 }'
RIGID = """
[[body]]
name = "{name}"
[body.rigid]
mass = 0.54
center = [0.25, 0.0, 0.0]
inertia = [{along}, {across}, {across}]
points = {{ root = [0.0, 0.0, 0.0], tip = [0.5, 0.0, 0.0] }}
"""


def fallen(folder, ffrobot, bodies):
    (folder / "scene.toml").write_text(PENDULUM.format(bodies=bodies))
    with solved(ffrobot, folder / "scene.toml") as file:
        assert file["fall"].attrs["status"] == "completed"
        return file["fall/points/second.tip/position"][1:]


def test_slanted_double_pendulum_of_soft_links(tmp_path, ffrobot):
    """Hinges about y and (1, 1, 0)/√2: MBDyn's tip, its steps of 1e-4 s and 5e-5 s extrapolated, ±1e-4 m."""
    modes = 'count = 8\nfamily = "all"'
    for name in ("first", "second"):
        keys = {"E": "0.7e9", "length": 0.5, "section": SQUARE, "condition": "cantilever"}
        (tmp_path / f"{name}.toml").write_text(LINK.format(name=name, modes=modes, damping=0.0, **keys))
    bodies = "".join(f'[[body]]\nname = "{name}"\nlink = "{name}.toml"\n' for name in ("first", "second"))
    expected = [[0.80563, 0.07046, -0.51826], [-0.58051, -0.05216, -0.81280]]
    np.testing.assert_allclose(fallen(tmp_path, ffrobot, bodies), expected, rtol=0, atol=1e-4)


def test_slanted_double_pendulum_of_rigid_links(tmp_path, ffrobot):
    """The same of rigid bars: MuJoCo's tip, by its method of Runge and Kutta."""
    along, across = 0.54 * 0.02**2 / 6, 0.54 * (0.5**2 + 0.02**2) / 12
    bodies = "".join(RIGID.format(name=name, along=along, across=across) for name in ("first", "second"))
    expected = [[0.79823124, 0.10313258, -0.49905709], [-0.64873297, 0.08379688, -0.69880379]]
    np.testing.assert_allclose(fallen(tmp_path, ffrobot, bodies), expected, rtol=0, atol=2e-6)


SHAFT = """
name = "shaft"
space = "spatial"
gravity = [0.0, 0.0, 0.0]
[[body]]
name = "shaft"
link = "shaft.toml"
[[analysis]]
name = "unused"
kind = "static"
"""


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
        return required_forces(model, state, np.zeros(n))[:, node.p_v].T

    K, D, M = ((forces(k, h) - forces(k, -h)) / (2 * h) for k, h in enumerate((1e-3, 1.0, 1.0)))
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    s = np.linalg.eigvals(A)
    assert np.abs(s.real).max() < 1e-6 * np.abs(s).max()
    return np.sort(s.imag[s.imag > 0])


@pytest.mark.parametrize("stiffening", [True, False])
def test_spinning_shaft_whirls_forward_and_backward(stiffening, tmp_path):
    """Pins, gyroscopic moments: ω² ∓ 2λω₀ω − ω₀² = 0, λ = ½ΩI_x/√(EIρS) (Code_Aster V2.02.141), seen from the shaft.

    With the rotary inertia of tilting sections, κ = r²k²/(1 + r²k²) of the mass (r radius of inertia, k = π/L), λω₀ is
    κΩ. Sections that tilt by ψ keep their height in u = x + Φp: what they lose in ψ², geometric stiffening gives back;
    without it κΩ² is missing in ω₀². The split is what gyroscopic moments make.
    """
    diameter, length, Omega = 0.02, 1.0, 3000.0
    text = LINK.format(
        name="shaft", E="2e11", length=length, section=f'{{ shape = "circle", diameter = {diameter} }}', damping=0.0,
        condition="simply-supported", modes='count = 2\nfamily = ["in-plane-bending", "out-of-plane-bending"]',
    )  # fmt: skip
    text = text.replace("[mesh]", '[model]\ntheory = "timoshenko"\n[mesh]').replace("elements = 20", "elements = 40")
    (tmp_path / "shaft.toml").write_text(text)
    (tmp_path / "scene.toml").write_text(f"geometric_stiffening = {str(stiffening).lower()}\n{SHAFT}")
    scene = load_scene(tmp_path / "scene.toml")
    model = build_model(scene, [body.spatial for body in load_bodies(scene, lambda _: None)])
    omega_0 = whirling(model, 0.0).mean()
    r_k = diameter / 4 * np.pi / length
    kappa = r_k**2 / (1 + r_k**2)
    mean = np.sqrt(omega_0**2 + (kappa * Omega) ** 2 - (0.0 if stiffening else kappa * Omega**2))
    forward, backward = mean + kappa * Omega, mean - kappa * Omega
    found = whirling(model, Omega)
    np.testing.assert_allclose(found, [Omega - forward, Omega + backward], rtol=2e-6)
    split = 2 * Omega - found.sum()
    np.testing.assert_allclose(split, forward - backward, rtol=2e-3)


FREE = """
name = "free"
space = "spatial"
gravity = [0.0, 0.0, 0.0]
[[body]]
name = "body"
link = "body.toml"
[[joint]]
name = "floats"
type = "free"
between = ["ground", "body.root"]
[[load]]
point = "body.tip"
y = "where(t < 1, 3e-3*sin(pi*t)**4, 0)"
z = "where(t < 1, 6e-3*sin(pi*t)**4, 0)"
[initial]
joint_rates = { floats = [0.1, -0.2, 0.05, 0.3, 1.1, 0.7] }
[[analysis]]
name = "drift"
kind = "forward"
end = 100.0
output_step = 0.5
tolerance = 1e-9
"""


def test_free_flexible_body_keeps_momentum_and_energy_for_100_s(tmp_path, ffrobot):
    """A soft bar that tumbles and bends in both planes: after a push nothing acts on it and nothing damps it."""
    modes = 'count = 4\nfamily = ["in-plane-bending", "out-of-plane-bending"]'
    section = '{ shape = "rectangle", height = 0.004, width = 0.006 }'
    link = LINK.format(
        name="body", E="0.2e9", length=1.0, section=section, condition="cantilever", modes=modes, damping=0.0
    )
    (tmp_path / "body.toml").write_text(link)
    (tmp_path / "scene.toml").write_text(FREE)
    with solved(ffrobot, tmp_path / "scene.toml") as file:
        group = file["drift"]
        after = group["time"][()] >= 1.0
        strain = group["energy/strain"][after]
        energy = group["energy/kinetic"][after] + strain
        assert np.ptp(strain) > 1e-4 * energy[0]
        np.testing.assert_allclose(energy, energy[0], rtol=1e-6)
        for kind in ("linear", "angular"):
            H = group[f"momentum/{kind}"][after]
            np.testing.assert_allclose(H, np.tile(H[0], (len(H), 1)), atol=1e-6 * np.abs(H).max())


def test_rod_that_spins_is_stretched(tmp_path):
    """About its root at Ω: u = sin αL/(α cos αL) − L at its tip, α² = ρΩ²/E (Code_Aster V3.04.105), by axial modes."""
    E, density, length, Omega = 7e9, 2700.0, 1.0, 500.0
    text = LINK.format(
        name="shaft", E=E, length=length, section=BAR, damping=0.0, condition="cantilever",
        modes='count = 8\nfamily = "axial"',
    )  # fmt: skip
    (tmp_path / "shaft.toml").write_text(text.replace("elements = 20", "elements = 80"))
    (tmp_path / "scene.toml").write_text(SHAFT)
    scene = load_scene(tmp_path / "scene.toml")
    model = build_model(scene, [body.spatial for body in load_bodies(scene, lambda _: None)])
    (node,) = model.tree.nodes
    n, step = node.body.n_modes, 1e-3
    q, v, a = np.tile(model.tree.at_rest({}), (n + 1, 1)), *np.zeros((2, n + 1, model.tree.n_v))
    v[:, node.v] = [0.0, 0.0, 0.0, 0.0, 0.0, Omega]
    q[1:, node.p_q] = step * np.eye(n)
    a[:, node.v] = 0.0
    state = KnownStates(q, v, a)
    forces = required_forces(model, state, np.zeros(n + 1))[:, node.p_v]
    K = (forces[1:] - forces[0]).T / step  # forces on modes are affine in p
    p = np.linalg.solve(K, -forces[0])
    alpha = Omega * np.sqrt(density / E)
    expected = np.tan(alpha * length) / alpha - length
    stretched = float(node.body.points["tip"].translation[0] @ p)
    np.testing.assert_allclose(stretched, expected, rtol=2e-4)
    assert expected > 1.01 * density * Omega**2 * length**3 / (3 * E)  # more than of the load at rest
