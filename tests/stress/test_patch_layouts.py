"""PZT layouts that are ill-conditioned: patches nearly at the same place."""

import numpy as np
import pytest
from beam_links import modal_body, paper_link
from patches_on_links import on_link

from ffrobot.actuation.patches.link_patches import check_reach


@pytest.mark.parametrize("apart", [1e-3, 1e-6, 1e-9])
def test_nearly_the_same_place(apart):
    """Patches much shorter than the modes, side by side: their columns of Φ_V are all but parallel.

    Modal forces as an inverse analysis finds them: less in higher modes.
    """
    centers = (0.33, 0.33 + apart, 0.5, 0.7, 0.9)
    of_link = on_link(modal_body(paper_link(count=5)), centers=centers, length=0.5 * apart)
    check_reach(of_link)
    array, wanted = of_link.reach, np.random.default_rng(3).standard_normal((20, 5)) / np.arange(1, 6)
    (found,) = of_link.voltages(wanted).values()
    left = np.abs(found.unmet).max() / np.abs(wanted).max()
    assert left < np.finfo(float).eps * array.condition_number
    assert array.condition_number > min(10 / apart, 1e8)
