"""Which loads are told to buckle a link: by their size and by how long they last."""

import numpy as np
import pytest

from ffrobot.mbs.quantities.second_order import ModalLoads, lasting, stiffness_change


@pytest.mark.parametrize(("duration", "buckles"), [(1e-6, False), (0.05, False), (0.8, True), (20.0, True)])
def test_loads_shorter_than_a_vibration_buckle_no_link(duration, buckles):
    """1.5 times the load of Euler: a pulse buckles if its mean over the period, here 1 s, reaches that load."""
    time = np.unique(
        np.concatenate([np.linspace(0.0, 20.0, 2001), 5.0 + duration * np.array([0.0, 1e-9, 1 - 1e-9, 1])])
    )
    stiffness = np.array([(2 * np.pi) ** 2, (20 * np.pi) ** 2])
    pulse = 1.5 * stiffness[0] * ((time > 5.0) & (time < 5.0 + duration))
    loads = ModalLoads(pulse[:, None], -np.eye(2)[None], stiffness)
    assert stiffness_change(loads).buckling == pytest.approx(1.5)
    found = stiffness_change(lasting(loads, time)).buckling
    assert found == pytest.approx(1.5 * min(duration, 1.0), rel=0.02, abs=1e-5)
    assert (found >= 1.0) == buckles
