"""Masses on interfaces: closed forms, and a cloud of material points."""

import numpy as np
import pytest
from scipy.optimize import brentq

from ffrobot.common.errors import InputError
from ffrobot.fe_models.link import make_link
from ffrobot.fe_models.modal_body import Interface
from ffrobot.fe_models.modal_body.lumped_masses import Lump, attached_integrals, loads_with_lumps

EI, RHO_A, L = 2.068427e11 * 0.025 * 0.015**3 / 12, 7850.0 * 0.015 * 0.025, 1.0


def attached(name="tip", mass=0.0, inertia=0.0, position=None):
    place = "" if position is None else f"position = {position}\n"
    return f'[[interface]]\nname = "{name}"\n{place}mass = {mass}\ninertia = [0.0, 0.0, {inertia}]\n'


@pytest.fixture
def body(link_file):
    return lambda **keys: make_link(link_file(**keys), force=True).body


def characteristic(beta, mass, inertia):
    """Of a cantilever with v = a (cosh − cos) + b (sinh − sin): EI v'' = ω²J v', EI v''' = −ω²m v at its tip."""
    C, c, S, s = np.cosh(beta), np.cos(beta), np.sinh(beta), np.sin(beta)
    omega2 = EI / RHO_A * beta**4
    moment = [EI * beta**2 * (C + c) - omega2 * inertia * beta * (S + s)]
    moment.append(EI * beta**2 * (S + s) - omega2 * inertia * beta * (C - c))
    shear = [EI * beta**3 * (S - s) + omega2 * mass * (C - c), EI * beta**3 * (C + c) + omega2 * mass * (S - s)]
    return moment[0] * shear[1] - moment[1] * shear[0]


@pytest.mark.parametrize(("mass", "inertia"), [(0.5, 0.0), (5.0, 0.0), (0.5, 0.02), (0.0, 0.02)])
def test_frequencies_of_a_cantilever_with_tip_mass(body, mass, inertia):
    betas = np.linspace(0.3, 9.0, 400)
    values = [characteristic(beta, mass, inertia) for beta in betas]
    roots = [
        brentq(characteristic, a, b, args=(mass, inertia), xtol=1e-14)
        for a, b, left, right in zip(betas, betas[1:], values, values[1:], strict=False)
        if left * right < 0
    ]
    expected = np.array(roots[:3]) ** 2 * np.sqrt(EI / RHO_A) / (2 * np.pi)
    more = attached(mass=mass, inertia=inertia) + attached("root", mass=2.0, inertia=0.1)  # which nothing moves
    found = body(condition="cantilever", count=3, elements=40, more=more).frequency
    np.testing.assert_allclose(found, expected, rtol=2e-6)


def test_mass_inside_an_element_converges_as_fast_as_without(body):
    """An element ends at the mass, or else the jump of moment there would cost the order of the elements."""
    more = attached("hub", mass=1.0, inertia=1e-3, position=0.525)
    exact = body(elements=160, count=4, more=more).frequency[3]
    errors = [body(elements=n, count=4, more=more).frequency[3] / exact - 1 for n in (10, 20)]
    assert errors[1] < 1e-4
    assert errors[0] / errors[1] > 10


def cloud(lump):
    """Six material points with the mass, the center and the E of a lump: masses and offsets (6, 3)."""
    reach = np.sqrt(3 * np.diag(lump.spread) / lump.mass)
    return np.full(6, lump.mass / 6), np.vstack([np.diag(reach), -np.diag(reach)])


@pytest.fixture
def lump():
    rng = np.random.default_rng(3)
    at = Interface(rng.normal(size=3), rng.normal(size=(3, 4)), rng.normal(size=(3, 4)))
    return Lump("grip", at, 2.0, np.array([0.3, 0.4, 0.6]))


def test_integrals_are_those_of_material_points(lump):
    at = lump.at
    found = attached_integrals(lump.mass, at.position, lump.spread, at.translation, at.rotation)
    masses, offsets = cloud(lump)
    x = lump.at.position + offsets
    Phi = [lump.at.translation + np.cross(lump.at.rotation.T, offset).T for offset in offsets]
    assert found["mass"] == pytest.approx(masses.sum())
    np.testing.assert_allclose(found["first_moment"], masses @ x, atol=1e-14)
    np.testing.assert_allclose(found["second_moment"], np.einsum("i,ik,il->kl", masses, x, x), atol=1e-14)
    np.testing.assert_allclose(found["S_bar"], np.einsum("i,ikn->kn", masses, Phi), atol=1e-14)
    np.testing.assert_allclose(found["I_bar"], np.einsum("i,ik,iln->kln", masses, x, Phi), atol=1e-13)
    np.testing.assert_allclose(found["S_bar_kl"], np.einsum("i,ikm,iln->klmn", masses, Phi, Phi), atol=1e-13)


def test_inertia_loads_are_those_of_material_points(lump):
    """Force and moment for a, α, ω."""
    products = ("xx", "yy", "zz", "xy", "xz", "yz")
    motions = [*(f"{kind}_{k}" for kind in "tr" for k in "xyz"), *(f"omega_{kl}" for kl in products)]
    loads = [f"{kind}/grip/{k}" for kind in ("force", "moment") for k in "xyz"]
    found = loads_with_lumps([*motions, *loads], [lump])[len(motions) :, : len(motions)]
    a, alpha, omega = np.array([0.3, -0.2, 0.5]), np.array([1.0, 0.7, -0.4]), np.array([0.6, -1.1, 0.9])
    sizes = np.concatenate([a, alpha, omega**2, [omega[0] * omega[1], omega[0] * omega[2], omega[1] * omega[2]]])
    masses, offsets = cloud(lump)
    forces = [
        -m * (a + np.cross(alpha, x) + np.cross(omega, np.cross(omega, x)))
        for m, x in zip(masses, lump.at.position + offsets, strict=True)
    ]
    expected = np.concatenate([np.sum(forces, axis=0), np.cross(offsets, forces).sum(axis=0)])
    np.testing.assert_allclose(found @ sizes, expected, atol=1e-13)


def test_centrifugal_force_of_a_mass_stiffens_the_link_up_to_it(body):
    loaded = body(condition="cantilever", count=3, more=attached("grip", mass=0.7, position=0.6))
    nodes, weights = np.polynomial.legendre.leggauss(6)
    expected = np.zeros((3, 3))
    for start in np.arange(20) * 0.05:
        for x, w in zip(start + 0.025 * (1 + nodes), 0.025 * weights, strict=True):
            slope = loaded.interpolate(x).rotation[2]
            N = RHO_A * (L**2 - x**2) / 2 + (0.7 * 0.6 if x < 0.6 else 0.0)
            expected += w * N * np.outer(slope, slope)
    np.testing.assert_allclose(loaded.geometric_stiffness["omega_zz"], expected, rtol=1e-9)
    np.testing.assert_allclose(loaded.geometric_stiffness["omega_yy"], expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("family", "inertia"),
    [("out-of-plane-bending", [3.0, 1.0, 1.0]), ("torsion", [1.0, 3.0, 1.0]), ("all", [0.0, 0.0, 1.0])],
)
def test_moments_of_inertia_that_no_body_has_are_refused(body, family, inertia):
    """∫ρη², half of what two exceed the third by, would be negative."""
    more = f'[[interface]]\nname = "tip"\nmass = 0.1\ninertia = {inertia}\n'
    with pytest.raises(
        InputError, match=r"interface.inertia of tip: expected moments of inertia of which none is larg"
    ):
        body(family=family, condition="cantilever", count=3, more=more)
