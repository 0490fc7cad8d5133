"""Natural frequencies and compliance with the joints locked: closed forms of beams, gears and pendulums."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from ffrobot import solve

E, NU, RHO, HEIGHT, WIDTH = 70e9, 0.3, 2700.0, 0.02, 0.03
G = E / (2 * (1 + NU))
GEAR = 3000.0  # N·m/rad

LINK = """name = "{name}"
[material]
youngs_modulus = 70e9
poissons_ratio = 0.3
density = 2700.0
[geometry]
kind = "beam"
length = {length}
section = {{ shape = "rectangle", height = 0.02, width = 0.03 }}
[mesh]
elements = 20
[reference]
condition = "cantilever"
[modes]
count = {count}
family = {family}
"""


def write(folder, scene, **links):
    """The results of a scene with these links: by name length, number of modes, families."""
    for name, (length, count, family) in links.items():
        text = LINK.format(name=name, length=length, count=count, family=family)
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
