"""Cases of actuation and control, each through `ffrobot solve`: what saturates, and what the tables tell."""

import numpy as np
import pytest
from checkpoints import peak


def test_voltages_of_the_straight_slew_saturate(solved):
    """What is predicted of the deflection that this leaves is what the run finds."""
    slew = solved("straight_slew")
    voltage = np.abs(slew.file["straight/pzt/arm/voltage"][()])
    limits = np.array([30.0, 30.0, 20.0, 20.0])
    assert np.all(voltage <= limits)
    assert np.any(voltage == limits)
    predicted = peak(np.linalg.norm(slew.file["straight/points/arm.tip/predicted_shift"][()], axis=1))
    assert predicted == pytest.approx(peak(slew.file["limited/points/arm.tip/deflection"][:, 1]), rel=0.1)
    assert "limits exceeded: patches of arm (required/available = 5.53" in slew.stdout


def test_table_of_what_actuators_can_do(solved, ffrobot):
    slew = solved("straight_slew")
    done = ffrobot.ok("feasibility", slew.folder / "scene.results.h5")
    lines = done.stdout.splitlines()
    assert any(line.startswith("O ") and line.endswith("yes") for line in lines)
    patches = [line for line in lines if line.startswith("patch ")]
    assert [line.endswith("no") for line in patches] == list(slew.file["straight/feasibility/pzt/arm/factor"][()] > 1)
    assert sum(line.startswith("mode ") for line in lines) == 6
    assert any(line.startswith("sufficient alone: a limit of") for line in lines)


def test_every_mode_is_reached_and_seen(solved):
    linear = solved("two_link_linear")
    for kind in ("controllability", "observability"):
        assert list(linear.file[f"at_rest/linear/{kind}"].attrs["lost"]) == []
    assert "non-minimum phase" in linear.stdout
    assert "joint/O, joint/A → joint/O, joint/A: minimum phase" in linear.stdout
