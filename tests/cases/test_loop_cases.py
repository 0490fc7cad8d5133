"""Joints as built and closed loops, each through `ffrobot solve`; the tables of their READMEs hold."""

import re

import numpy as np
import pytest
from checkpoints import TABLES, check_table, peak, readme_table, tip_error

from ffrobot.pictures.figures.standard import standard_figures
from ffrobot.results.file import Results


@pytest.fixture(scope="module")
def geared(solved):
    return solved("geared_arm")


@pytest.fixture(scope="module")
def loops(solved):
    return solved("two_link_closed_loop")


@pytest.fixture(scope="module")
def compliant(solved):
    return solved("compliant_arm")


@pytest.fixture(scope="module")
def rigid_gears(solved):
    """The compliant arm without its springs, nor the loops that need them."""
    return solved("compliant_arm", lambda text: re.sub(r"(stiffness|damping) = .*\n", "", text).partition("# PD of")[0])


@pytest.fixture(scope="module")
def rest_to_rest(solved):
    return solved("two_link_rest_to_rest")


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


METRICS = ("tip_error_rms", "tip_error_max", "vibration", "residual", "peak_moment", "peak_voltage")


def check_runs(case, name, keys=METRICS):
    """The metrics of all closed loops of a case, by run; those of stable ones against its README."""
    runs = [run for run in case.file if "control" in case.file[run]]
    metrics = {run: case.file[f"{run}/control"].attrs for run in runs}
    stable = {run: entry for run, entry in metrics.items() if entry["verdict"] == "stable"}
    check_table(name, "run", {f"`{run}`": [entry[key] for key in keys] for run, entry in stable.items()})
    return metrics


def test_compliant_arm(compliant, rigid_gears):
    frequencies, largest = {}, {}
    for gears, case in (("as built", compliant), ("rigid", rigid_gears)):
        frequencies[gears] = case.file["frequencies/linear/frequency"][0][2:6]
    check_table("compliant_arm", "gears", frequencies)
    for joint in "OA":
        group, rigid = (case.file[f"inverse/joints/{joint}"] for case in (compliant, rigid_gears))
        largest[joint] = [peak(group["gear_moment"]), peak(group["moment"]), peak(rigid["moment"])]
        np.testing.assert_allclose(group["motor_moment"][()] * 100, group["moment"][()])
    check_table("compliant_arm", "joint", largest)
    assert tip_error(compliant.file, "forward", "inverse") == pytest.approx(8.1e-7, rel=0.1)
    assert not any("no actuator provides" in text for text in compliant.file["inverse"].attrs["warnings"])


def test_static_analyses_are_no_histories(compliant):
    """An analysis of one instant has no curve of its own: neither a force over time, nor modal coordinates."""
    with Results(compliant.folder / "scene.results.h5") as results:
        drawn = {record.name: record for record in standard_figures(results) if record.kind == "time"}
    assert "force_tip" not in drawn  # only the static analysis has it
    assert any("_inverse" in name for name in drawn)
    assert not any("_frequencies" in name for name in drawn)


def test_motors_and_joints_as_places_of_encoders(compliant):
    """High gains on the far side of a spring drive the mode in which motor and link turn against each other."""
    metrics = check_runs(compliant, "compliant_arm", ("tip_error_rms", "tip_error_max", "vibration"))
    assert metrics["firm_motor"]["verdict"] == "stable"
    assert metrics["firm_joint"]["verdict"] == "diverges"
    assert set(metrics["firm_motor"]["outputs"]) == {"motor/O", "motor/A", "motor/O/rate", "motor/A/rate"}


def test_closed_loops(loops):
    metrics = check_runs(loops, "two_link_closed_loop")
    assert metrics["lqr"]["vibration"] < metrics["pd"]["vibration"] / 10
    assert metrics["moments"]["vibration"] / metrics["lqr"]["vibration"] == pytest.approx(290, rel=0.02)


def test_all_ways_along_one_path(rest_to_rest):
    """The issue's table: by how much motors and patches within their limits beat joint moments alone."""
    metrics = check_runs(rest_to_rest, "two_link_rest_to_rest")
    driven_by_patches = ("pd_patches", "pd_patches_blow", "lqr", "lqr_blow")
    assert all(metrics[run]["peak_voltage"] <= 200 for run in driven_by_patches)
    table = "two_link_rest_to_rest", "times less"
    factors, allowed = readme_table(*table), TABLES[table]
    for label, key in (("rms", "tip_error_rms"), ("vibration", "vibration")):
        for way, run in (("PD and patches", "pd_patches"), ("LQR", "lqr")):
            found = [metrics[f"{run}{blow}"][key] / metrics[f"moments{blow}"][key] for blow in ("", "_blow")]
            np.testing.assert_allclose(1 / np.array(found), factors[f"{label}, {way}"], rtol=allowed)


def test_closed_loops_are_told_of(loops, ffrobot):
    assert "lqr_blow" in loops.stdout
    assert "closed loop" in loops.stdout
    told = ffrobot("info", loops.folder / "scene.results.h5").stdout
    assert "closed loop" in told
    assert "/lqr_blow/control/commands" in told
