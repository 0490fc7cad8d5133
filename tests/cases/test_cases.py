"""The cases in 3D through `ffrobot solve`, against an independent code, and by what has to hold in any motion."""

import numpy as np
import pytest
from checkpoints import check_column, check_table, peak, reference

from ffrobot import Results

RELATIVE = 1e-6  # of each quantity's peak
ARM_RUNS = [("line", "static"), ("line", "undeformed"), ("circle", "static"), ("circle", "undeformed")]
ARM_LENGTHS = (0.7, 0.6)  # m, upper.toml and fore.toml


@pytest.fixture(scope="module")
def arm_runs(case_copy_of_module, ffrobot):
    """The arm on both paths from both starts, as its README says: by (path, start)."""
    found = {}
    for path, start in ARM_RUNS:
        folder = case_copy_of_module("arm_3r").parent
        scene = folder / {"line": "scene.toml", "circle": "circle.toml"}[path]
        text = scene.read_text(encoding="utf-8")
        assert 'state = "static"' in text
        scene.write_text(text.replace('state = "static"', f'state = "{start}"'), encoding="utf-8")
        ffrobot.ok("solve", scene)
        found[path, start] = Results(scene.with_suffix(".results.h5"))
    yield found
    for results in found.values():
        results.close()


class Columns:
    """What `check_column` asks of a solved case, of an open results file."""

    def __init__(self, results):
        self.file = {"inverse": results._file["inverse"]}

    def rows(self, analysis, times):
        output = self.file[analysis]["time"][()]
        rows = np.abs(output[:, None] - times).argmin(axis=0)
        np.testing.assert_allclose(output[rows], times, rtol=0, atol=1e-12)
        return rows


@pytest.mark.parametrize(("path", "start"), ARM_RUNS)
def test_arm_at_the_checkpoints(arm_runs, path, start):
    table = reference(f"arm_3r/reference_{path}_{start}.csv")
    times = np.array(table["t"], dtype=float)
    for name in table:
        if name != "t":
            check_column(Columns(arm_runs[path, start]), "inverse", name, times, table[name], RELATIVE)


def test_slider_crank_at_the_checkpoints(slider_crank_3d):
    table = reference("slider_crank_3d/reference.csv")
    for name in table:
        if name != "t":
            times = np.array(table["t"], dtype=float)
            check_column(slider_crank_3d, "inverse", name, times, table[name], RELATIVE)


def test_peaks_of_the_readme(arm_runs, slider_crank_3d):
    measured = {}
    for (path, start), results in arm_runs.items():
        deflection = 1e3 * np.abs(results["inverse/points/fore.tip/deflection"]).max(axis=0)
        moments = [np.abs(results[f"inverse/joints/{j}/moment"]).max() for j in ("waist", "shoulder", "elbow")]
        force = np.linalg.norm(results["inverse/trajectories/tool/force"], axis=1).max()
        measured[f"{path}, {start}"] = [*moments, force, *deflection[1:]]
    check_table("arm_3r", "run", measured)
    group = slider_crank_3d.file["inverse"]
    y, z = 1e3 * np.abs(group["points/rod.mid/deflection"][:, 1:]).max(axis=0)
    force, moment = peak(group["trajectories/slider/force"]), peak(group["joints/crank/moment"])
    axial = peak(group["bodies/rod/modal_force"][:, -1])
    check_table("slider_crank_3d", "largest", {"value": [force, moment, y, z, axial]})


