"""Natural frequencies and compliance with the joints locked: closed forms of beams, gears and pendulums."""

from itertools import product

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from exact_rod import torsion_constant
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation
from tables_3d import pin

from ffrobot import make_scene, solve
from ffrobot.mbs.linear.poses import PoseEvaluator
from ffrobot.mbs.posture.start import undeformed_posture
from ffrobot.run.solve import prepare_scene

E, NU, HEIGHT, WIDTH = 70e9, 0.3, 0.02, 0.03
G = E / (2 * (1 + NU))
GEAR = 3000.0  # N·m/rad


REST = {"name": "rest", "kind": "static"}
POINTS = {"root": [0.0, 0.0], "tip": [0.8, 0.0]}


def strip(length, family="in-plane-bending", count=8):
    return beam_link(length, rectangle(HEIGHT, WIDTH), 20, nu=NU, modes={"count": count, "family": family})


def scene(body, joint, **keys):
    """In no field of gravity; links or rigid bodies by name."""
    bodies = [{"name": name, "rigid" if "mass" in of_body else "link": of_body} for name, of_body in body.items()]
    keys = {"gravity": [0.0, 0.0], "analysis": [REST]} | keys
    return make_scene(name="robot", body=bodies, joint=joint, **keys)


def in_space(body, joint, **keys):
    return scene(body, joint, space="spatial", gravity=[0.0, 0.0, 0.0], **keys)


def of_beam(length):
    """(6, 6) compliance of the tip of a clamped beam along x, bending about z over its height."""
    found = np.zeros((6, 6))
    found[0, 0], found[3, 3] = length / (E * HEIGHT * WIDTH), length / (G * torsion_constant(HEIGHT, WIDTH))
    for i, j, sign, inertia in ((1, 5, 1.0, WIDTH * HEIGHT**3 / 12), (2, 4, -1.0, HEIGHT * WIDTH**3 / 12)):
        found[i, i], found[j, j] = length**3 / (3 * E * inertia), length / (E * inertia)
        found[i, j] = found[j, i] = sign * length**2 / (2 * E * inertia)
    return found


def test_compliance_of_a_chain_in_space():
    """That of each beam and gear, carried to the tool as rigid motion: C = Σ Xᵢ Cᵢ Xᵢᵀ + Σ aⱼ aⱼᵀ / kⱼ."""
    names, axes = ("a", "b", "c"), ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
    lengths, angles = {"a": 0.7, "b": 0.5, "c": 0.4}, (0.4, -0.7, 0.9)
    motor, ends = {"rotor_inertia": 1e-4, "gear_ratio": 50.0, "stiffness": GEAR}, ("ground", "a.tip", "b.tip")
    joints = [
        pin(f"to_{name}", end, f"{name}.root", axis=axis, **motor)
        for name, end, axis in zip(names, ends, axes, strict=True)
    ]
    families = ["axial", "in-plane-bending", "out-of-plane-bending", "torsion"]
    robot = in_space(
        {name: strip(length, families) for name, length in lengths.items()}, joints,
        initial={"joints": dict(zip(("to_a", "to_b", "to_c"), angles, strict=True))},
        analysis=[REST | {"points": ["c.tip"]}],
    )  # fmt: skip
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
    with solve(robot) as results:
        locked, geared = (results[f"rest/joints_{name}/compliance/c.tip"][0] for name in ("locked", "compliant"))
    np.testing.assert_allclose(geared - locked, gears, atol=1e-8 * np.abs(gears).max())
    np.testing.assert_allclose(locked, links, atol=1e-7 * np.abs(links).max())


def test_a_pendulum_without_motors_hangs_on_its_weight():
    """Compliance and frequency of a rigid one: L²/(m g l), √(m g l / J); without a weight there is no stiffness."""
    m, length, J = 2.0, 0.8, 0.1
    bob = {"mass": m, "center": [0.5, 0.0], "inertia": J, "points": POINTS}
    pivot, start = [pin("pin", "ground", "bob.root", motor=False)], {"state": "static", "angles": {"bob": -1.5}}
    with solve(scene({"bob": bob}, pivot)) as results:
        assert np.isinf(results["rest/joints_locked/compliance/bob.tip"][0]).all()
        assert results["rest/joints_locked/frequency"][0] == pytest.approx([0.0])
    with solve(scene({"bob": bob}, pivot, gravity=[0.0, -9.81], initial=start)) as results:
        stiffness = m * 9.81 * 0.5
        C, f = results["rest/joints_locked/compliance/bob.tip"][0], results["rest/joints_locked/frequency"][0]
    np.testing.assert_allclose(C[0, 0], length**2 / stiffness, rtol=1e-9)
    np.testing.assert_allclose(f, [np.sqrt(stiffness / (J + m * 0.25)) / (2 * np.pi)], rtol=1e-9)


