"""Natural frequencies and compliance with the joints locked: closed forms of beams, gears and pendulums."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from strip_link import LINK

from ffrobot import solve
from ffrobot.mbs.solve.poses import PoseEvaluator
from ffrobot.mbs.solve.start import undeformed_posture
from ffrobot.run.solve import prepare_scene

E, NU, RHO, HEIGHT, WIDTH = 70e9, 0.3, 2700.0, 0.02, 0.03
G = E / (2 * (1 + NU))
GEAR = 3000.0  # N·m/rad


def write(folder, scene, **links):
    """The results of a scene with these links: by name length, number of modes, families."""
    for name, (length, count, family) in links.items():
        text = LINK.format(name=name, length=length, elements=20, count=count, family=family)
        (folder / f"{name}.toml").write_text(text)
    path = folder / "scene.toml"
    path.write_text(scene)
    return solve(path)


def bodies_and_joints(names, axes, **keys):
    """A chain of links along x, each on a motor about one of the axes."""
    more = "".join(f"{key} = {value}\n" for key, value in keys.items())
    text, before = "", ("ground", [0.0, 0.0, 0.0])
    for name, axis in zip(names, axes, strict=True):
        at = "at = [0.0, 0.0, 0.0]\n" if before[0] == "ground" else ""
        text += f'[[body]]\nname = "{name}"\nlink = "{name}.toml"\n'
        text += f'[[joint]]\nname = "to_{name}"\ntype = "revolute"\nbetween = ["{before[0]}", "{name}.root"]\n{at}'
        text += f"axis = {axis}\nrotor_inertia = 1e-4\ngear_ratio = 50.0\n{more}"
        before = (f"{name}.tip", None)
    return text


def of_beam(length):
    """(6, 6) compliance of the tip of a clamped beam along x, bending about z over its height."""
    found = np.zeros((6, 6))
    n, A = np.arange(1, 60, 2), HEIGHT * WIDTH
    series = np.sum(np.tanh(n * np.pi * WIDTH / (2 * HEIGHT)) / n**5)
    torsion = WIDTH * HEIGHT**3 * (1 / 3 - 64 / np.pi**5 * HEIGHT / WIDTH * series)  # Saint-Venant
    found[0, 0], found[3, 3] = length / (E * A), length / (G * torsion)
    for i, j, sign, inertia in ((1, 5, 1.0, WIDTH * HEIGHT**3 / 12), (2, 4, -1.0, HEIGHT * WIDTH**3 / 12)):
        found[i, i], found[j, j] = length**3 / (3 * E * inertia), length / (E * inertia)
        found[i, j] = found[j, i] = sign * length**2 / (2 * E * inertia)
    return found


def test_a_beam_with_a_load_behind_a_gear(tmp_path):
    """Compliance by the static shape; frequency by the characteristic equation of a cantilever with a tip mass."""
    mass = 1.0
    scene = 'name = "one"\nspace = "planar"\ngravity = [0.0, 0.0]\n'
    scene += '[[body]]\nname = "arm"\nlink = "arm.toml"\n'
    scene += '[[joint]]\nname = "hub"\ntype = "revolute"\nbetween = ["ground", "arm.root"]\nrotor_inertia = 6e-5\n'
    scene += f"gear_ratio = 100.0\nstiffness = {GEAR}\n"
    scene += f'[[payload]]\npoint = "arm.tip"\nmass = {mass}\n'
    scene += '[[analysis]]\nname = "rest"\nkind = "static"\n[[analysis]]\nname = "linear"\nkind = "linear"\n'
    EI, L, rho_A = E * WIDTH * HEIGHT**3 / 12, 1.0, RHO * HEIGHT * WIDTH
    bending = np.array([[L**3 / 3, L**2 / 2], [L**2 / 2, L]]) / EI
    gear = np.array([[L * L, L], [L, 1.0]]) / GEAR

    def characteristic(b):
        rest = np.cos(b) * np.sinh(b) - np.sin(b) * np.cosh(b)
        return 1 + np.cos(b) * np.cosh(b) + mass / (rho_A * L) * b * rest

    first = brentq(characteristic, 0.5, 1.8, xtol=1e-14) ** 2 * np.sqrt(EI / (rho_A * L**4)) / (2 * np.pi)
    with write(tmp_path, scene, arm=(L, 8, '"in-plane-bending"')) as results:
        for analysis in ("rest", "linear"):
            locked, geared = (
                results[f"{analysis}/joints_{name}/compliance/arm.tip"][0] for name in ("locked", "compliant")
            )
            np.testing.assert_allclose(locked[1:, 1:], bending, rtol=1e-9)
            np.testing.assert_allclose(geared[1:, 1:], bending + gear, rtol=1e-9)
            np.testing.assert_allclose(results[f"{analysis}/joints_locked/frequency"][0, 0], first, rtol=1e-6)
        shape = results["rest/joints_locked/modes/arm/modal"][0]
        assert shape.shape[0] == results["rest/joints_locked/frequency"].shape[1]


def test_compliance_of_a_chain_in_space(tmp_path):
    """That of each beam and gear, carried to the tool as rigid motion: C = Σ Xᵢ Cᵢ Xᵢᵀ + Σ aⱼ aⱼᵀ / kⱼ."""
    names, axes = ("a", "b", "c"), ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
    lengths, angles = {"a": 0.7, "b": 0.5, "c": 0.4}, (0.4, -0.7, 0.9)
    scene = 'name = "chain"\nspace = "spatial"\ngravity = [0.0, 0.0, 0.0]\n'
    scene += bodies_and_joints(names, axes, stiffness=GEAR)
    start = ", ".join(f"to_{name} = {angle}" for name, angle in zip(names, angles, strict=True))
    scene += f"[initial]\njoints = {{ {start} }}\n"
    scene += '[[analysis]]\nname = "rest"\nkind = "static"\npoints = ["c.tip"]\n'
    R, place, frames = np.eye(3), np.zeros(3), []
    for name, axis, angle in zip(names, axes, angles, strict=True):
        root, R = place, R @ Rotation.from_rotvec(angle * np.array(axis)).as_matrix()
        place = root + R[:, 0] * lengths[name]
        frames.append((R, root, place, R @ axis))
    links, gears = np.zeros((6, 6)), np.zeros((6, 6))
    for name, (R, root, tip, axis) in zip(names, frames, strict=True):
        X = np.zeros((6, 6))
        X[:3, :3] = X[3:, 3:] = R
        X[:3, 3:] = np.column_stack([np.cross(turn, place - tip) for turn in R.T])
        links += X @ of_beam(lengths[name]) @ X.T
        a = np.concatenate([np.cross(axis, place - root), axis])
        gears += np.outer(a, a) / GEAR
    families = '["axial", "in-plane-bending", "out-of-plane-bending", "torsion"]'
    with write(tmp_path, scene, **{name: (lengths[name], 8, families) for name in names}) as results:
        locked, geared = (results[f"rest/joints_{name}/compliance/c.tip"][0] for name in ("locked", "compliant"))
    np.testing.assert_allclose(geared - locked, gears, atol=1e-8 * np.abs(gears).max())
    np.testing.assert_allclose(locked, links, atol=1e-7 * np.abs(links).max())


def test_a_pendulum_without_motors_hangs_on_its_weight(tmp_path):
    """Compliance and frequency of a rigid one: L²/(m g l), √(m g l / J)."""
    m, length, J = 2.0, 0.8, 0.1
    scene = 'name = "pendulum"\nspace = "planar"\ngravity = [0.0, -9.81]\n'
    scene += f'[[body]]\nname = "bob"\nrigid = {{ mass = {m}, center = [0.5, 0.0], inertia = {J}, '
    scene += f"points = {{ root = [0.0, 0.0], tip = [{length}, 0.0] }} }}\n"
    scene += '[[joint]]\nname = "pin"\ntype = "revolute"\nbetween = ["ground", "bob.root"]\nmotor = false\n'
    scene += '[initial]\nstate = "static"\nangles = { bob = -1.5 }\n[[analysis]]\nname = "rest"\nkind = "static"\n'
    with write(tmp_path, scene) as results:
        stiffness = m * 9.81 * 0.5
        C, f = results["rest/joints_locked/compliance/bob.tip"][0], results["rest/joints_locked/frequency"][0]
    np.testing.assert_allclose(C[0, 0], length**2 / stiffness, rtol=1e-9)
    np.testing.assert_allclose(f, [np.sqrt(stiffness / (J + m * 0.25)) / (2 * np.pi)], rtol=1e-9)


def test_a_free_joint_without_motor_has_no_stiffness(tmp_path):
    scene = 'name = "free"\nspace = "planar"\ngravity = [0.0, 0.0]\n[[body]]\nname = "bob"\n'
    scene += "rigid = { mass = 2.0, center = [0.5, 0.0], inertia = 0.1, "
    scene += "points = { root = [0.0, 0.0], tip = [0.8, 0.0] } }\n"
    scene += '[[joint]]\nname = "pin"\ntype = "revolute"\nbetween = ["ground", "bob.root"]\nmotor = false\n'
    scene += '[[analysis]]\nname = "rest"\nkind = "static"\n'
    with write(tmp_path, scene) as results:
        assert np.isinf(results["rest/joints_locked/compliance/bob.tip"][0]).all()
        assert results["rest/joints_locked/frequency"][0] == pytest.approx([0.0])


def test_frequencies_of_a_rigid_arm_of_six_axes_on_compliant_gears(tmp_path):
    """M = Σ m JᵥᵀJᵥ + JωᵀI Jω of the links assembled here, K of the gears: rotors stand still, gravity is off."""
    rng = np.random.default_rng(6)
    axes = np.eye(3)[[2, 1, 1, 0, 1, 0]]
    offsets, angles = rng.uniform(-0.3, 0.5, (6, 3)), rng.uniform(-1.2, 1.2, 6)
    masses, centers = rng.uniform(1.0, 6.0, 6), rng.uniform(-0.1, 0.2, (6, 3))
    stiffness, inertias = rng.uniform(2e3, 3e4, 6), []
    scene, before = 'name = "six"\nspace = "spatial"\ngravity = [0.0, 0.0, 0.0]\n', "ground"
    for k in range(6):
        turn = Rotation.random(random_state=k).as_matrix()
        inertias.append(turn @ np.diag(masses[k] * np.array([2e-3, 3e-3, 4e-3])) @ turn.T)
        rows = inertias[k].tolist()
        scene += f'[[body]]\nname = "b{k}"\nrigid = {{ mass = {masses[k]!r}, center = {centers[k].tolist()}, '
        scene += f"inertia = {rows}, points = {{ root = [0.0, 0.0, 0.0], tip = {offsets[k].tolist()} }} }}\n"
        scene += f'[[joint]]\nname = "j{k}"\ntype = "revolute"\nbetween = ["{before}", "b{k}.root"]\n'
        scene += f"axis = {axes[k].tolist()}\ngear_ratio = 80.0\nrotor_inertia = 3e-5\nstiffness = {stiffness[k]!r}\n"
        before = f"b{k}.tip"
    start = ", ".join(f"j{k} = {angle!r}" for k, angle in enumerate(angles.tolist()))
    scene += f'[initial]\njoints = {{ {start} }}\n[[analysis]]\nname = "rest"\nkind = "static"\npoints = ["b5.tip"]\n'
    R, place, joints, M = np.eye(3), np.zeros(3), [], np.zeros((6, 6))
    for k in range(6):
        axis = R @ axes[k]
        R = R @ Rotation.from_rotvec(angles[k] * axes[k]).as_matrix()
        joints.append((place, axis))
        center, inertia = place + R @ centers[k], R @ inertias[k] @ R.T
        J_v, J_w = np.zeros((3, 6)), np.zeros((3, 6))
        for i, (at, about) in enumerate(joints):
            J_v[:, i], J_w[:, i] = np.cross(about, center - at), about
        carrier = axis @ J_w - np.eye(6)[k]  # the rotor turns with the body before, about its own axis, too
        M += masses[k] * J_v.T @ J_v + J_w.T @ inertia @ J_w + 3e-5 * np.outer(carrier, carrier)
        place = place + R @ offsets[k]
    J = np.array([np.concatenate([np.cross(about, place - at), about]) for at, about in joints]).T
    expected = np.sqrt(eigh(np.diag(stiffness), M, eigvals_only=True)) / (2 * np.pi)
    with write(tmp_path, scene) as results:
        np.testing.assert_allclose(results["rest/joints_compliant/frequency"][0], expected, rtol=1e-10)
        C = results["rest/joints_compliant/compliance/b5.tip"][0]
        assert results["rest/joints_locked/frequency"].shape == (1, 0)
    np.testing.assert_allclose(C, J @ np.diag(1 / stiffness) @ J.T, atol=1e-10 * np.abs(C).max())


STRIP = """name = "{name}"
material = {{ youngs_modulus = 2.4e11, density = 4000.0 }}
geometry = {{ kind = "beam", length = {length}, section = {{ shape = "rectangle", height = 0.001, width = 0.05 }} }}
mesh = {{ elements = {elements} }}
reference = {{ condition = "cantilever" }}
modes = {{ count = {count}, family = "in-plane-bending", attachment_modes = {attachment} }}
damping = {{ ratio = {damping} }}
"""  # EI = 1 N·m², ρA = 0.2 kg/m


def strip(folder, name, length, elements, count, damping=0.0, attachment="true"):
    text = STRIP.format(
        name=name, length=length, elements=elements, count=count, damping=damping, attachment=attachment
    )
    (folder / f"{name}.toml").write_text(text)


@pytest.mark.parametrize(
    ("mass", "inertia", "published"), [(1.2, 0.1 + 0.1 * 0.25 / 3 + 0.0005 + 0.1 * 0.25, [0.48, 1.80]),
                                       (0.1, 0.0005, [2.18, 15.91])]
)  # fmt: skip
def test_published_frequencies_of_a_two_link_arm(tmp_path, mass, inertia, published):
    """De Luca and Siciliano (1991), IEEE Trans. Syst. Man Cybern. 21(4): links of 0.5 m, 0.2 kg/m, EI = 1 N·m².

    The first link carries hub, second link and payload (1.2 kg; inertia of the stretched link about the joint), the
    second one the payload. The paper has two decimals.
    """
    strip(tmp_path, "arm", 0.5, 20, 6)
    scene = 'name = "one"\nspace = "planar"\ngravity = [0.0, 0.0]\n[[body]]\nname = "arm"\nlink = "arm.toml"\n'
    scene += '[[body]]\nname = "hub"\n'
    scene += (
        f"rigid = {{ mass = {mass}, inertia = {inertia}, center = [0.0, 0.0], points = {{ root = [0.0, 0.0] }} }}\n"
    )
    scene += '[[joint]]\nname = "O"\ntype = "revolute"\nbetween = ["ground", "arm.root"]\n'
    scene += '[[joint]]\nname = "w"\ntype = "weld"\nbetween = ["arm.tip", "hub.root"]\n'
    scene += '[[analysis]]\nname = "rest"\nkind = "static"\npoints = ["arm.tip"]\n'
    with write(tmp_path, scene) as results:
        found = results["rest/joints_locked/frequency"][0, :2]
    np.testing.assert_allclose(found, published, atol=0.0051)


def beam_matrices(length, elements):
    """K and M (2 e + 2) of Hermite elements with EI = 1, ρA = 0.2, and ∫ρA w, ∫ρA x w; deflection and slope by node."""
    h, n = length / elements, 2 * elements + 2
    K, M, sums, moments = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n), np.zeros(n)
    k = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h], [-12, -6 * h, 12, -6 * h],
                  [6 * h, 2 * h * h, -6 * h, 4 * h * h]]) / h**3  # fmt: skip
    at, weights = np.polynomial.legendre.leggauss(5)
    for e in range(elements):
        place = slice(2 * e, 2 * e + 4)
        K[place, place] += k
        for s, weight in zip((at + 1) / 2, weights * h / 2 * 0.2, strict=True):
            N = np.array([1 - 3 * s**2 + 2 * s**3, h * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, h * (s**3 - s**2)])
            M[place, place] += weight * np.outer(N, N)
            sums[place] += weight * N
            moments[place] += weight * (e + s) * h * N
    return K[2:, 2:], M[2:, 2:], sums[2:], moments[2:]


def test_frequencies_and_compliance_of_two_links_against_an_assembly_to_1e_8(tmp_path):
    """Links at an angle, a payload, gears: Hermite beams, clamped at their roots, assembled here; all modes are kept.

    ṙ = n₁ ẇ₁(L₁) + (φ̇₁ + γ̇₂)(x n₂) + n₂ ẇ₂(x), with φ₁ the slope at the tip of the first link and γ the twist of gears.
    """
    L1, L2, elements, turn, mass, rotor, gear = 0.5, 0.4, 4, 0.8, 0.3, 1e-5, 4.0
    for name, length in (("a", L1), ("b", L2)):
        strip(tmp_path, name, length, elements, 2 * elements, attachment="false")
    scene = 'name = "two"\nspace = "planar"\ngravity = [0.0, 0.0]\n'
    for name, before in (("a", "ground"), ("b", "a.tip")):
        scene += f'[[body]]\nname = "{name}"\nlink = "{name}.toml"\n[[joint]]\nname = "to_{name}"\ntype = "revolute"\n'
        scene += (
            f'between = ["{before}", "{name}.root"]\nstiffness = {gear}\nrotor_inertia = {rotor}\ngear_ratio = 10.0\n'
        )
    scene += f'[initial]\njoints = {{ to_b = {turn} }}\n[[payload]]\npoint = "b.tip"\nmass = {mass}\n'
    scene += '[[analysis]]\nname = "rest"\nkind = "static"\npoints = ["b.tip"]\n'
    (K1, M1, _, m1), (K2, M2, s2, m2) = (beam_matrices(length, elements) for length in (L1, L2))
    n, c, s = 2 * elements, np.cos(turn), np.sin(turn)
    K, M = np.zeros((2 * n + 2, 2 * n + 2)), np.zeros((2 * n + 2, 2 * n + 2))  # of w₁, w₂, γ₁, γ₂
    one, two, g1, g2 = slice(0, n), slice(n, 2 * n), 2 * n, 2 * n + 1
    K[one, one], K[two, two], K[g1, g1], K[g2, g2] = K1, K2, gear, gear
    M[one, one] += M1
    M[one, g1] = M[g1, one] = m1
    M[g1, g1] += 0.2 * L1**3 / 3
    tip, slope, along, bent = (np.zeros(2 * n + 2) for _ in range(4))
    tip[n - 2], tip[g1], slope[n - 1], slope[g1] = 1.0, L1, 1.0, 1.0
    spin = slope.copy()
    spin[g2] = 1.0
    M[two, two] += M2
    M += 0.2 * L2 * np.outer(tip, tip) + 0.2 * L2**3 / 3 * np.outer(spin, spin)
    M += 0.2 * L2**2 / 2 * c * (np.outer(tip, spin) + np.outer(spin, tip))
    along[two], bent[two] = s2, m2
    M += c * (np.outer(tip, along) + np.outer(along, tip)) + np.outer(spin, bent) + np.outer(bent, spin)
    end = np.array([np.zeros(2 * n + 2), tip])  # x, y of the tip of b, n₁ = (0, 1), n₂ = (−s, c)
    end += np.outer([-s, c], L2 * spin + np.eye(2 * n + 2)[2 * n - 2])
    M += mass * end.T @ end + rotor * np.outer(slope, slope)
    with write(tmp_path, scene) as results:
        for condition, kept in (("locked", slice(0, 2 * n)), ("compliant", slice(0, 2 * n + 2))):
            expected = np.sqrt(eigh(K[kept, kept], M[kept, kept], eigvals_only=True)) / (2 * np.pi)
            found = results[f"rest/joints_{condition}/frequency"][0]
            np.testing.assert_allclose(found, expected, rtol=1e-8)
            J = end[:, kept]
            C = results[f"rest/joints_{condition}/compliance/b.tip"][0][:2, :2]
            exact = J @ np.linalg.solve(K[kept, kept], J.T)
            np.testing.assert_allclose(C, exact, atol=1e-8 * np.abs(exact).max())


@pytest.mark.parametrize(("condition", "frequency"), [("locked", 1.0), ("locked", 4.0), ("compliant", 1.0)])
def test_frequency_response_against_time_integration(tmp_path, condition, frequency):
    """A small oscillating force at the tip; after the transient the amplitude of the tip is |H|."""
    strip(tmp_path, "arm", 0.5, 10, 3, damping=0.2)
    path = "motor" if condition == "compliant" else "joint"
    gear = "stiffness = 4.0\ndamping = 0.5\nrotor_inertia = 1e-5\ngear_ratio = 10.0\n" * (condition == "compliant")
    omega, force = 2 * np.pi * frequency, 1e-4
    scene = 'name = "one"\nspace = "planar"\ngravity = [0.0, 0.0]\n[[body]]\nname = "arm"\nlink = "arm.toml"\n'
    scene += f'[[joint]]\nname = "O"\ntype = "revolute"\nbetween = ["ground", "arm.root"]\n{gear}'
    scene += '[[payload]]\npoint = "arm.tip"\nmass = 0.1\n'
    scene += f'[[load]]\npoint = "arm.tip"\ny = "{force}*sin({omega}*t)"\n'
    scene += f'[[trajectory]]\nname = "held"\n{path} = "O"\nvalue = "0"\n'
    scene += '[[analysis]]\nname = "shaken"\nkind = "pcid"\nend = 12.0\noutput_step = 0.01\ntolerance = 1e-8\n'
    with write(tmp_path, scene) as results:
        time, y = results["shaken/time"], results["shaken/points/arm.tip/position"][:, 1]
    model = prepare_scene(tmp_path / "scene.toml").model
    found = PoseEvaluator(model, undeformed_posture(model).q, "arm.tip", count=1, omega=np.array([omega]))
    expected = found.at(undeformed_posture(model).q)[f"joints_{condition}/response"][0, 1]
    late = time > 10.0
    waves = np.column_stack([np.sin(omega * time), np.cos(omega * time)])[late]
    amplitude = np.linalg.norm(np.linalg.lstsq(waves, y[late], rcond=None)[0]) / force
    assert amplitude == pytest.approx(expected, rel=1e-5)
