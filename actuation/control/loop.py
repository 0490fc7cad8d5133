"""What the core asks at every sample of a closed loop."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...common.arrays import Array
from .controllers import Controller, Setup
from .signals import Signal


class Loop:
    """What the core asks at every sample: noise and resolution, controllers, limits."""

    def __init__(
        self, setup: Setup, read: Sequence[Signal], controllers: Sequence[Controller], limit: Array, seed: int
    ) -> None:
        samples = (len(setup.times), len(read))
        noise = np.array([signal.noise for signal in read])
        self._noise = np.random.default_rng(seed).standard_normal(samples) * noise if noise.any() else None
        resolution = np.array([signal.resolution for signal in read])
        self._coarse = np.flatnonzero(resolution)
        self._resolution = resolution[self._coarse]
        self._controllers, self._limit, self._feed_forward = controllers, limit, setup.feed_forward
        self.readings = np.zeros(samples)
        self.commands, self.wanted = np.zeros_like(setup.feed_forward), np.zeros_like(setup.feed_forward)
        self.first: Array = np.clip(setup.feed_forward[0], -limit, limit)
        self.taken = 0

    def __call__(self, k: int, _t: float, y: Array) -> Array:
        """Commands at sample k for what the sensors are exposed to."""
        if self._noise is not None:
            y += self._noise[k]
        if self._coarse.size:
            y[self._coarse] = np.round(y[self._coarse] / self._resolution) * self._resolution
        wanted = self._feed_forward[k].copy()
        for controller in self._controllers:
            wanted += controller(k, y)
        command: Array = np.minimum(np.maximum(wanted, -self._limit), self._limit)
        self.readings[k], self.wanted[k], self.commands[k], self.taken = y, wanted, command, k + 1
        return command
