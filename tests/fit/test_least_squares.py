"""Parameters from frequencies of a chain of masses and springs: recovered, with the right uncertainty, or refused."""

import numpy as np
import pytest

from ffrobot.common.errors import InputError
from ffrobot.fit.least_squares import fit_frequencies

LABELS = [f"mode {k}" for k in range(1, 6)]
KEYS = ("k1", "k2", "mass")
TRUE = np.array([120.0, 3500.0, 2.0])


def chain(values):
    """Frequencies, Hz, of five masses in a row: the first spring k1, the others k2, all masses 1 kg but the last."""
    k1, k2, mass = values
    springs = np.array([k1, k2, k2, k2, k2])
    K = np.diag(springs + np.append(springs[1:], 0.0)) - np.diag(springs[1:], 1) - np.diag(springs[1:], -1)
    scale = np.array([1.0, 1.0, 1.0, 1.0, mass]) ** -0.5
    return np.sqrt(np.linalg.eigvalsh(scale[:, None] * K * scale)) / (2 * np.pi)


def test_known_parameters_are_recovered():
    fit = fit_frequencies(chain, KEYS, np.array([100.0, 5000.0, 1.0]), LABELS, chain(TRUE))
    np.testing.assert_allclose(fit.value, TRUE, rtol=1e-7)
    np.testing.assert_allclose(fit.after, fit.measured, rtol=1e-9)
    np.testing.assert_allclose(fit.before, chain(np.array([100.0, 5000.0, 1.0])), rtol=1e-12)


@pytest.mark.parametrize("is_known", [True, False], ids=["uncertainty given", "uncertainty from the residuals"])
def test_uncertainty_is_that_of_a_monte_carlo(is_known):
    """600 measurements with errors of 0.2 %: deviations of 600 samples are known to 3 % (one σ), bounds are 4 σ.

    Without given uncertainties the mean of the estimated variances counts: each has 2 degrees of freedom, so that their
    mean over 600 has a deviation of 4 %, the square root of it 2 %.
    """
    spread, count, rng = 0.002, 600, np.random.default_rng(18)
    exact = chain(TRUE)
    fits = [
        fit_frequencies(chain, KEYS, 1.3 * TRUE, LABELS, noisy, spread * exact if is_known else None)
        for noisy in exact * (1.0 + spread * rng.standard_normal((count, 5)))
    ]
    errors = np.array([np.log(fit.value / TRUE) for fit in fits])
    said = np.sqrt(np.mean([fit.relative_deviation**2 for fit in fits], axis=0))
    np.testing.assert_allclose(said, errors.std(axis=0), rtol=0.12 if is_known else 0.15)
    correlation = np.mean([fit.correlation for fit in fits], axis=0)
    np.testing.assert_allclose(correlation, np.corrcoef(errors.T), atol=4 / np.sqrt(count))
    if is_known:  # χ²/(m − n) has the mean 1 and, over 600 fits of 2 degrees of freedom, a deviation of 4 %
        assert np.mean([fit.misfit**2 for fit in fits]) == pytest.approx(1.0, abs=0.16)


def test_few_degrees_of_freedom_are_named():
    """t of two degrees of freedom in closed form: p √(2/(1 − p²))."""
    noisy = chain(TRUE) * [1.001, 0.999, 1.0, 1.002, 0.999]
    fit = fit_frequencies(chain, KEYS, 1.3 * TRUE, LABELS, noisy)
    assert fit.coverage_factor(0.95) == pytest.approx(0.95 * np.sqrt(2 / (1 - 0.95**2)), rel=1e-9)
    told = "\n".join(fit.remarks())
    assert "estimated from 2 degrees of freedom: the range of 95 % is ± 4.3 of them" in told
    known = fit_frequencies(chain, KEYS, 1.3 * TRUE, LABELS, noisy, 0.01 * noisy)
    assert "degrees of freedom" not in "\n".join(known.remarks())
    assert "hardly determined" not in told
    vague = fit_frequencies(chain, KEYS, 1.3 * TRUE, LABELS, noisy, noisy)
    assert any(line.startswith(f"{KEYS[0]} is hardly determined") for line in vague.remarks())


def test_as_many_frequencies_as_parameters_leave_the_uncertainty_open():
    fit = fit_frequencies(lambda x: chain(x)[:3], KEYS, 1.1 * TRUE, LABELS[:3], chain(TRUE)[:3])
    np.testing.assert_allclose(fit.value, TRUE, rtol=1e-6)
    assert np.isnan(fit.relative_deviation).all()
    assert np.isnan(fit.misfit)


def test_parameters_that_cannot_be_told_apart_are_refused_with_what_they_have_in_common():
    """k1 = a b², k2 = c: a b² alone shows."""
    keys = ("a", "b", "c")
    with pytest.raises(InputError, match=r"with a times c\^-2, b times c, for any c: vary only 1 of these 2|"
                                         r"with a times c, b times c\^-0.5, for any c"):  # fmt: skip
        fit_frequencies(lambda x: chain([x[0] * x[1] ** 2, x[2], 2.0]), keys, np.ones(3), LABELS, chain(TRUE))


def test_a_parameter_without_effect_and_too_few_frequencies_are_refused():
    with pytest.raises(InputError, match="expected keys on which the measured frequencies depend, found color"):
        fit_frequencies(lambda x: chain([*x[:2], 2.0]), ("k1", "k2", "color"), TRUE, LABELS, chain(TRUE))
    with pytest.raises(InputError, match="at least as many measured frequencies as keys to vary, found 2 of mode 1"):
        fit_frequencies(lambda x: chain(x)[:2], KEYS, TRUE, LABELS[:2], chain(TRUE)[:2])
