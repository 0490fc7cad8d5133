"""The paper's slider-crank through `ffrobot solve`: a closed loop, a rigid crank, a damped flexible rod."""

import numpy as np
import pytest
from checkpoints import check_column, reference

CHECKPOINTS = reference("slider_crank/reference.csv")
RELATIVE = 1e-6  # of each quantity's peak
TIMES = np.arange(201) * 0.001
TIMES[-1] = 0.2


@pytest.mark.parametrize("name", [name for name in CHECKPOINTS if name != "t"])
def test_checkpoints(slider_crank, name):
    times = np.array(CHECKPOINTS["t"], dtype=float)
    check_column(slider_crank, "inverse", name, times, CHECKPOINTS[name], RELATIVE)
