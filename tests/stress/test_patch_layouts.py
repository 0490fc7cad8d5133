"""PZT layouts that are ill-conditioned: overlapping, where modes have no curvature, too many, too few."""

import numpy as np
import pytest
from beam_links import modal_body, paper_link
from patches_on_links import SCENE, on_link

from ffrobot.actuation.patches.link_patches import check_reach
from ffrobot.actuation.patches.patches import solve_voltages


@pytest.fixture(scope="module")
def link():
    """Its modal body, five modes."""
    return modal_body(paper_link(count=5))


def patches(link, **keys):
    of_link = on_link(link, **keys)
    check_reach(SCENE, of_link)
    return of_link.reach


def wanted(link):
    """Modal forces as an inverse analysis finds them: less in higher modes."""
    return np.random.default_rng(3).standard_normal((20, 5)) / np.arange(1, 6)


def inflection(link):
    """Where the second mode of a cantilever has no curvature, from its stations."""
    x = np.linspace(0.1, 0.9, 801)
    curvature = np.gradient([link.interpolate(s).rotation[2][1] for s in x], x)
    return float(x[np.flatnonzero(np.diff(np.sign(curvature)))[0]])


LEFT = {1e-3: 1e-11, 1e-6: 1e-8, 1e-9: 1e-6}  # the condition number times rounding


@pytest.mark.parametrize("apart", LEFT)
def test_nearly_the_same_place(link, apart):
    """Patches much shorter than the modes, side by side: their columns of Φ_V are all but parallel."""
    length = 0.5 * apart
    array = patches(link, centers=(0.33, 0.33 + apart, 0.5, 0.7, 0.9), length=length)
    voltages = solve_voltages(array, wanted(link))
    left = np.abs(voltages.unmet).max() / np.abs(wanted(link)).max()
    assert left < LEFT[apart]
    assert left < np.finfo(float).eps * array.condition_number + 1e-13
    assert array.condition_number > min(10 / apart, 1e8)


def test_at_an_inflection(link):
    """One patch over the inflection of mode 2 serves the other modes; five together serve all."""
    x = inflection(link)
    assert x == pytest.approx(0.784 - 0.568, abs=0.002)  # 1 − 0.7834 of the free end: Blevins, Table 8-1
    alone = patches(link, centers=(x,), allocation="least-squares")
    reached = np.abs(alone.Phi_V[:, 0])
    assert reached[1] < 0.02 * reached.max()
    array = patches(link, centers=(x, 0.1, 0.5, 0.7, 0.9))
    left = np.abs(solve_voltages(array, wanted(link)).unmet).max()
    assert left < 1e-12
