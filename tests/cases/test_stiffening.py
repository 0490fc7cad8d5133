"""Geometric stiffening in 3D: blades that spin, a link that bends in an oblique plane, bad input."""

from dataclasses import replace

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from scipy.linalg import eigh
from tables_3d import ORIGIN, revolute, scene

import ffrobot
from ffrobot.fe_models.modal_body_file import write_modal_body

BOTH = ["in-plane-bending", "out-of-plane-bending"]


def link():
    modes = {"count": 24, "family": BOTH}
    return beam_link(1.0, rectangle(0.01, 0.01), 40, nu=0.3, name="blade", modes=modes)


def blade(**tables):
    """A link on a hub that turns about z."""
    spin = {"name": "spin", "joint": "hub", "value": "1.0*t"}
    turning = {"name": "turning", "kind": "pcid", "end": 1e-3, "output_step": 1e-3}
    about = {"name": "about", "kind": "linear", "about": "turning", "times": [0.0]}
    keys = {"gravity": ORIGIN, "geometric_stiffening": True, "trajectory": [spin]}
    bodies, joints = [{"name": "blade", "link": link()}], [revolute("hub", "ground", "blade.root")]
    return scene(bodies, joints, turning, about, **keys | tables)


def solve(**tables):
    return ffrobot.solve(ffrobot.make_scene(**tables))


# Spin and frequencies over √(EI/ρAL⁴), hub radius 0: first and second flap (Wright, Smith, Thresher, Wang, Vibration
# modes of centrifugally stiffened beams, J. Appl. Mech. 49, 1982).
FLAP = {1: (3.6816, 22.181), 2: (4.1373, 22.615), 3: (4.7973, 23.320), 6: (7.3604, 26.809), 12: (13.1702, 37.603)}


@pytest.mark.parametrize("spin", FLAP)
def test_frequencies_of_a_rotating_cantilever(spin):
    """Across the plane (flap), and in it with the hub held (lag): ω_lag² = ω_flap² − Ω²."""
    unit = np.sqrt(7e10 * 0.01**4 / 12 / (2700 * 0.01**2))
    path = [{"name": "spin", "joint": "hub", "value": f"{float(spin * unit)!r}*t"}]
    with solve(**blade(trajectory=path)) as results:
        flap = 2 * np.pi * results["about/linear/frequency"][0] / unit
        zeros = np.sort(np.abs(results["about/linear/zeros/1"][0]).max(axis=-1)) / unit  # from the hub's motor to it
    expected = np.array(FLAP[spin])
    for flapping in expected:  # with twelve shapes; the numbers have five digits
        assert np.abs(flap / flapping - 1).min() < 3e-5
        lag = np.sqrt(flapping**2 - spin**2)
        assert np.abs(zeros / lag - 1).min() < 1e-4


def test_how_far_a_cantilever_bends_in_an_oblique_plane():
    """Under P at its tip: 0.06415 PL³/EI from its chord, shorter by P²L⁵/15(EI)² (w = P(3Lx² − x³)/6EI)."""
    EI, P = 7e10 * 0.01**4 / 12, 2.0
    wall = [{"name": "wall", "type": "weld", "between": ["ground", "blade.root"]}]
    force = {"y": repr(float(P * np.cos(0.8))), "z": repr(float(P * np.sin(0.8)))}
    rest = {"name": "rest", "kind": "static"}
    tables = {"load": [{"point": "blade.tip", **force}], "joint": wall, "trajectory": [], "analysis": [rest]}
    with solve(**blade(**tables)) as results:
        found = results.attributes("rest/bodies/blade")
    at = 1 - 1 / np.sqrt(3)
    from_chord = P / EI * (2 * at + at**3 - 3 * at**2) / 6
    assert found["largest_deflection"] == pytest.approx(from_chord, rel=2e-3)  # at stations, between which it may be
    assert found["largest_rotation"] == pytest.approx(P / EI / 3, rel=1e-6)  # of the root from the chord
    assert found["foreshortening"] == pytest.approx(P**2 / EI**2 / 15, rel=2e-3)
    assert found["foreshortening_moment"] == pytest.approx(P**3 / EI**2 / 15, rel=2e-3)


def softest_under_spin():
    """Largest ∫ ½(1 − x²) w'² dx / ∫ w''² dx of clamped w = x², x³, …"""
    x, weights = np.polynomial.legendre.leggauss(20)
    x, k = 0.5 * (x[:, None] + 1), np.arange(2, 12)
    slope, curvature = k * x ** (k - 1), k * (k - 1) * x ** (k - 2)
    pull = slope.T @ (0.5 * weights[:, None] * 0.5 * (1 - x**2) * slope)
    return eigh(pull, curvature.T @ (0.5 * weights[:, None] * curvature))[0].max()


@pytest.mark.parametrize(("spin", "stiffened"), [(0.05, False), (3.0, True)])
def test_auto_where_loads_change_the_stiffness(spin, stiffened):
    """A spin Ω pulls the blade with ρAΩ²(L² − x²)/2: much or little of the stiffness of the shape it stiffens most."""
    unit = np.sqrt(7e10 * 0.01**4 / 12 / (2700 * 0.01**2))
    path = [{"name": "spin", "joint": "hub", "value": f"{float(spin * unit)!r}*t"}]
    frequencies = []
    for key in ("auto", stiffened):
        with solve(**blade(trajectory=path, geometric_stiffening=key)) as results:
            assert results.attributes("/")["geometric_stiffening"] == stiffened
            effect = results.attributes("turning")["stiffening_effect"]
            frequencies.append(results["about/linear/frequency"][0])
    assert effect == pytest.approx(softest_under_spin() * spin**2, rel=1e-3)
    np.testing.assert_array_equal(*frequencies)


def test_a_key_that_is_neither_true_nor_false_nor_auto():
    with pytest.raises(ffrobot.InputError, match='geometric_stiffening: expected true or false or "auto", found "yes"'):
        solve(**blade(geometric_stiffening="yes"))


def test_files_without_geometric_stiffness_are_named(tmp_path):
    """Without it in the equations, errors are not known, rather than 0."""
    write_modal_body(tmp_path / "blade.h5", replace(ffrobot.make_link(link()).body, geometric_stiffness={}))
    body = [{"name": "blade", "modal": str(tmp_path / "blade.h5")}]
    with pytest.raises(ffrobot.InputError, match=r'geometric_stiffening: expected modal bodies .* of "blade"'):
        solve(**blade(body=body))
    with solve(**blade(body=body, geometric_stiffening=False)) as results:
        assert np.isnan(results.attributes("turning/bodies/blade")["position_error"])
