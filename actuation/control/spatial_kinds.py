"""THE list of kinds of analysis that scenes in space have, and what runs them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ...mbs.analysis.outcome import Outcome
from ...mbs.analysis.spatial_kinds import MECHANICAL_IN_SPACE
from .spatial_closed_loop import run_spatial_closed_loop
from .spatial_linear import run_spatial_linear
from .spatial_placement import run_spatial_placement

IN_SPACE: Mapping[str, Callable[[Any, Any], Outcome]] = {
    **MECHANICAL_IN_SPACE,
    "linear": run_spatial_linear,
    "closed-loop": run_spatial_closed_loop,
    "placement": run_spatial_placement,
}
"""By `kind`; each takes an `ActuatedSpatialContext` and the record of its kind: that of planar scenes, or its like."""
