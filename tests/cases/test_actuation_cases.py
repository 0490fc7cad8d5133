"""Cases of actuation and control, each through `ffrobot solve`: identities and closed forms."""

import re

import numpy as np
import pytest
from checkpoints import peak, tip_error


@pytest.fixture(scope="module")
def slew(solved):
    return solved("straight_slew")


@pytest.fixture(scope="module")
def linear(solved):
    return solved("two_link_linear")


@pytest.mark.parametrize("name", ["straight", "sagging"])
def test_forward_runs_keep_path_and_shape_of_fcid(solved, name):
    fcid = solved("two_link_fcid").file
    assert tip_error(fcid, f"{name}_forward", name) < 1e-10
    tip = "points/link2.tip/deflection"
    assert np.abs(fcid[f"{name}_forward/{tip}"][()] - fcid[f"{name}/{tip}"][()]).max() < 1e-10


@pytest.mark.nightly
def test_split_of_duties_stays_within_the_limits(solved):
    split = solved("two_link_split").file
    for body in ("link1", "link2"):
        group = split[f"split/pzt/{body}"]
        assert peak(group["required_voltage"]) < 0.01 * 200.0
        np.testing.assert_allclose(group["voltage"], group["required_voltage"], rtol=1e-12, atol=1e-12)
        assert np.all(split[f"split/feasibility/pzt/{body}/factor"][()] < 0.01)


@pytest.mark.nightly
def test_point_forces_reproduce_the_motion(solved):
    file = solved("two_link_points").file
    for source, forward in (("inverse", "points"), ("straight", "straight_points")):
        assert tip_error(file, forward, source) < 1e-10
        for body in ("link1", "link2"):
            group = file[f"{source}/actuation_points/{body}"]
            assert group.attrs["rank"] == 13
            rounding = 1e-15 * group.attrs["condition_number"]
            assert peak(group["residual"]) <= rounding * peak(group["force"])
            for name in ("angle", "modal"):
                of_both = [file[f"{analysis}/bodies/{body}/{name}"][()] for analysis in (source, forward)]
                assert np.abs(of_both[1] - of_both[0]).max() < 1e-9
    conditions = [file[f"straight/actuation_points/{body}"].attrs["condition_number"] for body in ("link1", "link2")]
    assert conditions[0] < 10 < conditions[1] < 1e4


def test_patches_that_are_part_of_their_links(solved):
    """Masses of the bars and of ten pairs of patches."""
    file = solved("two_link_patched").file
    for body in ("link1", "link2"):
        mass = file[f"inverse/patch_structure/{body}/mass"][()]
        np.testing.assert_allclose(mass[0], 7850.0 * 0.025 * 0.015, rtol=1e-12)
        np.testing.assert_allclose(np.diff(mass), 10 * 7600 * 0.05 * 0.025 * 0.75e-3, rtol=1e-9)


def slew_deflections(file):
    return {name: peak(file[f"{name}/points/arm.tip/deflection"][:, 1]) for name in ("motor", "limited", "unlimited")}


def test_voltages_of_the_straight_slew_saturate(slew):
    """What is predicted of the deflection that this leaves is what the run finds."""
    voltage = np.abs(slew.file["straight/pzt/arm/voltage"][()])
    limits = np.array([30.0, 30.0, 20.0, 20.0])
    assert np.all(voltage <= limits)
    assert np.any(voltage == limits)
    predicted = peak(np.linalg.norm(slew.file["straight/points/arm.tip/predicted_shift"][()], axis=1))
    assert predicted == pytest.approx(slew_deflections(slew.file)["limited"], rel=0.1)
    assert "limits exceeded: patches of arm (required/available = 5.53" in slew.stdout


def test_table_of_what_actuators_can_do(slew, ffrobot):
    done = ffrobot.ok("feasibility", slew.folder / "scene.results.h5")
    lines = done.stdout.splitlines()
    assert any(line.startswith("O ") and line.endswith("yes") for line in lines)
    patches = [line for line in lines if line.startswith("patch ")]
    assert [line.endswith("no") for line in patches] == list(slew.file["straight/feasibility/pzt/arm/factor"][()] > 1)
    assert sum(line.startswith("mode ") for line in lines) == 6
    assert any(line.startswith("sufficient alone: a limit of") for line in lines)


