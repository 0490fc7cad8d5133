"""Patches on a link from stage 1: deflection in closed form, virtual work, and what is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ffrobot.actuation.patches import patch_array
from ffrobot.actuation.voltages import solve_voltages
from ffrobot.errors import InputError
from ffrobot.mbs.planar_body import from_modal_body, with_payload
from ffrobot.mbs.scene_records import PztLayout

EI = 2.068427e11 * 0.025 * 0.015**3 / 12
C = 63e9 * 110e-12 * 0.025 * (0.75e-3 + 0.015) / 2  # Shaban 2022, Eq. 14


def patches(body, planar=None, **keys):
    tables = {"length": 0.05, "width": 0.025, "thickness": 0.75e-3, "modulus": 63e9, "d31": 110e-12} | keys
    if "centers" not in tables and "count" not in tables:
        tables["count"] = 10
    layout = PztLayout(body="link", **tables)
    return patch_array(Path("scene.toml"), layout, body, planar or from_modal_body("link", body))


def tip_deflection(planar, array, voltage):
    p = array.Phi_V @ voltage / planar.stiffness
    return planar.points["tip"].translation[1] @ p


def test_moment_per_volt(cantilever):
    np.testing.assert_allclose(patches(cantilever(10)).moment_per_volt, 1.364344e-3, rtol=1e-6)  # formulation, sec. 9
    np.testing.assert_allclose(patches(cantilever(10)).moment_per_volt, C, rtol=1e-12)


@pytest.mark.parametrize("start", [0.0, 0.3, 0.95])
def test_cantilever_bends_as_in_closed_form(cantilever, start):
    """w(L) = cV (x2 − x1) [L − (x1 + x2)/2]/EI; with all 40 modes of 20 elements that is exact at their nodes."""
    body = cantilever(40)
    planar = from_modal_body("link", body)
    array = patches(body, centers=(start + 0.025,))
    expected = C * 100.0 * 0.05 * (1.0 - start - 0.025) / EI
    assert tip_deflection(planar, array, np.array([100.0])) == pytest.approx(expected, rel=1e-7)
    if start == 0.0:
        assert expected == pytest.approx(4.573e-6, rel=2e-4)


def test_deflection_converges_with_the_number_of_modes(cantilever):
    exact = C * 100.0 * 0.05 * 0.975 / EI
    errors = []
    for count in (3, 6, 12, 24):
        body = cantilever(count)
        deflection = tip_deflection(from_modal_body("link", body), patches(body, centers=(0.025,)), np.array([100.0]))
        errors.append(abs(deflection / exact - 1))
    assert errors[0] > errors[1] > errors[2] > errors[3]
    assert errors[3] < 1e-3


def test_signs_of_modes_do_not_matter_to_voltages(cantilever):
    body = cantilever(10)
    signs = np.where(np.arange(10) % 3 == 0, -1.0, 1.0)
    flipped = replace(
        body,
        S_bar=body.S_bar * signs,
        I_bar=body.I_bar * signs,
        S_bar_kl=body.S_bar_kl * np.outer(signs, signs),
        interfaces={k: replace(i, translation=i.translation * signs, rotation=i.rotation * signs)
                    for k, i in body.interfaces.items()},
        stations=replace(body.stations, translation=body.stations.translation * signs,
                         rotation=body.stations.rotation * signs),
        geometric_stiffness={},
    )  # fmt: skip
    F_p = np.random.default_rng(0).standard_normal((3, 10))
    one, other = solve_voltages(patches(body), F_p), solve_voltages(patches(flipped), F_p * signs)
    np.testing.assert_allclose(other.required, one.required, rtol=1e-9, atol=1e-9 * one.largest)


def test_a_payload_changes_the_modes_and_not_the_deflection(cantilever):
    """Modes are made anew with the payload; the same volts still bend the link as far."""
    body = cantilever(40)
    planar = from_modal_body("link", body)
    loaded = with_payload(planar, "tip", 3.0, 0.1)
    bare = tip_deflection(planar, patches(body), np.linspace(10, 100, 10))
    assert tip_deflection(loaded, patches(body, loaded), np.linspace(10, 100, 10)) == pytest.approx(bare, rel=1e-9)


def test_square_voltages_reproduce_the_modal_forces(cantilever):
    array = patches(cantilever(10), limit=200.0)
    F_p = np.random.default_rng(1).standard_normal((4, 10))
    voltages = solve_voltages(array, F_p)
    np.testing.assert_allclose(voltages.required @ array.Phi_V.T, F_p, atol=1e-9)
    assert np.abs(voltages.within_limit).max() == 200.0
    np.testing.assert_allclose(
        voltages.residual, np.linalg.norm(F_p - voltages.within_limit @ array.Phi_V.T, axis=1), rtol=1e-12
    )
    assert array.condition_number == pytest.approx(np.linalg.cond(array.Phi_V))


@pytest.mark.parametrize("count", [4, 14])
def test_fewer_or_more_patches_than_modes_are_least_squares(cantilever, count):
    array = patches(cantilever(10), count=count)
    F_p = np.random.default_rng(2).standard_normal((1, 10))
    voltages = solve_voltages(array, F_p)
    left = F_p[0] - array.Phi_V @ voltages.required[0]
    size = np.abs(array.Phi_V).max() * np.abs(F_p).max()
    assert np.abs(array.Phi_V.T @ left).max() < 1e-9 * size  # no voltage can do better
    assert voltages.residual[0] == pytest.approx(np.linalg.norm(left), abs=1e-9)


def test_patches_that_miss_a_mode_are_refused_by_its_number(link_file):
    """About the middle of a simply-supported link the second mode has an inflection: no voltage bends it there."""
    body = cached_modal_body(link_file("supported2", "simply-supported", 2)).body
    array = patches(body, centers=(0.5, 0.9))
    check_reach(Path("scene.toml"), array)
    for centers in ((0.5,), (0.475, 0.525)):
        array = patches(body, centers=centers, length=0.04)
        with pytest.raises(InputError, match='pzt "link": expected (as many patches as modes|patches that reach)'):
            check_reach(Path("scene.toml"), array)
    assert list(patches(body, centers=(0.475, 0.525), length=0.04).unreached_modes) == []


@pytest.mark.parametrize(("center", "number"), [(0.99, 1), (0.01, 1)])
def test_patch_beyond_the_link_is_refused(cantilever, center, number):
    with pytest.raises(InputError, match=rf'pzt "link": expected patches within the link.*found patch {number} from'):
        patches(cantilever(10), centers=(center,))
