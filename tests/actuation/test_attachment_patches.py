"""Attachment modes do not count as modes for patches: ten patches on ten modes stay an exact square problem."""

import numpy as np
import pytest
from beam_links import modal_body, paper_link
from patches_on_links import on_link, planar_body

from ffrobot.actuation.patches.link_patches import check_reach, on_kept_modes
from ffrobot.actuation.patches.patches import voltage_gain
from ffrobot.common.errors import InputError
from ffrobot.mbs.model.truncation import with_fewer_modes


@pytest.fixture
def bodies():
    """The modal body with ten eigenmodes and two attachment modes, and the one without these."""
    return [modal_body(paper_link(attachment_modes=has_some)) for has_some in (True, False)]


def test_ten_patches_on_ten_modes_are_exact(bodies):
    attached, plain = (on_link(body) for body in bodies)
    check_reach(attached)
    assert attached.Phi_V.shape == (12, 10)
    assert np.array_equal(attached.Phi_V[:10], plain.Phi_V)
    assert attached.reach.condition_number == pytest.approx(plain.reach.condition_number, rel=1e-9)
    F_p = np.random.default_rng(1).standard_normal((5, 12))
    voltages = attached.voltages(F_p)["link"]
    assert np.allclose(voltages.required, plain.voltages(F_p[:, :10])["link"].required, rtol=1e-12)
    assert np.abs(voltages.unmet[:, : attached.reach.served]).max() < 1e-10
    # What is left is on the attachment modes, and is said.
    assert np.allclose(voltages.unmet[:, 10:], F_p[:, 10:] - voltages.within_limit @ attached.Phi_V[10:].T)


def test_weights_are_for_eigenmodes(bodies):
    keys = {"count": 4, "allocation": "least-squares"}
    found, other = (on_link(body, **keys, mode_weights=(1.0,) * 10) for body in bodies)
    assert np.allclose(voltage_gain(found.reach)[:, :10], voltage_gain(other.reach), rtol=1e-9, atol=1e-12)
    assert np.allclose(voltage_gain(found.reach)[:, 10:], 0.0)
    with pytest.raises(InputError, match="expected 10 weights, one for each mode that the patches serve, found 12"):
        on_link(bodies[0], **keys, mode_weights=(1.0,) * 12)


LOADED = {"root": ["root"], "both": ["root", "tip"]}


@pytest.fixture(params=LOADED)
def fewer(bodies, request):
    """The link with four of its ten eigenmodes, and static shapes of loads."""
    return with_fewer_modes(planar_body(bodies[0]), 4, LOADED[request.param])


def test_fewer_modes_are_served_through_all(bodies, fewer):
    """`modes = 4`: ten patches reach all ten eigenmodes still."""
    assert fewer.n_eigenmodes == 4
    of_link = on_link(bodies[0])
    assert on_kept_modes(of_link, fewer) is of_link


@pytest.mark.parametrize("count", [3, 4, 7])
def test_too_few_patches_serve_the_modes_kept(bodies, fewer, count):
    """Four coordinates of modes are met where there are four patches, whatever happens to the others."""
    of_link = on_kept_modes(on_link(bodies[0], count=count), fewer)
    F_kept = np.random.default_rng(3).standard_normal((6, fewer.n_modes))
    F_p = F_kept @ fewer.on_file
    V = of_link.voltages(F_p)["link"].required
    left = F_kept - (V @ of_link.Phi_V.T) @ fewer.modal_transform
    np.testing.assert_allclose(of_link.unmet(F_p, V) @ fewer.modal_transform, left, atol=1e-12 * np.abs(F_kept).max())
    if count >= 4:
        check_reach(of_link)
        assert np.abs(left[:, :4]).max() < 1e-8
    else:
        with pytest.raises(InputError, match=r"as many patches as modes \(4\) or more, found 3"):
            check_reach(of_link)


@pytest.mark.parametrize("weights", [{}, {"mode_weights": (1.0,) * 10}, {"point_weights": {"tip": 1.0}}])
def test_weights_of_all_modes_hold_for_those_kept(bodies, fewer, weights):
    """What too few patches leave is weighed as what loads make of all modes of the file."""
    keys = {"count": 2, "allocation": "least-squares"} | weights
    whole = on_link(bodies[0], **keys)
    kept = on_kept_modes(whole, fewer)
    F_kept = np.random.default_rng(3).standard_normal((6, fewer.n_modes))
    V = kept.voltages(F_kept @ fewer.on_file)["link"].required
    Phi = fewer.modal_transform.T @ whole.Phi_V  # what is seen of the patches
    rows = whole.reach.W_sqrt @ whole.reach.modes.forces(fewer.on_file).T
    expected = np.array([np.linalg.lstsq(rows @ Phi, rows @ F, rcond=None)[0] for F in F_kept])
    np.testing.assert_allclose(V, expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())
