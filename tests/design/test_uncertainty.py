"""`ffrobot uncertainty`: closed forms, functions with known Sobol indices, bands two ways, failed samples."""

from math import sqrt

import numpy as np
import pytest
from scipy.stats import norm, qmc
from small_robots import ARM, MASS, PAYLOAD, rows

import ffrobot
from ffrobot.design.spreads import LEVELS, Spread, linear_statistics, parse_spread, sobol_indices, statistics
from ffrobot.design.uncertainty_record import with_error

MOMENT = "joints.shoulder.moment"
SLOPES = np.array([9.81 * 0.3 + 2.0 * 0.3**2, 9.81 * 0.6 + 2.0 * 0.6**2])
"""Of the moment at the start, level and with 2 rad/s², by both masses."""


@pytest.mark.parametrize(
    ("text", "kind", "mean", "deviation"),
    [
        ("payload.0.mass=±2%", "uniform", 0.5, 0.01 / sqrt(3.0)),
        ("payload.0.mass=+-0.1", "uniform", 0.5, 0.1 / sqrt(3.0)),
        ("payload.0.mass=uniform:0.2:0.6", "uniform", 0.4, 0.4 / sqrt(12.0)),
        ("payload.0.mass=normal:0.03", "normal", 0.5, 0.03),
        ("gravity.1=normal:1%", "normal", -9.81, 0.0981),
    ],
)
def test_what_spreads_say(write, text, kind, mean, deviation):
    found = parse_spread(text, write(ARM))
    assert found.kind == kind
    assert found.mean == pytest.approx(mean, rel=1e-14)
    assert found.deviation == pytest.approx(deviation, rel=1e-14)
    values = found.values((np.arange(100_000) + 0.5) / 100_000)
    assert values.mean() == pytest.approx(mean, rel=1e-9)
    assert values.std() == pytest.approx(deviation, rel=1e-3)  # the tails of a normal one are cut a little


def test_sampling_errors_are_what_repetitions_show():
    """Of 2000 experiments with 300 samples each: a skewed quantity, x + x²/10 with x normal."""
    x = np.random.default_rng(7).normal(size=(300, 2000))
    found = statistics(x + x**2 / 10.0)
    for values, errors in (
        (found.mean, found.mean_error),
        (found.deviation, found.deviation_error),
        *zip(found.quantiles, found.quantile_errors, strict=True),
    ):
        assert np.sqrt(np.mean(errors**2)) == pytest.approx(values.std(), rel=0.15)
    assert found.mean.mean() == pytest.approx(0.1, abs=4.0 * found.mean.std() / sqrt(2000))
    z = norm.ppf(LEVELS)
    off = found.quantiles.mean(axis=1) - (z + z**2 / 10.0)
    assert np.all(np.abs(off) < 0.2 * found.quantiles.std(axis=1))  # of order 1/n


def test_sobol_indices_of_a_known_function():
    """Ishigami & Homma (1990): sin x₁ + a sin² x₂ + b x₃⁴ sin x₁ on [−π, π]³, whose third input acts with the first."""
    a, b, n = 7.0, 0.1, 8192
    u = qmc.LatinHypercube(6, seed=3).random(n)
    blocks = [u[:, :3], u[:, 3:]]
    blocks += [np.where(np.arange(3) == i, blocks[1], blocks[0]) for i in range(3)]

    def ishigami(u):
        x = np.pi * (2.0 * u - 1.0)
        return (np.sin(x[:, 0]) + a * np.sin(x[:, 1]) ** 2 + b * x[:, 2] ** 4 * np.sin(x[:, 0]))[:, None]

    f = np.array([ishigami(block) for block in blocks])
    found = sobol_indices(f[0], f[1], f[2:])
    v1, v2, v13 = 0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2, a**2 / 8.0, b**2 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    first, total = np.array([v1, v2, 0.0]), np.array([v1 + v13, v2, v13])
    np.testing.assert_array_less(np.abs(found.first[0] - first / (v1 + v2 + v13)), 4.0 * found.first_error[0])
    np.testing.assert_array_less(np.abs(found.total[0] - total / (v1 + v2 + v13)), 4.0 * found.total_error[0])
    assert found.first_error.max() < 0.03
    assert found.total_error.max() < 0.03
    f[3, 5] = np.nan  # a run that failed
    np.testing.assert_allclose(sobol_indices(f[0], f[1], f[2:]).total, found.total, atol=0.01)


def test_gradients_of_a_quadratic_tell_how_far_they_are_off():
    """f = x + x²/10, x normal: the mean is 1/10, the variance 1 + 2/100."""
    one = Spread(("key",), "", 0.0, "normal", 0.0, 1.0)
    found, _ = linear_statistics((one,), np.array(0.0), np.array([[1.1, -0.9]]))
    assert found.mean == 0.0
    assert found.mean_error == pytest.approx(0.1, rel=1e-2)
    assert found.deviation == pytest.approx(1.0, rel=1e-14)
    assert found.deviation_error == pytest.approx(sqrt(1.02) - 1.0, rel=0.05)
    np.testing.assert_allclose(found.quantiles, norm.ppf(LEVELS), atol=3e-3)  # there one of 4096 is 2.4e-3


