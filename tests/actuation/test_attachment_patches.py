"""Attachment modes do not count as modes for patches: ten patches on ten modes stay an exact square problem."""

from pathlib import Path

import numpy as np
import pytest

from ffrobot.actuation.patches.patches import check_reach, patch_array, with_factors
from ffrobot.actuation.patches.records import PztLayout
from ffrobot.actuation.patches.voltages import solve_voltages, voltage_gain
from ffrobot.common.errors import InputError
from ffrobot.fe_models.link import cached_modal_body
from ffrobot.mbs.model.planar_body import from_modal_body
from ffrobot.mbs.model.raised_mass import mass_factors
from ffrobot.mbs.model.truncation import with_fewer_modes

PATH = Path("scene.toml")


def layout(count=10, **keys):
    given = {"body": "b", "length": 0.05, "width": 0.025, "thickness": 0.75e-3, "modulus": 63e9, "d31": 110e-12}
    return PztLayout(count=count, **given, **({"structural": False} | keys))


@pytest.fixture
def bodies(link_file):
    """The modal body with ten eigenmodes and two attachment modes, and the one without these."""
    path = link_file("attached")
    plain = cached_modal_body(path).body
    path.write_text(path.read_text().replace("attachment_modes = false\n", ""))
    return cached_modal_body(path).body, plain


def test_ten_patches_on_ten_modes_are_exact(bodies):
    found = [patch_array(PATH, layout(), body, from_modal_body("b", body)) for body in bodies]
    attached, plain = found
    check_reach(PATH, attached)
    assert attached.Phi_V.shape == (12, 10)
    assert np.array_equal(attached.Phi_V[:10], plain.Phi_V)
    assert attached.condition_number == plain.condition_number
    F_p = np.random.default_rng(1).standard_normal((5, 12))
    voltages = solve_voltages(attached, F_p)
    assert np.allclose(voltages.required, solve_voltages(plain, F_p[:, :10]).required, rtol=1e-12)
    assert voltages.residual.max() < 1e-10
    # What is left is on the attachment modes, and is said.
    assert np.allclose(voltages.unmet[:, 10:], F_p[:, 10:] - voltages.within_limit @ attached.Phi_V[10:].T)


def test_nine_patches_are_too_few(bodies):
    array = patch_array(PATH, layout(9), bodies[0], from_modal_body("b", bodies[0]))
    with pytest.raises(InputError, match=r"as many patches as modes \(10\) or more, found 9"):
        check_reach(PATH, array)


def test_weights_are_for_eigenmodes(bodies):
    planar = from_modal_body("b", bodies[0])
    array = patch_array(PATH, layout(4, mode_weights=(1.0,) * 10, allocation="least-squares"), bodies[0], planar)
    plain = from_modal_body("b", bodies[1])
    other = patch_array(PATH, layout(4, mode_weights=(1.0,) * 10, allocation="least-squares"), bodies[1], plain)
    assert np.allclose(voltage_gain(array)[:, :10], voltage_gain(other), rtol=1e-9, atol=1e-12)
    assert np.allclose(voltage_gain(array)[:, 10:], 0.0)
    with pytest.raises(InputError, match="expected 10 weights"):
        patch_array(PATH, layout(4, mode_weights=(1.0,) * 12), bodies[0], planar)


@pytest.mark.parametrize("keys", [{}, {"point_weights": {"tip": 1.0}, "allocation": "least-squares"}])
@pytest.mark.parametrize("count", [6, 10, 12])
def test_voltages_do_not_depend_on_coordinates(bodies, keys, count):
    """p' = √μ p, F' = F / √μ: the same voltages."""
    planar = from_modal_body("b", bodies[0])
    array = patch_array(PATH, layout(count, **keys), bodies[0], planar)
    factors = np.sqrt(mass_factors(planar))
    assert np.any(factors > 1.0)
    F_p = np.random.default_rng(2).standard_normal((3, 12))
    scaled = with_factors(array, factors)
    expected = solve_voltages(array, F_p)
    found = solve_voltages(scaled, F_p / factors)
    assert np.allclose(found.required, expected.required, rtol=1e-8, atol=1e-9 * np.abs(expected.required).max())


def test_fewer_modes_are_served_through_all(bodies):
    """`modes = 4`: ten patches reach all ten eigenmodes still."""
    planar = with_fewer_modes(from_modal_body("b", bodies[0]), 4, ["root", "tip"])
    array = patch_array(PATH, layout(), bodies[0], planar)
    assert planar.n_eigenmodes == array.served == 4
    assert array.of_all_modes is not None
    check_reach(PATH, array)
