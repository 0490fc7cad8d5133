"""The spacecraft that turns its boom: what holds without outer forces."""

import numpy as np
import pytest


@pytest.mark.parametrize("name", ["slew", "again"])
def test_momentum_stays_nothing(name, slewing_appendage):
    """To 1e-12 of what the motor gives the boom and takes back, 5 N·m·s; linear momentum likewise, per metre."""
    slew, group = slewing_appendage.file["slew"], slewing_appendage.file[name]
    given = 0.5 * np.abs(slew["joints/drive/moment"]).mean() * slew["time"][-1]
    for kind in ("linear", "angular"):
        assert np.abs(group[f"momentum/{kind}"]).max() < 1e-12 * given


def test_the_motor_alone_makes_the_motion(slewing_appendage):
    one, other = (slewing_appendage.file[name] for name in ("slew", "again"))
    for key in ("points/boom.tip/position", "bodies/hub/angular_velocity", "bodies/boom/modal"):
        np.testing.assert_allclose(other[key], one[key], atol=1e-7 * np.abs(one[key]).max())


def test_its_work_is_the_energy_and_what_damping_takes(slewing_appendage):
    """By Simpson's rule over the outputs, 20 ms apart, of vibrations of 2 Hz and more."""
    group = slewing_appendage.file["slew"]
    t = group["time"][()]
    power = group["joints/drive/moment"][()] * group["joints/drive/rate"][()] - group["energy/dissipated_power"][()]
    energy = group["energy/kinetic"][()] + group["energy/strain"][()]
    work = (t[1] - t[0]) / 3 * np.cumsum(power[:-2:2] + 4 * power[1:-1:2] + power[2::2])
    np.testing.assert_allclose(energy[2::2] - energy[0], work, atol=1e-4 * energy.max())
