"""Linear models between samples, and the Riccati equation of their regulators and filters."""

from contextlib import suppress

import numpy as np

from ...common.arrays import Array, Indices
from ...common.libraries import scipy
from ...common.structs import struct


@struct
class SampledModel:
    """x(k+1) = A x(k) + B u(k) of a model with inputs that are constant between samples and act after a delay.

    SI units. Commands that wait for their delay are states after those of the model, oldest first.
    """

    A: Array  # (states, states)
    B: Array  # (states, inputs)
    last: Indices  # (inputs,) indices of states that are the commands in effect just before the sample


def sampled(A: Array, B: Array, T: float, delay: float | Array, *, with_last: bool = False) -> SampledModel:
    """The exact discrete model of x' = A x + B u, A (n, n), B (n, m), for samples every T (s).

    See Åström and Wittenmark, Computer-Controlled Systems, sec. 2.3. `delay` (s) is that of all inputs, or (m,) of
    each. `with_last`: the last command, which acts until the sample, is a state also without delay. SI units.
    """
    n, m = B.shape
    late, fraction = np.divmod(np.broadcast_to(delay, m), T)
    is_whole = fraction <= 1e-9 * T
    ages = np.maximum(late + ~is_whole, int(with_last)).astype(int)  # of the command that acts until the sample
    waiting = int(ages.max(initial=0))
    Phi, Gamma = zero_order_hold(A, B, T)
    early = Gamma.copy()
    for part in np.unique(fraction[~is_whole]):
        early[:, fraction == part] = zero_order_hold(A, B[:, fraction == part], T - float(part))[1]
    columns = np.zeros((n + waiting * m, n + (waiting + 1) * m))  # of states, commands on their way, and the new one
    columns[:n, :n] = Phi
    columns[n:, n + m :] = np.eye(waiting * m)
    places = n + m * (waiting - late.astype(int)) + np.arange(m)
    columns[:n, places] = early
    columns[:n, (places - m)[~is_whole]] = (Gamma - early)[:, ~is_whole]  # the older one acts first in the interval
    last = n + m * (waiting - ages) + np.arange(m)
    return SampledModel(columns[:, : n + waiting * m], columns[:, n + waiting * m :], last)


def zero_order_hold(A: Array, B: Array, T: float) -> tuple[Array, Array]:
    """e^{A T} (n, n) and ∫ e^{A s} ds B (n, m) over T (s) of A (n, n), B (n, m), in any units of states."""
    n, m = B.shape
    size = np.ones((n, 1))
    if n:
        size[:, 0] = scipy.linalg.matrix_balance(A, permute=False, separate=True)[1][0]  # powers of 2
    B = B / size
    scale = float(np.abs(B).max(initial=0.0)) or 1.0
    block = scipy.linalg.expm(np.block([[A / size * size.T, B / scale], [np.zeros((m, n + m))]]) * T)
    return size * block[:n, :n] / size.T, size * block[:n, n:] * scale


def riccati(A: Array, B: Array, Q: Array, R: Array, within: float = 1.0) -> Array:
    """X (n, n) = AᵀXA − AᵀXB (R + BᵀXB)⁻¹ BᵀXA + Q that stabilizes A − B K, K = (R + BᵀXB)⁻¹ BᵀXA.

    A and Q are (n, n), B (n, m), R (m, m), in consistent units; for filters use Aᵀ and Cᵀ. Raises `ValueError` where
    no X has eigenvalues of A − B K `within` that radius.
    """
    root = np.linalg.cholesky(R)
    B = np.linalg.solve(root, B.T).T  # in the units of what is acceptable
    try:
        X = scipy.linalg.solve_discrete_are(A, B, Q, np.eye(len(R)))
    except (scipy.linalg.LinAlgError, ValueError) as error:  # often only its reordering of eigenvalues
        if (found := by_doubling(A, B, Q)) is None:
            raise ValueError(str(error)) from None
        X = found
    K = np.linalg.solve(np.eye(len(R)) + B.T @ X @ B, B.T @ X @ A)
    if not np.abs(np.linalg.eigvals(A - B @ K)).max(initial=0.0) < within:
        raise ValueError("its solution is not stable")
    return (X + X.T) / 2


def by_doubling(A: Array, B: Array, X: Array) -> Array | None:
    """X (n, n) = AᵀXA − AᵀXB (1 + BᵀXB)⁻¹ BᵀXA + Q by doubling; A (n, n), B (n, m), argument `X` is Q (n, n).

    Step k makes 2ᵏ of the Riccati recursion (B. D. O. Anderson, Int. J. Control 28, 1978, 295–306), in any units. None
    where it does not converge, or 1 is below round-off of BᵀXB.
    """
    unit, G = np.eye(len(A)), B @ B.T
    with np.errstate(all="ignore"), suppress(np.linalg.LinAlgError):
        for _ in range(40):  # slow errors of filters are gone by then
            W, before = unit + G @ X, X
            through = np.linalg.solve(W.T, A.T).T
            X, G = X + A.T @ X @ np.linalg.solve(W, A), G + through @ G @ A.T
            A, X, G = through @ A, (X + X.T) / 2, (G + G.T) / 2
            if not (np.isfinite(X).all() and np.isfinite(G).all()):
                return None
            if np.abs(X - before).max() <= 1e-10 * np.abs(X).max():  # the next doubling changes its square
                return X if np.abs(B.T @ X @ B).max(initial=0.0) * np.finfo(float).eps < 1.0 else None
    return None
