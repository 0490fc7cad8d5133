"""Screening by elementary effects: functions whose effects on the grid are closed forms, and scenes."""

import csv

import numpy as np
import pytest
import tomli_w
from small_robots import ARM, MASS, PAYLOAD, SWING

import ffrobot
from ffrobot.design.screening import draw_trajectories, elementary_effects


def test_a_trajectory_changes_every_key_once_on_the_levels_of_the_grid():
    taken = draw_trajectories(7, 20, seed=4)
    assert taken.points.shape == (20, 8, 7)
    assert set(np.round(3.0 * np.unique(taken.points.round(12)), 9)) == {0.0, 1.0, 2.0, 3.0}
    steps = np.diff(taken.points, axis=1)
    np.testing.assert_array_equal(np.count_nonzero(steps, axis=1), 1)  # of each key
    np.testing.assert_allclose(np.abs(steps).sum(axis=2), 2.0 / 3.0)  # in each step
    starts = np.sort(taken.points[:, 0], axis=0).round(9)
    np.testing.assert_allclose(starts, np.repeat([[0.0], [1 / 3], [2 / 3], [1.0]], 5, axis=0) * np.ones(7), atol=1e-9)


def test_ishigami():
    """sin x₁ + 7 sin² x₂ + 0.1 x₃⁴ sin x₁ on [−π, π]³: on four levels effects are sums over ±π and ±π/3.

    μ* of x₂ and x₃ are 7.875 and 6.25, as others report of this grid.
    """
    taken = draw_trajectories(3, 4000, seed=2)
    x = np.pi * (2.0 * taken.points - 1.0)
    f = np.sin(x[..., 0]) + 7.0 * np.sin(x[..., 1]) ** 2 + 0.1 * x[..., 2] ** 4 * np.sin(x[..., 0])
    found = elementary_effects(taken, f[:, :, None])
    outer, inner = np.pi**4, (np.pi / 3.0) ** 4  # of x₃⁴, alike
    root = np.sqrt(3.0) / 2.0  # |sin π/3|; sin π is 0
    first = 1.5 * root * (1.0 + 0.05 * (outer + inner))
    third = 1.5 * 0.1 * (outer - inner) * root / 2.0
    expected = np.array([first, 1.5 * 7.0 * root**2, third])
    assert np.all(np.abs(found.mu_star[0] - expected) <= 4.0 * found.mu_star_error[0] + 1e-12)
    np.testing.assert_allclose(expected[1:], [7.875, 6.25], rtol=1e-3)
    np.testing.assert_allclose(found.mu_star_error[0], [0.0995, 0.0, 0.0988], atol=2e-3)
    assert found.sigma[0, 1] == pytest.approx(7.875, rel=1e-3)  # effects are ±7.875
    assert found.mu[0, 0] == pytest.approx(found.mu_star[0, 0], rel=1e-12)  # up from −π and down from π/3 alike


def test_sobol_g():
    """Π (|4u − 2| + a)/(1 + a): on four levels |4u − 2| is 2 or 2/3, so that μ* is 2/(1 + a) and the others' means."""
    a = np.array([0.0, 1.0, 4.5, 99.0])
    taken = draw_trajectories(4, 4000, seed=5)
    f = np.prod((np.abs(4.0 * taken.points - 2.0) + a) / (1.0 + a), axis=2)
    found = elementary_effects(taken, f[:, :, None])
    means = (4.0 / 3.0 + a) / (1.0 + a)
    expected = 2.0 / (1.0 + a) * np.prod(means) / means
    assert np.all(np.abs(found.mu_star[0] - expected) < 4.0 * found.mu_star_error[0])
    assert found.mu_star_error.max() < 0.02


