"""One case per capability of actuation, each through `ffrobot solve`; the tables of their READMEs hold."""

import numpy as np
import pytest
from checkpoints import check_table, peak, tip_error


def vibration(file, analysis, window=100):
    """Largest deflection of link 2's tip from its moving average over 0.1 s, m."""
    deflection = file[f"{analysis}/points/link2.tip/deflection"][:, 1]
    mean = np.convolve(deflection, np.full(window + 1, 1 / (window + 1)), "valid")
    return float(np.abs(deflection[window // 2 : -window // 2] - mean).max())


@pytest.fixture(scope="module")
def fcid(solved):
    return solved("two_link_fcid").file


@pytest.fixture(scope="module")
def split(solved):
    return solved("two_link_split").file


@pytest.fixture(scope="module")
def slew(solved):
    return solved("straight_slew")


def test_fcid_against_pcid(fcid):
    """Moments and voltages as the README has them; the time is that of algebra against that of an integration."""
    measured = {}
    for name in ("inverse", "straight", "sagging"):
        group = fcid[name]
        measured[f"`{name}`"] = [
            *(peak(group[f"joints/{joint}/moment"]) for joint in "OA"),
            *(peak(group[f"pzt/{body}/required_voltage"]) for body in ("link1", "link2")),
        ]
        assert group.attrs["integrator"] == ("dop853" if name == "inverse" else "none")
    check_table("two_link_fcid", "analysis", measured)
    seconds = {name: fcid[name].attrs["wall_seconds"] for name in measured_names(measured)}
    assert seconds["straight"] < 0.1 * seconds["inverse"]


def measured_names(measured):
    return [name.strip("`") for name in measured]


@pytest.mark.parametrize("name", ["straight", "sagging"])
def test_forward_runs_keep_path_and_shape_of_fcid(fcid, name):
    assert tip_error(fcid, f"{name}_forward", name) < 1e-10
    tip = "points/link2.tip/deflection"
    assert np.abs(fcid[f"{name}_forward/{tip}"][()] - fcid[f"{name}/{tip}"][()]).max() < 1e-10


def test_split_of_duties(split):
    """The table of the README; errors below 1e-9 m count as none."""
    source = dict.fromkeys(("full", "limited", "motors"), "inverse")
    source |= dict.fromkeys(("split_forward", "split_motors"), "split")
    measured = {}
    for name, of in source.items():
        volts = {"motors": 0.0, "split_motors": 0.0}.get(name)
        if volts is None:
            which = "required_voltage" if name == "full" else "voltage"
            volts = max(peak(split[f"{of}/pzt/{body}/{which}"]) for body in ("link1", "link2"))
        measured[f"`{name}`"] = [volts, tip_error(split, name, of), vibration(split, name)]
    check_table("two_link_split", "run", measured, smallest=1e-9)


def test_split_of_duties_stays_within_the_limits(split):
    for body in ("link1", "link2"):
        group = split[f"split/pzt/{body}"]
        assert peak(group["required_voltage"]) < 0.01 * 200.0
        np.testing.assert_allclose(group["voltage"], group["required_voltage"], rtol=1e-12, atol=1e-12)
        assert np.all(split[f"split/feasibility/pzt/{body}/factor"][()] < 0.01)
    assert np.max(split["inverse/feasibility/pzt/link1/factor"]) == pytest.approx(488.5, rel=1e-3)  # 97.7 kV


def test_point_forces_reproduce_the_motion(solved):
    file = solved("two_link_points").file
    for source, forward in (("inverse", "points"), ("straight", "straight_points")):
        assert tip_error(file, forward, source) < 1e-10
        for body in ("link1", "link2"):
            group = file[f"{source}/actuation_points/{body}"]
            assert group.attrs["rank"] == 13
            assert group["force"].shape == (301, 13)
            assert group["residual"].shape == (301,)
            rounding = 1e-15 * group.attrs["condition_number"]
            assert peak(group["residual"]) <= rounding * peak(group["force"])
            for name in ("angle", "modal"):
                of_both = [file[f"{analysis}/bodies/{body}/{name}"][()] for analysis in (source, forward)]
                assert np.abs(of_both[1] - of_both[0]).max() < 1e-9
    conditions = [file[f"straight/actuation_points/{body}"].attrs["condition_number"] for body in ("link1", "link2")]
    assert conditions[0] < 10 < conditions[1] < 1e4


def test_patches_that_are_part_of_their_links(solved, two_link):
    file = solved("two_link_patched").file
    measured = {}
    for body in ("link1", "link2"):
        group = file[f"inverse/patch_structure/{body}"]
        bare, patched = group["frequency"][()]
        change = 100 * (patched / bare - 1)
        measured[body] = [*np.diff(group["mass"][()]), *change[[0, 4, 9]]]
        np.testing.assert_allclose(group["mass"][0], 7850.0 * 0.025 * 0.015, rtol=1e-12)
        np.testing.assert_allclose(np.diff(group["mass"][()]), 10 * 7600 * 0.05 * 0.025 * 0.75e-3, rtol=1e-9)
    check_table("two_link_patched", "link", measured)
    ratios = {}
    for name in ("joints/O/moment", "joints/A/moment", "pzt/link1/required_voltage", "pzt/link2/required_voltage"):
        ratios[f"`{name}`"] = [peak(two_link.file[f"inverse/{name}"]), peak(file[f"inverse/{name}"])]
    check_table("two_link_patched", "peak of", ratios)


def slew_deflections(file):
    names = ("motor", "limited", "unlimited")
    return {name: peak(file[f"{name}/points/arm.tip/deflection"][:, 1]) for name in names}


def test_straight_slew(slew):
    measured = {f"`{name}`": [size] for name, size in slew_deflections(slew.file).items()}
    check_table("straight_slew", "run", measured)
    group = slew.file["straight/pzt/arm"]
    limits = np.array([30.0, 30.0, 20.0, 20.0])
    assert np.all(np.abs(group["voltage"][()]) <= limits)
    assert np.any(np.abs(group["voltage"][()]) == limits)
    predicted = peak(np.linalg.norm(slew.file["straight/points/arm.tip/predicted_shift"][()], axis=1))
    assert predicted == pytest.approx(measured["`limited`"][0], rel=0.1)
    assert "limits exceeded: patches of arm (required/available = 5.53" in slew.stdout


def test_table_of_what_actuators_can_do(slew, ffrobot):
    done = ffrobot.ok("feasibility", slew.folder / "scene.results.h5")
    lines = done.stdout.splitlines()
    assert any(line.startswith("O ") and line.endswith("yes") for line in lines)
    patches = [line for line in lines if line.startswith("patch ")]
    assert [line.endswith("no") for line in patches] == list(slew.file["straight/feasibility/pzt/arm/factor"][()] > 1)
    assert sum(line.startswith("mode ") for line in lines) == 6
    assert any(line.startswith("sufficient alone: a limit of") for line in lines)


@pytest.mark.parametrize("weights", ["point_weights = { tip = 1.0 }", ""])
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
