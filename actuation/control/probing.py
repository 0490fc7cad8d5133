"""Controllers as linear maps with states, found by what they command for readings that are a little off."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import redirect_stdout
from copy import copy
from io import StringIO

import numpy as np

from ...common.arrays import Array
from ...common.errors import SolveError
from .controllers import Controller
from .margins import Feedback
from .robot import Setup

LONGEST, FEWEST = 64, 12  # samples that are looked at
AT, LATER = 1, 4  # sample at which readings are off: the first may be special; and that of all together
SIZES = 1e-4, 1e-7, 1e-10  # of how far readings are off in the run, until commands are linear in them
LINEAR = 0.02  # of the largest change of each command: what several readings may change of their sum, later and twice
RANK = 1e-8  # of the largest singular value: less is round-off
SAME = 1e-3  # of the largest response: what the states found may leave of it


def find_feedback(setup: Setup, controllers: Sequence[Controller], readings: Array, first: int) -> Feedback | None:
    """The controllers about the reference from sample `first` on, much nearer to it than the `readings` (K, outputs).

    Each reading is off at one sample alone. The change of what is then commanded is the controllers' impulse response;
    its Hankel matrix has the rank of their states, and these as factors (B. L. Ho and R. E. Kalman, Regelungstechnik
    14, 1966; S. Y. Kung, Asilomar Conf. 1978). None where that is no linear map that stays the same from sample to
    sample, with few states.
    """
    count = min(LONGEST, len(setup.times) - first)
    if count < FEWEST:
        return None
    reference, off = setup.reference[first : first + count], readings - setup.reference[: len(readings)]
    size = np.abs(off).max(axis=0, initial=0.0)
    size[size == 0.0] = 1.0

    def commands(changes: Array) -> Array:
        acting = [copy(controller) for controller in controllers]  # as they begin
        found = np.zeros((count, len(setup.inputs)))
        for k, y in enumerate(reference + changes):
            for controller in acting:
                found[k] += controller(first + k, y)
        return found

    try:
        with np.errstate(all="ignore"), redirect_stdout(StringIO()):  # once more, of what it printed
            still = commands(np.zeros_like(reference))
            for share in SIZES:
                a, answers = share * size, np.zeros((len(size), *still[AT:].shape))
                for j, each in enumerate(np.diag(a)):
                    change = np.zeros_like(reference)
                    change[AT] = each
                    answers[j] = (commands(change) - still)[AT:]
                signs = 2.0 * (-1.0) ** np.arange(len(a))
                together = np.zeros_like(reference)
                together[LATER] = signs * a
                seen, expected = commands(together) - still, np.zeros_like(still)
                expected[LATER:] = np.tensordot(signs, answers[:, : count - LATER], 1)
                if np.abs(seen - expected).max(initial=0.0) <= LINEAR * np.abs(expected).max(initial=0.0):
                    return _realized(setup, np.moveaxis(answers, 0, 2), a)
    except SolveError:
        pass
    return None


def _realized(setup: Setup, answers: Array, a: Array) -> Feedback | None:
    """The least states whose commands are `answers` (samples, inputs, outputs) to readings that are off by `a`."""
    size = np.abs(answers).max(axis=(1, 2), initial=0.0)
    grown = float(np.abs(answers[len(answers) // 2 :]).max(initial=0.0)) / (float(size[: len(size) // 2].max()) or 1.0)
    growth = max(grown, 1.0) ** (2.0 / len(answers))  # a sample, of controllers that are unstable by themselves
    answers = answers / growth ** np.arange(len(answers))[:, None, None]
    size = np.abs(answers).max(axis=(0, 2), initial=0.0)
    size[size == 0.0] = 1.0
    scaled = answers / size[:, None]
    inputs, outputs, later = len(size), len(a), scaled[1:]
    half = len(later) // 2
    blocks = [np.concatenate(later[k : k + half]) for k in range(len(later) - half + 1)]
    U, values, V = np.linalg.svd(np.hstack(blocks[:-1]), full_matrices=False)
    largest = float(np.abs(scaled).max(initial=0.0))
    rank = int(np.count_nonzero(values > RANK * max(values.max(initial=0.0), largest)))
    root = np.sqrt(values[:rank])
    A = (U[:, :rank].T @ np.hstack(blocks[1:]) @ V[:rank].T) / root[:, None] / root
    B, C = root[:, None] * V[:rank, :outputs], U[:inputs, :rank] * root
    x = B
    for expected in later:
        if np.abs(C @ x - expected).max(initial=0.0) > SAME * largest:
            return None
        x = A @ x
    return Feedback(growth * A, growth * B / a, size[:, None] * C, answers[0] / a, setup.inputs, setup.outputs)
