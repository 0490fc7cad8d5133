"""Peaks of histories that are cut off at a limit."""

import h5py
import numpy as np

from ffrobot.results.peaks import write_peaks


def test_no_peak_of_a_voltage_lies_above_its_limit():
    """With one sample at the limit the polynomial through it and its neighbors has its top above."""
    time = np.linspace(0.0, 1.0, 21)
    required = 204.0 * np.cos(5.0 * (time - 0.51))[:, None]
    with h5py.File("run", "w", driver="core", backing_store=False) as file:
        patches = file.create_group("pzt/link")
        patches.attrs["limit"] = 200.0
        found = {"pzt/link/voltage": np.clip(required, -200.0, 200.0), "pzt/link/required_voltage": required}
        write_peaks(file, time, found, np.arange(21))
        assert np.count_nonzero(np.abs(required) > 200.0) == 1
        assert patches["voltage"].attrs["peak"] == 200.0
        assert abs(patches["required_voltage"].attrs["peak"] - 204.0) < 0.01
