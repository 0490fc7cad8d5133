"""Patches on the two links of `links.arm`, three modes each."""

import numpy as np

from ffrobot.mbs import _core
from ffrobot.mbs.analysis.replay import ActuatorSet

N = 3  # modes of a link
UNLIMITED = np.full(N, np.inf)


def patches(Phi, limit=UNLIMITED):
    """The same patches on both links."""
    return {
        name: _core.Allocation(Phi, np.eye(N), np.linalg.pinv(Phi), limit, np.ones(N)) for name in ("link1", "link2")
    }


FULL = ActuatorSet(patches(np.eye(N)))  # patches that reach every mode