def test_a_failed_run_costs_the_effects_beside_it_alone():
    taken = draw_trajectories(3, 2, seed=0)
    f = (taken.points @ np.array([1.0, 2.0, 4.0]))[:, :, None]
    f[0, 1] = np.nan
    found = elementary_effects(taken, f)
    lost = taken.order[0, :2]
    np.testing.assert_array_equal(found.count[0], [1 if k in lost else 2 for k in range(3)])
    np.testing.assert_allclose(found.mu[0], [1.0, 2.0, 4.0], atol=1e-12)
    assert np.isnan(found.sigma[0, lost]).all()
    f[1] = np.nan
    again = elementary_effects(taken, f)
    assert np.isnan(again.mu_star[0, lost]).all()


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(tomli_w.dumps(ARM), encoding="utf-8")
    return path


def test_screening_of_a_rigid_arm(scene):
    """The moment at the start is linear in both masses: μ* is the slope times the whole spread, a normal one ±2σ."""
    spreads = [f"{MASS}=±10%", f"{PAYLOAD}=normal:5%"]
    found = ffrobot.screening(scene, ["peak joints.shoulder.moment"], spreads, trajectories=3)
    slopes = np.array([9.81 * 0.3 + 2.0 * 0.3**2, 9.81 * 0.6 + 2.0 * 0.6**2])
    np.testing.assert_allclose(found.effects.mu[0], slopes * [0.4, 0.1], rtol=1e-6)
    assert found.effects.sigma.max() < 1e-6
    assert found.runs <= 1 + 3 * 3
    assert not found.failures


@pytest.mark.parametrize(
    "by", [("gradients",), ("samples", "--samples", 8, "--indices"), ("screening", "--trajectories", 2)]
)
def test_keys_that_change_nothing(ffrobot, scene, by):
    """Payloads are not counted in the mass: no division by a variance of 0."""
    done = ffrobot.ok("uncertainty", scene, "--of", "mass", "--spread", f"{PAYLOAD}=±5%", "--no-figures", "--by", *by)
    assert "note       mass: none of the keys changes it" in done.stdout
    assert "nan" not in done.stdout


def test_failed_runs_are_told_and_left_out(ffrobot, tmp_path):
    """Tubes whose hole is wider than they are: only with both keys at their worse ends, which runs alone show."""
    path = tmp_path / "scene.toml"
    path.write_text(tomli_w.dumps(SWING), encoding="utf-8")
    outer, inner = (f"links.arm.geometry.section.{name}" for name in ("outer", "inner"))
    spreads = ("--spread", f"{outer}=±0.0025", "--spread", f"{inner}=±0.0025")
    command = ("uncertainty", path, "--of", "mass", *spreads, "--by", "screening", "--trajectories", 8, "-j", 2)
    done = ffrobot.ok(*command)
    folder = tmp_path / "scene.uncertainty"
    with (folder / "table.csv").open(encoding="utf-8") as file:
        runs = list(csv.DictReader(file))
    failed = [run for run in runs if float(run[inner]) >= float(run[outer])]
    assert len(failed) == 1
    assert f"failed     {len(failed)} of {len(runs)} runs, left out: {outer} = 0.0175, {inner} = 0.0185" in done.stdout
    with (folder / "screening.csv").open(encoding="utf-8") as file:
        rows = {row["key"]: row for row in csv.DictReader(file)}
    fewer = {key: row["effects"] for key, row in rows.items() if row["effects"] != "8"}
    assert fewer
    for key, count in fewer.items():
        assert f"note       mass by {key}: {count} of 8 effects" in done.stdout
    slope = 0.5 * np.pi * 2700.0 * 0.6  # of the mass, π/4 ρ L (d_o² − d_i²), by d: steps give it within a twentieth
    assert float(rows[outer]["mu"]) == pytest.approx(slope * 0.02 * 0.005, rel=0.05)
    assert float(rows[inner]["mu"]) == pytest.approx(-slope * 0.016 * 0.005, rel=0.06)
    assert (folder / "screening_mass.png").stat().st_size > 1000
    again = ffrobot(*command)
    assert again.stdout == done.stdout
