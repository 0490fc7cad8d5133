"""Closed loops as lines of a table."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..actuation.control.metrics import Metrics

LOOP_COLUMNS = (
    "closed loop", "verdict", "rms (m)", "max (m)", "settling\n(s)", "overshoot\n(m)", "vibration\n(m)",
    "final (m)", "work (J)", "torque\n(N·m)", "voltage\n(V)", "at\nlimits",
)  # fmt: skip


def loop_row(name: str, metrics: Metrics) -> Iterator[str]:
    """One run as text, below `LOOP_COLUMNS`."""
    yield name
    yield metrics.verdict
    for value in (metrics.tip_error_rms, metrics.tip_error_max):
        yield f"{value:.3g}"
    yield "no" if np.isnan(metrics.settling_time) else f"{metrics.settling_time:.3g}"
    yield from (
        f"{value:.3g}" for value in (metrics.overshoot, metrics.vibration, metrics.residual, metrics.motor_work)
    )
    yield from (f"{value:.3g}" for value in (metrics.peak_moment, metrics.peak_voltage))
    yield f"{100 * metrics.saturated:.2g} %"
