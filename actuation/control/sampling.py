"""Linear models as a controller sees them: sampled, with commands that are held and come late."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array


@dataclass(frozen=True)
class SampledModel:
    """x(k+1) = A x(k) + B u(k) of a model whose inputs are held, u acting after a delay.

    Commands that are on their way are states behind those of the model, oldest first.
    """

    A: Array
    B: Array


def sampled(A: Array, B: Array, T: float, delay: float) -> SampledModel:
    """The exact discrete model for samples every T (Åström and Wittenmark, Computer-Controlled Systems, sec. 2.3)."""
    n, m = B.shape
    late, fraction = divmod(delay, T)
    waiting = int(late) + (fraction > 1e-9 * T)
    Phi, Gamma = _zero_order_hold(A, B, T)
    _, early = _zero_order_hold(A, B, T - fraction) if fraction > 1e-9 * T else (Phi, Gamma)
    whole = np.zeros((n + waiting * m, n + waiting * m))
    inputs = np.zeros((n + waiting * m, m))
    whole[:n, :n] = Phi
    if waiting == 0:
        inputs[:n] = Gamma
        return SampledModel(whole, inputs)
    whole[n : n + (waiting - 1) * m, n + m :] = np.eye((waiting - 1) * m)
    inputs[n + (waiting - 1) * m :] = np.eye(m)
    if fraction <= 1e-9 * T:
        whole[:n, n : n + m] = Gamma
    else:  # the oldest command acts for the first part of the interval, the next one for the rest
        rest = Gamma - early
        whole[:n, n : n + m] = rest
        if waiting == 1:
            inputs[:n] = early
        else:
            whole[:n, n + m : n + 2 * m] = early
    return SampledModel(whole, inputs)


def _zero_order_hold(A: Array, B: Array, T: float) -> tuple[Array, Array]:
    """e^{A T} and ∫ e^{A s} ds B over T."""
    from scipy.linalg import expm

    n, m = B.shape
    scale = float(np.abs(B).max(initial=0.0)) or 1.0  # of inputs: the unit of a command must not decide on the powers
    block = expm(np.block([[A, B / scale], [np.zeros((m, n + m))]]) * T)
    return block[:n, :n], block[:n, n:] * scale