def thin(length, elements, count, **keys):
    """EI = 1 N·m², ρA = 0.2 kg/m."""
    modes = {"count": count, "family": "in-plane-bending"} | keys.pop("modes", {})
    return beam_link(length, rectangle(0.001, 0.05), elements, E=2.4e11, nu=None, rho=4000.0, modes=modes, **keys)


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


def test_frequencies_and_compliance_of_two_links_against_an_assembly_to_1e_8():
    """Links at an angle, a payload, gears: Hermite beams, clamped at their roots, assembled here; all modes are kept.

    ṙ = n₁ ẇ₁(L₁) + (φ̇₁ + γ̇₂)(x n₂) + n₂ ẇ₂(x), with φ₁ the slope at the tip of the first link and γ the twist of gears.
    """
    L1, L2, elements, turn, mass, rotor, gear = 0.5, 0.4, 4, 0.8, 0.3, 1e-5, 4.0
    robot = scene(
        {name: thin(length, elements, 2 * elements, modes={"attachment_modes": False})
         for name, length in (("a", L1), ("b", L2))},
        [pin(f"to_{name}", before, f"{name}.root", stiffness=gear, rotor_inertia=rotor, gear_ratio=10.0)
         for name, before in (("a", "ground"), ("b", "a.tip"))],
        initial={"joints": {"to_b": turn}}, payload=[{"point": "b.tip", "mass": mass}],
        analysis=[REST | {"points": ["b.tip"]}, {"name": "linear", "kind": "linear", "points": ["b.tip"]}],
    )  # fmt: skip
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
    with solve(robot) as results:
        of_all = product(("rest", "linear"), (("locked", slice(0, 2 * n)), ("compliant", slice(0, 2 * n + 2))))
        for analysis, (condition, kept) in of_all:
            expected = np.sqrt(eigh(K[kept, kept], M[kept, kept], eigvals_only=True)) / (2 * np.pi)
            found = results[f"{analysis}/joints_{condition}/frequency"][0]
            np.testing.assert_allclose(found, expected, rtol=1e-8)
            J = end[:, kept]
            C = results[f"{analysis}/joints_{condition}/compliance/b.tip"][0][:2, :2]
            exact = J @ np.linalg.solve(K[kept, kept], J.T)
            np.testing.assert_allclose(C, exact, atol=1e-8 * np.abs(exact).max())


@pytest.mark.parametrize(("condition", "frequency"), [("locked", 4.0), ("compliant", 1.0)])
def test_frequency_response_against_time_integration(condition, frequency):
    """A small oscillating force at the tip; after the transient the amplitude of the tip is |H|."""
    path = "motor" if condition == "compliant" else "joint"
    gear = {"stiffness": 4.0, "damping": 0.5, "rotor_inertia": 1e-5, "gear_ratio": 10.0} if path == "motor" else {}
    omega, force = 2 * np.pi * frequency, 1e-4
    robot = scene(
        {"arm": thin(0.5, 10, 3, damping={"ratio": 0.2})}, [pin("O", "ground", "arm.root", **gear)],
        payload=[{"point": "arm.tip", "mass": 0.1}], load=[{"point": "arm.tip", "y": f"{force}*sin({omega}*t)"}],
        trajectory=[{"name": "held", path: "O", "value": "0"}],
        analysis=[{"name": "shaken", "kind": "pcid", "end": 9.0, "output_step": 0.01, "tolerance": 1e-8}],
    )  # fmt: skip
    with solve(robot) as results:
        time, y = results["shaken/time"], results["shaken/points/arm.tip/position"][:, 1]
    model = prepare_scene(robot).model
    found = PoseEvaluator(model, undeformed_posture(model).q, "arm.tip", count=1, omega=np.array([omega]))
    expected = found.at(undeformed_posture(model).q)[f"joints_{condition}/response"][0, 1]
    late = time > 7.0
    waves = np.column_stack([np.sin(omega * time), np.cos(omega * time)])[late]
    amplitude = np.linalg.norm(np.linalg.lstsq(waves, y[late], rcond=None)[0]) / force
    assert amplitude == pytest.approx(expected, rel=1e-5)
