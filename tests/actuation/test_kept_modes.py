"""Patches on links of which the equations have fewer modes than the file: which modes they serve."""

from pathlib import Path

import numpy as np
import pytest

from ffrobot.actuation.patches.records import SpatialPztLayout
from ffrobot.actuation.patches.spatial_patches import check_allocation, link_patches
from ffrobot.common.errors import InputError
from ffrobot.common.validation import validate
from ffrobot.mbs.model.projection import projected
from ffrobot.mbs.model.spatial_body import from_modal_body

SCENE, KEPT = Path("scene.toml"), 3


@pytest.mark.parametrize(("count", "served"), [(3, 3), (6, 6)])
def test_as_many_patches_as_modes_of_the_file_serve_all_and_fewer_those_kept(cantilever, count, served):
    """Modal forces on the modes served are met to round-off; those on others are left."""
    link = cantilever(6)
    tables = {"body": "link", "count": count, "length": 0.02, "width": 0.01, "thickness": 5e-4, "modulus": 63e9}
    layout = validate(SpatialPztLayout, tables | {"d31": 110e-12, "structural": False}, SCENE)
    spatial = projected(from_modal_body("link", link, is_planar=True))
    patches = link_patches(SCENE, [layout], link, spatial, KEPT)
    check_allocation(SCENE, patches)
    F_p = np.ones((1, 6))
    (found,) = patches.voltages(F_p).values()
    left = np.abs(patches.unmet(F_p, found.required)[0])
    assert found.served == served
    assert left[:served].max() < 1e-9
    assert served == 6 or left[served:].max() > 0.01
    if count < 6:
        with pytest.raises(InputError, match=rf"expected as many patches as modes \(6\) or more, found {count}"):
            check_allocation(SCENE, link_patches(SCENE, [layout], link, spatial))
