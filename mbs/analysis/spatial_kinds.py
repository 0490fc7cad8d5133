"""The kinds of analysis in space that know nothing of patches; all: `actuation.control.spatial_kinds`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from .outcome import Outcome
from .spatial_fcid import run_spatial_fcid
from .spatial_forward import run_spatial_forward
from .spatial_motors_only import run_spatial_motors_only
from .spatial_pcid import run_spatial_pcid
from .spatial_run import SpatialContext
from .spatial_static import run_spatial_static

MECHANICAL_IN_SPACE: Mapping[str, Callable[[SpatialContext, Any], Outcome]] = {
    "pcid": run_spatial_pcid,
    "fcid": run_spatial_fcid,
    "forward": run_spatial_forward,
    "static": run_spatial_static,
    "motors-only": run_spatial_motors_only,
}
"""By `kind`; each takes the record of its kind, which is that of planar scenes."""
