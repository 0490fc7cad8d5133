"""Geometric stiffness of beams that bend, twist and stretch, against kinematics integrated without expansion."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ffrobot.fe_models.beam.invariants import geometric_stiffness
from ffrobot.fe_models.beam.line import lagrange
from ffrobot.fe_models.link_file import read_link
from ffrobot.fe_models.modal_body.unit_loads import unit_load_names

L, RHO = 0.8, 3100.0
LINK = """name = "rod"
material = {{ youngs_modulus = 7e10, poissons_ratio = 0.3, density = 3100.0 }}
model = {{ theory = "{theory}" }}
reference = {{ condition = "{condition}" }}
modes = {{ family = "all", count = 4 }}
mesh = {{ elements = 4 }}
[geometry]
kind = "beam"
length = 0.8
segment = [
  {{ until = 0.4, section = {{ shape = "rectangle", height = 0.012, width = 0.02 }} }},
  {{ until = 0.8, section = {{ shape = "rectangle", height = 0.009, width = 0.015 }} }},
]
[[interface]]
name = "grip"
position = 0.6
"""
PLACES = {"root": 0.0, "grip": 0.6, "tip": 0.8}


def link_of(tmp_path, theory="euler-bernoulli", condition="cantilever"):
    path = tmp_path / "rod.toml"
    path.write_text(LINK.format(theory=theory, condition=condition))
    return read_link(path)


@dataclass
class Shapes:
    """Polynomials in x/L, ascending (rows, degree, n): u, φ, and two deflections with their sections' rotations."""

    coefficients: np.ndarray

    def at(self, x, derivative=0):
        s = np.asarray(x) / L
        rows = self.coefficients
        for _ in range(derivative):
            rows = rows[:, 1:] * np.arange(1, rows.shape[1])[:, None] / L
        return np.einsum("rdn,xd->rxn", rows, s[:, None] ** np.arange(rows.shape[1]))


def shapes_of(theory, condition):
    """Rows U_X … R_Z of random motions that their supports allow, each of all families."""
    rng, n = np.random.default_rng(36), 3
    c = np.zeros((6, 4, n))
    c[0, 1:], c[3, 1:] = rng.normal(size=(2, 3, n))
    for across, rotation, sign in ((1, 5, 1.0), (2, 4, -1.0)):
        c[across, 2:] = rng.normal(size=(2, n))
        if condition == "simply-supported":
            c[across, 1] = -c[across, 2:].sum(axis=0)
        slope = c[across, 1:] * np.arange(1, 4)[:, None] / L
        c[rotation, :3] = sign * slope
        if theory == "timoshenko":  # sections turn less than the axis does
            c[rotation, (1 if condition == "cantilever" else 0) : 3] += 0.3 * rng.normal(size=n)
    return Shapes(c)


def moved(shapes, p, condition, x):
    """Position (x, 3) and rotation vector (x, 3) at equidistant x, of curvatures and strains that p causes exactly.

    Fourth-order steps of R' = R k~ (Magnus), r' = R (e1 + Γ), with three values of R within each.
    """
    h = x[1] - x[0]
    nodes = np.array([0.0, 0.5, 1.0])
    inner = (x[:-1, None] + h * nodes).ravel()
    k = (shapes.at(inner, 1)[3:] @ p).T.reshape(-1, 3, 3)
    values, slopes = shapes.at(inner) @ p, shapes.at(inner, 1) @ p
    strain = np.array([1 + slopes[0], slopes[1] - values[5], slopes[2] + values[4]]).T.reshape(-1, 3, 3)
    R, r = Rotation.from_rotvec(shapes.at([0.0])[3:, 0] @ p), np.zeros(3)
    rotations, positions = [R], [r]
    for of_k, of_strain in zip(k, strain, strict=True):
        k0, k1, k2 = of_k
        quarter = (5 * k0 + 8 * k1 - k2) / 24
        half = Rotation.from_rotvec(h * (quarter + h * np.cross(quarter, k1) / 12))
        whole = Rotation.from_rotvec(h * ((k0 + 4 * k1 + k2) / 6 + h * np.cross(k0, k2) / 12))
        here = [R, R * half, R * whole]
        r = r + h / 6 * sum(w * at.apply(e) for w, at, e in zip((1, 4, 1), here, of_strain, strict=True))
        R = here[2]
        rotations.append(R)
        positions.append(r)
    r, R = np.array(positions), Rotation.concatenate(rotations)
    if condition == "simply-supported":  # the tip on the axis, and no twist at the root
        y, z = np.arctan2(r[-1, 1], r[-1, 0]), 0.0
        turn = Rotation.from_rotvec([0, 0, -y])
        z = np.arctan2(turn.apply(r[-1])[2], turn.apply(r[-1])[0])
        turn = Rotation.from_rotvec([0, z, 0]) * turn
        for _ in range(20):
            turn = Rotation.from_rotvec([-(turn * R[0]).as_rotvec()[0], 0, 0]) * turn
        r, R = turn.apply(r), turn * R
    return r, R.as_rotvec()


