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


@pytest.mark.parametrize("apart", [1e-3, 1e-6, 1e-9])
def test_nearly_the_same_place(link, apart):
    """Patches much shorter than the modes, side by side: their columns of Φ_V are all but parallel."""
    length = 0.5 * apart
    array = patches(link, centers=(0.33, 0.33 + apart, 0.5, 0.7, 0.9), length=length)
    voltages = solve_voltages(array, wanted(link))
    left = np.abs(voltages.unmet).max() / np.abs(wanted(link)).max()
    assert left < np.finfo(float).eps * array.condition_number
    assert array.condition_number > min(10 / apart, 1e8)