def test_linear_responses(write, tmp_path):
    """Mass and moment of a rigid arm, by samples and by gradients; the samples are the runs'."""
    path = write(ARM)
    spreads = [f"{MASS}=±10%", f"{PAYLOAD}=normal:5%"]
    of = ["mass", f"peak {MOMENT}", MOMENT]
    deviations = np.array([0.2 / sqrt(3.0), 0.025])
    expected = [deviations[0], sqrt(np.sum((SLOPES * deviations) ** 2))]
    exact = ffrobot.uncertainty(path, of, spreads, tmp_path / "runs", by="gradients")
    assert exact.runs == 5
    np.testing.assert_allclose(exact.statistics.deviation, expected, rtol=1e-9)
    np.testing.assert_allclose(exact.statistics.mean, [2.0, SLOPES @ [2.0, 0.5] + 2.0 * 0.05], rtol=1e-9)
    np.testing.assert_allclose(exact.shares[1], (SLOPES * deviations / expected[1]) ** 2, rtol=1e-9)
    assert exact.statistics.deviation_error.max() < 1e-9
    sampled = ffrobot.uncertainty(path, of, spreads, tmp_path / "runs", samples=40)
    assert sampled.runs == 41
    assert not sampled.failures
    np.testing.assert_allclose(sampled.statistics.deviation, expected, rtol=0.03)  # 0.3 % with 200 samples
    np.testing.assert_allclose(sampled.statistics.mean, exact.statistics.mean, rtol=1e-3)
    (band,) = sampled.bands
    np.testing.assert_allclose(band.statistics.deviation, exact.bands[0].statistics.deviation, rtol=0.03)
    assert band.statistics.deviation[0] == pytest.approx(sampled.statistics.deviation[1], rel=1e-12)
    masses = np.array([[float(row[MASS]), float(row[PAYLOAD])] for row in rows(tmp_path / "runs" / "table.csv")[-40:]])
    np.testing.assert_allclose(sampled.samples[:, 0], masses[:, 0], rtol=1e-14)
    np.testing.assert_allclose(sampled.samples[:, 1], masses @ SLOPES + 2.0 * 0.05, rtol=1e-9)


@pytest.mark.nightly
def test_sobol_indices_of_a_scene(write):
    """The moment is a sum: what a key does alone is all it does."""
    spreads = [f"{MASS}=±10%", f"{PAYLOAD}=normal:5%"]
    found = ffrobot.uncertainty(write(ARM), [f"peak {MOMENT}"], spreads, samples=16, indices=True)
    assert found.runs == 1 + 8 * 4
    parts = (SLOPES * [0.2 / sqrt(3.0), 0.025]) ** 2
    expected = parts / parts.sum()
    i = found.indices
    assert np.all(np.abs(i.first[0] - expected) < 4.0 * i.first_error[0])
    assert np.all(np.abs(i.total[0] - expected) < 4.0 * i.total_error[0])


@pytest.mark.parametrize("by", [("gradients",), ("samples", "--samples", 8, "--indices")])
def test_keys_that_change_nothing(write, ffrobot, by):
    """Payloads are not counted in the mass: no division by a variance of 0."""
    spread = ("--spread", f"{PAYLOAD}=±5%")
    done = ffrobot.ok("uncertainty", write(ARM), "--of", "mass", *spread, "--no-figures", "--by", *by)
    assert "note       mass: none of the keys changes it" in done.stdout
    assert "nan" not in done.stdout


def test_failed_samples_are_told_and_left_out(write, ffrobot, tmp_path):
    """Of 46 masses 2 ± 0.995 the lowest is below 0 in a Latin hypercube: 1 of 46 is below 2.02 deviations."""
    command = ["uncertainty", write(ARM), "--of", "mass", "--spread", f"{MASS}=normal:0.995", "--samples", 46]
    done = ffrobot.ok(*command)
    assert "failed     1 of 47 runs, left out: body.arm.rigid.mass = -" in done.stdout
    assert "expected a number greater than 0" in done.stdout
    folder = tmp_path / "scene.uncertainty"
    files = sorted(folder.glob("runs/*/row.json"))
    before = [file.stat().st_mtime_ns for file in files]
    files[7].unlink()
    again = ffrobot(*command)
    assert again.stdout == done.stdout
    after = [file.stat().st_mtime_ns for file in files]
    assert [k for k, (old, new) in enumerate(zip(before, after, strict=True)) if old != new] == [7]
    (row,) = rows(folder / "uncertainty.csv")
    masses = np.array([float(one[MASS]) for one in rows(folder / "table.csv")[1:]])
    assert float(row["mean"]) == pytest.approx(masses[masses > 0.0].mean(), rel=1e-12)
    assert float(row["deviation"]) == pytest.approx(masses[masses > 0.0].std(ddof=1), rel=1e-12)


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [(6.5872, 0.02, "6.587 ± 0.02"), (90.89, 20.0, "91 ± 20"), (0.109, 1.0, "0.1 ± 1"), (2.0, 0.0, "2 ± 0")],
)
def test_numbers_have_one_digit_more_than_their_error_leaves(value, error, text):
    assert with_error(value, error) == text
