"""Patches on the two links of `links.arm`, three modes each."""

from dataclasses import dataclass

import numpy as np

from ffrobot.mbs import _core
from ffrobot.mbs.model.amplifiers import MOST_PLAYS, Amplifiers

N = 3  # modes of a link
UNLIMITED = np.full(N, np.inf)


def amplifiers(limit):
    """Those that limit voltages alone, between -limit and limit (k,)."""
    none, zeros = np.full_like(limit, np.inf), np.zeros_like(limit)
    plays = np.zeros((2, MOST_PLAYS, len(limit)))
    plays[0, 0] = 1.0
    return Amplifiers(np.stack([-limit, limit]), none, none, np.eye(len(limit)), none, zeros, plays, zeros)


@dataclass(frozen=True)
class Patches:
    """As analyses have them, of one body: modal forces per volt Φ_V (n, k), limits (k,)."""

    body: str
    Phi: np.ndarray
    limit: np.ndarray

    @property
    def per_volt(self):
        return {self.body: self.Phi}

    @property
    def to_reached(self):
        return {self.body: np.eye(len(self.Phi))}

    @property
    def amplifiers(self):
        return amplifiers(self.limit)

    def allocation(self, *, limited):
        n, k = self.Phi.shape
        limit = self.limit if limited else np.full(k, np.inf)
        return _core.Allocation(self.Phi, np.eye(n), np.linalg.pinv(self.Phi), -limit, limit, np.ones(n))


def patches(Phi, limit=UNLIMITED):
    """The same patches on both links."""
    return {name: Patches(name, Phi, limit) for name in ("link1", "link2")}


FULL = patches(np.eye(N))  # patches that reach every mode
