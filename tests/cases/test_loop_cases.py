"""Joints as built and closed loops, each through `ffrobot solve`; the tables of their READMEs hold."""

import numpy as np
import pytest
from checkpoints import check_table
from test_actuation_cases import peak, tip_error


@pytest.fixture(scope="module")
def geared(solved):
    return solved("geared_arm")


@pytest.fixture(scope="module")
def loops(solved):
    return solved("two_link_closed_loop")


def test_geared_arm(geared):
    ideal = np.loadtxt(geared.folder / "ideal.csv", delimiter=",", skiprows=2)
    measured = {}
    for k, joint in enumerate("OA"):
        group = geared.file[f"inverse/joints/{joint}"]
        without, built = ideal[:, 1 + k], group["moment"][()]
        difference = np.abs(built[::10] - without).max()
        measured[joint] = [peak(built), np.abs(without).max(), difference, peak(group["motor_moment"])]
    check_table("geared_arm", "joint", measured)


def test_geared_arm_carries_out_its_moments(geared):
    assert tip_error(geared.file, "forward", "inverse") < 5e-5
    energy = geared.file["inverse/energy/dissipated_power"][()]
    assert np.trapz(energy, geared.file["inverse/time"][()]) == pytest.approx(2.72, rel=0.01)  # noqa: NPY201


def test_closed_loops(loops):
    keys = ("tip_error_rms", "tip_error_max", "vibration", "residual", "peak_moment", "peak_voltage")
    runs = [name for name in loops.file if "control" in loops.file[name]]
    metrics = {name: loops.file[f"{name}/control"].attrs for name in runs}
    assert all(entry["verdict"] == "stable" for entry in metrics.values())
    check_table("two_link_closed_loop", "run", {f"`{n}`": [entry[key] for key in keys] for n, entry in metrics.items()})
    assert metrics["pd_patches_blow"]["residual"] < metrics["pd_blow"]["residual"] / 10
    assert metrics["lqr_blow"]["residual"] < metrics["moments_blow"]["residual"] / 1000


def test_closed_loops_are_told_of(loops, ffrobot):
    assert "lqr_blow" in loops.stdout
    assert "closed loop" in loops.stdout
    told = ffrobot("info", loops.folder / "scene.results.h5").stdout
    assert "closed loop" in told
    assert "/lqr_blow/control/commands" in told
