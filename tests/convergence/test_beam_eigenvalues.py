"""Beam eigenfrequencies against analytic values: the observed order of convergence, on meshes good and bad."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from scipy.optimize import brentq

from ffrobot.common.errors import SolveError
from ffrobot.common.validation import validate
from ffrobot.fe_models.beam.beam import BeamForms, family_model
from ffrobot.fe_models.beam.modes import lowest_modes
from ffrobot.fe_models.link_records.link import BeamLink

E, NU, RHO, LENGTH = 2.068427e11, 0.3, 7850.0, 1.0
HEIGHT, WIDTH = 0.015, 0.025
AREA, SECOND_MOMENT = HEIGHT * WIDTH, WIDTH * HEIGHT**3 / 12
G = E / (2 * (1 + NU))
BENDING_SPEED = np.sqrt(E * SECOND_MOMENT / (RHO * AREA))

RECTANGLE = rectangle(HEIGHT, WIDTH)
MESHES = ["uniform", "random"]
CONDITIONS = ["simply-supported", "cantilever"]


def beam(condition, theory="euler-bernoulli", section=RECTANGLE, **geometry):
    more = {"name": "beam", "model": {"theory": theory}, "modes": {"count": 3}}
    keys = beam_link(LENGTH, section, 10, E=E, nu=NU, rho=RHO, condition=condition, **more)
    keys["geometry"] = {key: value for key, value in (keys["geometry"] | geometry).items() if value is not None}
    return validate(BeamLink, keys, Path("beam.toml"))


def nodes_of(kind, elements, breakpoints=(0.0, LENGTH)):
    """Elements of equal length or, if not uniform, of lengths that vary by up to 3:1 at random."""
    random = np.random.default_rng(elements)
    pieces = [np.array([0.0])]
    for start, end in pairwise(breakpoints):
        number = elements // (len(breakpoints) - 1)
        sizes = np.ones(number) if kind == "uniform" else random.uniform(0.5, 1.5, number)
        pieces.append(start + (end - start) * np.cumsum(sizes) / sizes.sum())
    return np.concatenate(pieces)


def frequencies(link, family, nodes, count=3):
    model = family_model(link, family, BeamForms(nodes), np.array([0.0, LENGTH]))
    return np.sqrt(lowest_modes(model, count)[0])


def observed_order(link, family, exact, kind, coarsest=10, levels=3, breakpoints=(0.0, LENGTH)):
    """Slope of log(relative error of ω) over log(1/elements) for each mode, halving all elements of one mesh."""
    nodes = nodes_of(kind, coarsest, breakpoints)
    counts, errors = [], []
    for _ in range(levels):
        counts.append(nodes.size - 1)
        errors.append(frequencies(link, family, nodes, len(exact)) / exact - 1)
        nodes = np.sort(np.concatenate([nodes, 0.5 * (nodes[1:] + nodes[:-1])]))
    assert np.all(np.asarray(errors) > 0)  # Rayleigh: the discrete frequencies are too high
    return -np.polyfit(np.log(counts), np.log(errors), 1)[0]


def euler_bernoulli_omega(condition, count=3):
    if condition == "simply-supported":
        beta = np.pi * np.arange(1, count + 1)
    else:
        edges = np.pi * np.arange(count + 1)
        beta = np.array([brentq(lambda b: np.cos(b) + 1 / np.cosh(b), *pair, xtol=1e-15) for pair in pairwise(edges)])
    return beta**2 * BENDING_SPEED / LENGTH**2


@pytest.mark.parametrize("kind", MESHES)
@pytest.mark.parametrize("condition", CONDITIONS)
def test_euler_bernoulli_bending_is_of_order_four(condition, kind):
    exact = euler_bernoulli_omega(condition)
    order = observed_order(beam(condition), "in-plane-bending", exact, kind)
    assert np.all(order > 3.9), order


def test_out_of_plane_bending_is_in_plane_bending_of_the_turned_section():
    mesh, turned = nodes_of("random", 12), beam("cantilever", section=rectangle(WIDTH, HEIGHT))
    expected = frequencies(turned, "in-plane-bending", mesh)
    np.testing.assert_allclose(frequencies(beam("cantilever"), "out-of-plane-bending", mesh), expected, rtol=1e-12)


@pytest.mark.parametrize("kind", MESHES)
@pytest.mark.parametrize(("family", "speed"), [("axial", np.sqrt(E / RHO)), ("torsion", None)])
def test_axial_and_torsional_modes(family, speed, kind):
    """Root held, tip free: ω = (k − ½) π c / L under both conditions; cubic Lagrange elements are of order six."""
    if speed is None:  # J and I_p are checked in test_section
        link = beam("cantilever")
        speed = np.sqrt(G * link.sections[0].torsion / (RHO * link.sections[0].I_p))
    exact = (np.arange(1, 6) - 0.5) * np.pi * speed / LENGTH
    for condition in CONDITIONS:
        order = observed_order(beam(condition), family, exact, kind, levels=2)
        assert np.all(order[1:] > 5.8), order  # the lowest meets rounding errors


def timoshenko_simply_supported(mode):
    """Lower root of (kGA κ² − ρAω²)(EIκ² + kGA − ρIω²) = (kGA κ)², κ = mode·π/L (Timoshenko 1921)."""
    kappa, kGA = mode * np.pi / LENGTH, 10 * (1 + NU) / (12 + 11 * NU) * G * AREA
    product = [
        RHO * AREA * RHO * SECOND_MOMENT,
        -(RHO * AREA * (E * SECOND_MOMENT * kappa**2 + kGA) + RHO * SECOND_MOMENT * kGA * kappa**2),
    ]
    return np.sqrt(np.min(np.roots([*product, kGA * kappa**2 * E * SECOND_MOMENT * kappa**2])))


@pytest.mark.parametrize("kind", MESHES)
def test_timoshenko_simply_supported(kind):
    exact = np.array([timoshenko_simply_supported(mode) for mode in (1, 2, 3)])
    link = beam("simply-supported", "timoshenko")
    order = observed_order(link, "in-plane-bending", exact, kind)
    assert np.all(order > 3.9), order
    fine = frequencies(link, "in-plane-bending", nodes_of(kind, 64))
    np.testing.assert_allclose(fine, exact, rtol=1e-6)
    assert np.all(fine < euler_bernoulli_omega("simply-supported"))


def test_frequencies_stay_accurate_on_fine_meshes():
    """Discretisation leaves 1e-13 at 500 elements; the assembled stiffness alone would leave 1e-7."""
    for condition in CONDITIONS:
        omega = frequencies(beam(condition), "in-plane-bending", nodes_of("uniform", 500))
        np.testing.assert_allclose(omega, euler_bernoulli_omega(condition), rtol=1e-10)


def test_too_fine_a_mesh_is_refused():
    with pytest.raises(SolveError, match=r"round-off errors move ω² by .* use fewer elements"):
        frequencies(beam("cantilever"), "in-plane-bending", nodes_of("uniform", 10_000))


STEP, THICK = 0.4, 0.03


def stepped_cantilever_determinant(omega):
    """Clamped, 30 mm thick up to 0.4 m, 15 mm beyond, free: the 8 × 8 characteristic determinant."""
    rows = np.zeros((8, 8))
    parts = []
    for thickness in (THICK, HEIGHT):
        EI, rhoA = E * WIDTH * thickness**3 / 12, RHO * WIDTH * thickness
        parts.append((EI, (omega**2 * rhoA / EI) ** 0.25))

    def shape(beta, x):
        """w, w', w'', w''' of (cos, sin, decaying, growing), the last two scaled against overflow."""
        c, s, d, g = np.cos(beta * x), np.sin(beta * x), np.exp(-beta * x), np.exp(beta * (x - LENGTH))
        return [
            np.array([c, s, d, g]),
            np.array([-s, c, -d, g]) * beta,
            np.array([-c, -s, d, g]) * beta**2,
            np.array([s, -c, -d, g]) * beta**3,
        ]

    (EI_1, beta_1), (EI_2, beta_2) = parts
    root, left, right, tip = shape(beta_1, 0.0), shape(beta_1, STEP), shape(beta_2, STEP), shape(beta_2, LENGTH)
    rows[0, :4], rows[1, :4] = root[0], root[1]
    for i, (a, b) in enumerate(((1, 1), (1, 1), (EI_1, EI_2), (EI_1, EI_2))):
        rows[2 + i, :4], rows[2 + i, 4:] = a * left[i], -b * right[i]
    rows[6, 4:], rows[7, 4:] = tip[2], tip[3]
    return np.linalg.det(rows / np.abs(rows).max(axis=1, keepdims=True))


@pytest.mark.parametrize("kind", MESHES)
def test_stepped_section_against_its_characteristic_equation(kind):
    samples = np.linspace(50.0, 4000.0, 2000)
    values = np.array([stepped_cantilever_determinant(omega) for omega in samples])
    signs = np.flatnonzero(np.sign(values[:-1]) != np.sign(values[1:]))[:3]
    exact = np.array([brentq(stepped_cantilever_determinant, samples[i], samples[i + 1], xtol=1e-11) for i in signs])
    segments = [{"until": STEP, "section": rectangle(THICK, WIDTH)}, {"until": LENGTH, "section": RECTANGLE}]
    link = beam("cantilever", section=None, segment=segments)
    order = observed_order(link, "in-plane-bending", exact, kind, coarsest=20, breakpoints=(0.0, STEP, LENGTH))
    assert np.all(order > 3.9), order