def second_order(shapes, p, condition, x, eps=2e-3):
    """Parts of position and rotation vector that are quadratic in p, by differences, without their error in ε²."""

    def difference(e):
        pairs = [moved(shapes, s * e * p, condition, x) for s in (1.0, -1.0)]
        rest = np.stack([x, 0 * x, 0 * x], axis=1)
        return [(a + b - 2 * c) / (2 * e**2) for a, b, c in zip(*pairs, (rest, 0.0), strict=True)]

    return [(4 * fine - coarse) / 3 for fine, coarse in zip(difference(eps / 2), difference(eps), strict=True)]


def works(shapes, p, theory, condition, x):
    """What each unit load does work on in second order, −½ pᵀKp, by sums over the points of the rod."""
    sections = [(0.012, 0.02), (0.009, 0.015)]
    r, psi = second_order(shapes, p, condition, x)
    phi = (shapes.at(x)[3:] @ p).T
    turned = lambda d: np.cross(psi, d) + 0.5 * np.cross(phi, np.cross(phi, d))  # noqa: E731
    found = {}
    for name, place in PLACES.items():
        at = int(np.argmin(np.abs(x - place)))
        found |= dict(zip([f"force/{name}/{a}" for a in "xyz"], r[at], strict=True))
        found |= dict(zip([f"moment/{name}/{a}" for a in "xyz"], psi[at], strict=True))
    weight = np.full(len(x), x[1] - x[0]) * np.where(np.arange(len(x)) % 2, 4, 2) / 3
    weight[[0, -1]] /= 2
    points = []  # ∫ρ over the section: the axis, and where rotary inertia counts two pairs of points
    middle = np.argmin(np.abs(x - 0.4))
    for part, (h, w) in zip((slice(0, middle + 1), slice(middle, None)), sections, strict=True):
        of_part = weight[part].copy()
        if part.start:
            of_part[0] = weight[0]
        else:
            of_part[-1] = weight[0]
        places = [(np.zeros(3), 1.0)]
        if theory == "timoshenko":
            arms = np.eye(3)[1:] * np.array([[h], [w]]) / np.sqrt(12)
            places = [(s * 2**0.5 * arm, 0.25) for arm in arms for s in (1, -1)]
        for d, share in places:
            position = np.stack([x[part], 0 * x[part] + d[1], 0 * x[part] + d[2]], axis=1)
            points.append((RHO * h * w * share * of_part, position, r[part] + turned(d)[part]))
    e = np.eye(3)
    for m, X, u in points:
        forces = {f"t_{a}": np.broadcast_to(-e[i], X.shape) for i, a in enumerate("xyz")}
        forces |= {f"r_{a}": -np.cross(e[i], X) for i, a in enumerate("xyz")}
        for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
            once = -np.cross(e[i], np.cross(e[j], X))
            other = 0 if i == j else -np.cross(e[j], np.cross(e[i], X))
            forces[f"omega_{'xyz'[i]}{'xyz'[j]}"] = once + other
        for load, f in forces.items():
            found[load] = found.get(load, 0.0) + np.einsum("x,xi,xi->", m, f, u)
    return found


@pytest.mark.parametrize("condition", ["cantilever", "simply-supported"])
@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
def test_work_of_every_load_is_that_on_the_exact_motion(tmp_path, theory, condition):
    """Forces, moments and inertia at a bent, twisted and stretched rod of two sections, rotated without expansion."""
    link = link_of(tmp_path, theory, condition)
    stations = lagrange(np.linspace(0.0, L, 5), 3)
    shapes = shapes_of(theory, condition)
    matrices = geometric_stiffness(link, stations, shapes.at(stations.x), PLACES)
    K = dict(zip(unit_load_names(PLACES), matrices, strict=True))
    x = np.linspace(0.0, L, 161)
    for p in np.random.default_rng(1).normal(size=(2, 3)):
        expected = works(shapes, p, theory, condition, x)
        for load, work in expected.items():
            scale = max(abs(w) for name, w in expected.items() if name.split("/")[0] == load.split("/")[0])
            assert -0.5 * p @ K[load] @ p == pytest.approx(work, rel=2e-5, abs=2e-6 * scale), load
