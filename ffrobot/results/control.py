"""Closed loops in results files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import h5py

from ..actuation.control.metrics import Metrics

if TYPE_CHECKING:  # reading does without what solves
    from ..actuation.control.loop_record import LoopRecord
    from ..mbs.quantities.motion import RobotMotion


def write_loop(group: h5py.Group, _motion: RobotMotion, record: LoopRecord) -> None:
    """Of an analysis: tip_error at its outputs; in control/, samples, with metrics and names as attributes."""
    group["tip_error"] = record.tip_error
    group = group.create_group("control")
    for key in ("time", "readings", "reference", "commands", "wanted"):
        group[key] = getattr(record, key)
    group.attrs["inputs"] = list(record.inputs)
    group.attrs["outputs"] = list(record.outputs)
    group.attrs["warnings"] = list(record.warnings)
    group.attrs.update(vars(record.metrics))
    group.attrs["advice"] = list(record.advice)
    if record.margins is not None:
        found = record.margins
        group.attrs.update(spectral_radius=found.radius, gain_margin=found.gain, delay_margin=found.delay)


def read_metrics(attributes: Mapping[str, Any]) -> Metrics:
    """The metrics among the attributes of control/."""
    return Metrics(**{key: attributes[key] for key in Metrics.__dataclass_fields__ if key in attributes})
