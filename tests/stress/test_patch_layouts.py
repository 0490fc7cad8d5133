"""PZT layouts that are ill-conditioned: overlapping, where modes have no curvature, too many, too few."""

import re
from pathlib import Path

import numpy as np
import pytest
from table import at_most

from ffrobot.actuation.patches.link_patches import check_reach, link_patches
from ffrobot.actuation.patches.patches import solve_voltages
from ffrobot.actuation.patches.records import PztLayout
from ffrobot.common.errors import InputError
from ffrobot.mbs.model.body import from_modal_body
from ffrobot.mbs.model.projection import projected

GROUP = "PZT layouts"
PATCH = {
    "body": "link2",
    "length": 0.05,
    "width": 0.025,
    "thickness": 0.75e-3,
    "modulus": 63e9,
    "d31": 110e-12,
    "structural": False,
}


@pytest.fixture(scope="module")
def link(beam):
    """Its modal body, five modes."""
    return beam("link2", "cantilever", modes=5, modal=True)[0]


def patches(link, **keys):
    path, spatial = Path("scene.toml"), projected(from_modal_body("link2", link, is_planar=True))
    of_link = link_patches(path, [PztLayout(**(PATCH | keys))], link, spatial)
    check_reach(path, of_link)
    return of_link.reach


def wanted(link):
    """Modal forces as an inverse analysis finds them: less in higher modes."""
    return np.random.default_rng(3).standard_normal((20, 5)) / np.arange(1, 6)


def inflection(link):
    """Where the second mode of a cantilever has no curvature, from its stations."""
    x = np.linspace(0.1, 0.9, 801)
    curvature = np.gradient([link.interpolate(s).rotation[2][1] for s in x], x)
    return float(x[np.flatnonzero(np.diff(np.sign(curvature)))[0]])


def test_overlapping(link, record):
    with pytest.raises(InputError, match=r"expected patches side by side, found patch 1 .* on the same place"):
        patches(link, centers=(0.1, 0.12, 0.5, 0.7, 0.9))
    record(GROUP, "patches that overlap", "rejected", "input error: which, and where")


LEFT = {1e-3: 1e-11, 1e-6: 1e-8, 1e-9: 1e-6}  # the condition number times rounding


@pytest.mark.parametrize("apart", LEFT)
def test_nearly_the_same_place(link, apart, record):
    """Patches much shorter than the modes, side by side: their columns of Φ_V are all but parallel."""
    length = 0.5 * apart
    array = patches(link, centers=(0.33, 0.33 + apart, 0.5, 0.7, 0.9), length=length)
    voltages = solve_voltages(array, wanted(link))
    left = np.abs(voltages.unmet).max() / np.abs(wanted(link)).max()
    assert left < np.finfo(float).eps * array.condition_number + 1e-13
    condition, measured = "{condition}", {"condition": array.condition_number}
    if apart < 1e-8:  # the columns differ by rounding alone, and so does their condition
        assert array.condition_number > 1e8
        condition, measured = "above 1e8", {}
    record(
        GROUP,
        f"five patches of {length:g} m, two of them {apart:g} m apart, five modes",
        f"condition number {condition}, at most {{left}} of the modal forces unmet",
        left=at_most(LEFT[apart], left),
        **measured,
    )


def test_at_an_inflection(link, record):
    """One patch over the inflection of mode 2 serves the other modes; five together serve all."""
    x = inflection(link)
    assert x == pytest.approx(0.784 - 0.568, abs=0.002)  # 1 − 0.7834 of the free end: Blevins, Table 8-1
    alone = patches(link, centers=(x,), allocation="least-squares")
    reached = np.abs(alone.Phi_V[:, 0])
    assert reached[1] < 0.02 * reached.max()
    array = patches(link, centers=(x, 0.1, 0.5, 0.7, 0.9))
    left = np.abs(solve_voltages(array, wanted(link)).unmet).max()
    assert left < 1e-12
    record(
        GROUP,
        "a patch where mode 2 has no curvature",
        "reaches it with {reach} of the others; among five: condition number {condition}",
        reach=reached[1] / reached.max(),
        condition=array.condition_number,
    )


def test_more_patches_than_modes(link, record):
    array = patches(link, count=18)
    voltages = solve_voltages(array, wanted(link))
    few = solve_voltages(patches(link, count=5), wanted(link))
    assert np.abs(voltages.unmet).max() < 1e-12
    assert voltages.largest < few.largest
    record(
        GROUP,
        "18 patches for five modes",
        "the smallest voltages that do; condition number {condition}, {part} of the voltage of five patches",
        condition=array.condition_number,
        part=voltages.largest / few.largest,
    )


def test_fewer_patches_than_modes(link, record):
    with pytest.raises(InputError, match=re.escape("expected as many patches as modes (5) or more, found 3")):
        patches(link, count=3)
    voltages = solve_voltages(patches(link, count=3, allocation="least-squares"), wanted(link))
    assert 0.01 < np.abs(voltages.unmet).max() < np.abs(wanted(link)).max()
    record(
        GROUP,
        "three patches for five modes",
        "rejected, or least squares",
        "input error with advice; residual in the results",
    )