@pytest.mark.parametrize("weights", ["point_weights = { tip = 1.0 }", pytest.param("", marks=pytest.mark.nightly)])
def test_more_patches_than_modes_saturate_as_well(solved, weights):
    """Twelve pairs for six modes, one limit: many voltages would do, few are within it; forward runs go through."""
    edits = {
        "centers = [0.04, 0.14, 0.24, 0.36]\nlength = 0.06": "count = 12\nlength = 0.04",
        "limit = [30.0, 30.0, 20.0, 20.0]": "limit = 20.0",
        'allocation = "least-squares"\n': "",
        "point_weights = { tip = 1.0, mid = 0.2 }": weights,
    }

    def edit(text):
        for old, new in edits.items():
            assert old in text
            text = text.replace(old, new)
        return text

    file = solved("straight_slew", edit).file
    assert file["limited"].attrs["status"] == "completed"
    deflection = slew_deflections(file)
    assert deflection["unlimited"] < 1e-9
    # 20 V hold a third of what they would without the patches' own stiffness, ψ = 4.4
    assert 1e-3 < deflection["limited"] < 0.9 * deflection["motor"]


def test_tip_zeros_are_those_of_a_hinged_beam(linear):
    """2 x² √(EI/ρA)/L², x = 2.36502037 the first root of tan x = −tanh x; EI/ρA from cases/two_link/link1.toml."""
    rate = np.sqrt(2.068427e11 * 0.015**2 / 12 / 7850.0)
    (zeros,) = [
        of[0] for of in linear.file["at_rest/linear/zeros"].values()
        if list(of.attrs["outputs"]) == ["point/link2.tip/x", "point/link2.tip/y"]
    ]  # fmt: skip
    assert zeros[:, 0].max(where=zeros[:, 0] < 249.0, initial=0.0) == pytest.approx(2 * 2.36502037**2 * rate, rel=2e-3)


def test_every_mode_is_reached_and_seen(linear):
    for kind in ("controllability", "observability"):
        assert list(linear.file[f"at_rest/linear/{kind}"].attrs["lost"]) == []
    assert "non-minimum phase" in linear.stdout
    assert "joint/O, joint/A → joint/O, joint/A: minimum phase" in linear.stdout


def test_patches_found_beat_even_spacing(solved):
    placement = solved("two_link_placement").file
    for name in ("reach_link1", "reach_link2", "path_link1", "path_link2", "eight_link2"):
        group = placement[f"{name}/placement"]
        assert np.diff(group["best/centers"][()]).min() > 0.05 - 1e-9
        assert group["best/value"][()] >= group["even/value"][()]


def test_geared_arm_carries_out_its_moments(solved):
    file = solved("geared_arm").file
    assert tip_error(file, "forward", "inverse") < 5e-5
    energy = file["inverse/energy/dissipated_power"][()]
    assert np.trapz(energy, file["inverse/time"][()]) == pytest.approx(2.72, rel=0.01)  # noqa: NPY201


def test_motors_and_joints_as_places_of_encoders(solved):
    """High gains on the far side of a spring drive the mode in which motor and link turn against each other."""
    file = solved("compliant_arm").file
    firm = {place: file[f"firm_{place}/control"].attrs for place in ("motor", "joint")}
    assert firm["motor"]["verdict"] == "stable"
    assert firm["joint"]["verdict"] == "diverges"
    assert set(firm["motor"]["outputs"]) == {"motor/O", "motor/A", "motor/O/rate", "motor/A/rate"}


def test_closed_loops_are_told_of(solved, ffrobot):
    loops = solved("compliant_arm")
    assert re.search(r"pd_motor +stable", loops.stdout)
    told = ffrobot("info", loops.folder / "scene.results.h5").stdout
    assert re.search(r"pd_motor +stable", told)
    assert "/pd_motor/control/commands" in told