@pytest.mark.parametrize(("path", "start"), ARM_RUNS)
def test_arm_is_on_its_path_and_in_one_piece(arm_runs, path, start):
    """From the outputs alone: the tip, the two joints, the lengths of links that hardly stretch."""
    results = arm_runs[path, start]
    at = {name: results[f"inverse/points/{name}/position"] for name in ("column.top", "upper.root", "upper.tip",
                                                                       "fore.root", "fore.tip")}  # fmt: skip
    np.testing.assert_allclose(at["fore.tip"], results["inverse/trajectories/tool/target"], rtol=0, atol=1e-9)
    np.testing.assert_allclose(at["column.top"], at["upper.root"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(at["upper.tip"], at["fore.root"], rtol=0, atol=1e-12)
    for (one, other), length in zip((("upper.root", "upper.tip"), ("fore.root", "fore.tip")), ARM_LENGTHS, strict=True):
        deflection = results[f"inverse/points/{other}/deflection"]
        chord = np.linalg.norm(at[other] - at[one], axis=1)
        np.testing.assert_allclose(
            chord, np.hypot(length + deflection[:, 0], np.hypot(*deflection[:, 1:].T)), atol=1e-12
        )


@pytest.mark.parametrize("path", ["line", "circle"])
def test_work_of_force_and_moments_is_the_change_of_energy(arm_runs, path):
    """Of the static start: power of the force on the tip, less what 0.5 % of damping takes, is the rate of the energy.

    The damping is that of the link files: 2 ζ ω ṗ² for each mode.
    """
    results = arm_runs[path, "static"]
    t, force = results["inverse/time"], results["inverse/trajectories/tool/force"]
    target = results["inverse/trajectories/tool/target"]
    power = np.sum(force * np.gradient(target, t, axis=0, edge_order=2), axis=1)
    for name in ("upper", "fore"):
        body, rates = results.modal_body(name), results[f"inverse/bodies/{name}/modal_velocity"]
        power -= (rates**2) @ (2 * body.damping_ratio * 2 * np.pi * body.frequency)
    energy = sum(results[f"inverse/energy/{kind}"] for kind in ("kinetic", "strain", "gravitational"))
    work = np.append(0.0, np.cumsum(0.5 * np.diff(t) * (power[1:] + power[:-1])))
    change = energy - energy[0]
    # trapezia over steps of 5 ms under forces that ring at up to 15 Hz: (ω h)²/12 of each swing
    assert np.abs(work - change).max() < 0.02 * np.abs(change).max()


def test_loop_is_closed(slider_crank_3d):
    """From the outputs alone: the crank's circle about its axis, the pin on the guide, both ends of the rod."""
    group = slider_crank_3d.file["inverse"]
    at = {name: group[f"points/{name}/position"][()] for name in ("crank.tip", "rod.root", "rod.tip", "slider.pin")}
    np.testing.assert_allclose(at["crank.tip"], at["rod.root"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(at["rod.tip"], at["slider.pin"], rtol=0, atol=1e-10)
    np.testing.assert_allclose(at["slider.pin"][:, 0], 0.42 + 0.08 * np.sin(30 * group["time"][()]), rtol=0, atol=1e-10)
    np.testing.assert_allclose(at["slider.pin"][:, 1:], np.tile([0.03, 0.1], (len(at["crank.tip"]), 1)), atol=1e-10)
    axis = np.array([0.19047253607043549, -0.47618134017608871, 0.85847046790847781])  # scene.toml
    np.testing.assert_allclose(at["crank.tip"] @ axis, 0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(at["crank.tip"], axis=1), 0.12, atol=1e-12)


def test_slider_moves_by_its_own_forces(slider_crank_3d):
    """Newton's law of the slider, 0.3 kg: path, guide, ball and weight give m ẍ; across the guide, nothing."""
    group = slider_crank_3d.file["inverse"]
    total = group["joints/ball/reaction"][()] + group["joints/guide/reaction"][()] + 0.3 * np.array([0.0, 0.0, -9.81])
    total[:, 0] += group["trajectories/slider/force"][:, 0]
    expected = np.zeros_like(total)
    expected[:, 0] = -0.3 * 0.08 * 30**2 * np.sin(30 * group["time"][()])
    np.testing.assert_allclose(total, expected, rtol=0, atol=1e-8 * np.abs(total).max())
    assert np.abs(group["joints/guide/reaction"][:, 0]).max() < 1e-9 * np.abs(total).max()
