"""Commands of a closed loop on their way through the amplifiers of patches, between its samples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...common.arrays import Array
from ...mbs.model.amplifiers import Amplifiers
from .controllers import Loop

OF_LAG = 2  # steps of the shortest time constant
OF_RATES = 4  # steps of a sample, at least, where rates or currents are limited
MOST = 20  # steps of a sample


class AmplifiedLoop:
    """What the core asks at every step: commands of motors, and means of the voltages that arrive.

    `directions` (k, n_v): current of the strain of each patch by v, A; `splits` part q, v, a of a state.
    """

    def __init__(
        self,
        loop: Loop,
        at_sample: Callable[[int, float, Array], Array],
        samples: Array,
        T: float,
        amplifiers: Amplifiers,
        directions: Array,
        splits: tuple[int, int],
    ) -> None:
        lag = amplifiers.lag[amplifiers.lag > 0.0].min(initial=np.inf)
        self._parts = int(np.clip(np.ceil(OF_LAG * T / lag), OF_RATES if amplifiers.has_rates else 1, MOST))
        self._loop, self._at_sample, self._samples, self._amplifiers = loop, at_sample, samples, amplifiers
        self._directions, self._v, self._h = directions, slice(*splits), T / self._parts
        self.times: Array = (samples[:, None] + self._h * np.arange(self._parts)).ravel()
        self.first, self.taken = loop.first, 0
        self.commands = np.zeros((len(self.times), len(self.first)))
        self._now = self.first[len(self.first) - len(directions) :]

    def __call__(self, k: int, t: float, state: Array) -> Array:
        """Commands in step k."""
        if k % self._parts == 0:
            self._at_sample(k // self._parts, t, state)
        loop, motors = self._loop, len(self.first) - len(self._now)
        last = loop.commands[loop.taken - 1]
        wanted = np.array([self._wanted(t, motors + j, d) for j, d in enumerate(self._amplifiers.delay)])
        self._now, mean = self._amplifiers.advance(
            self._h, self._now, (wanted, wanted), self._directions @ state[self._v]
        )
        command: Array = np.concatenate([last[:motors], mean])
        self.commands[k], self.taken = command, k + 1
        return command

    def _wanted(self, t: float, column: int, delay: float) -> float:
        """Mean over a step from `t` (s) on of a command that acts `delay` (s) after its sample, once it changes."""
        loop, h = self._loop, self._h
        k = int(np.searchsorted(self._samples[: loop.taken], t + h * (1.0 - 1e-9) - delay, side="right"))
        known = [loop.first[column], *loop.commands[max(k - 2, 0) : k, column]]
        late = 0.0 if k == 0 else float(np.clip((self._samples[k - 1] + delay - t) / h, 0.0, 1.0))
        return float((1.0 - late) * known[-1] + (late * known[-2] if late else 0.0))
