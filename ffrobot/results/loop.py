"""Closed loops in results files and tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import h5py
import numpy as np

from ..actuation.control.closed_loop import LoopRecord
from ..actuation.control.metrics import Metrics

HEADINGS = (
    "closed loop", "verdict", "rms (m)", "max (m)", "settled (s)", "vibration (m)", "at end (m)", "work (J)", "N·m",
    "V", "cut",
)  # fmt: skip


def write_loop(group: h5py.Group, record: LoopRecord) -> None:
    """Of an analysis: tip_error at its outputs; in control/, samples, with metrics and names as attributes."""
    group["tip_error"] = record.tip_error
    group = group.create_group("control")
    for key in ("time", "readings", "reference", "commands", "wanted"):
        group[key] = getattr(record, key)
    group.attrs["inputs"] = list(record.inputs)
    group.attrs["outputs"] = list(record.outputs)
    group.attrs["warnings"] = list(record.warnings)
    group.attrs.update(vars(record.metrics))


def metrics_of(attributes: Mapping[str, Any]) -> Metrics:
    """The metrics that `write_loop` wrote."""
    return Metrics(**{key: attributes[key] for key in Metrics.__dataclass_fields__})


def metrics_row(name: str, metrics: Metrics) -> Iterator[str]:
    """One run as text, below `HEADINGS`."""
    yield name
    yield metrics.verdict
    for value in (metrics.tip_error_rms, metrics.tip_error_max):
        yield f"{value:.3g}"
    yield "no" if np.isnan(metrics.settling_time) else f"{metrics.settling_time:.3g}"
    for value in (metrics.vibration, metrics.residual, metrics.motor_work, metrics.peak_moment, metrics.peak_voltage):
        yield f"{value:.3g}"
    yield f"{100 * metrics.saturated:.2g} %"
