"""Outlines as matplotlib fills them."""

from __future__ import annotations

import numpy as np
from matplotlib.path import Path as Curve

from ...common.arrays import Array


def closed_path(corners: Array) -> Curve:
    """A path of (m, 2) corners; rows of NaN part its pieces."""
    gaps = np.isnan(corners[:, 0])
    codes = np.full(len(corners), Curve.LINETO)
    codes[np.append(True, gaps[:-1])] = Curve.MOVETO
    return Curve(corners[~gaps], codes[~gaps])
