"""Picture of measured and fitted FRFs: magnitudes above phases, a column for each pose."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..common.files import write_atomically
from ..pictures.figures.style import SIZE, style
from ..pictures.projection import COLORS
from .frf_fit import ResponseFit

MOST_POSES, MOST_FRFS = 3, 3  # that are drawn, direct ones first


def draw_responses(fit: ResponseFit, path: Path) -> Path:
    """Write a PNG picture of the first poses and FRFs to `path`, dots measured and lines fitted; returns it."""
    poses, content = fit.poses[:MOST_POSES], io.BytesIO()
    with style():
        figure = Figure(figsize=(SIZE[0] * max(len(poses), 1), 1.4 * SIZE[1]), layout="constrained")
        axes = figure.subplots(2, len(poses), squeeze=False, sharex="col", height_ratios=(2, 1))
        for (above, below), one in zip(axes.T, poses, strict=True):
            f = one.pose.frequency
            pairs = sorted(zip(one.pose.responses, one.after.T, strict=True), key=lambda pair: not pair[0].is_direct)
            for (response, fitted), color in zip(pairs[:MOST_FRFS], COLORS, strict=False):
                measured = response.receptance
                above.semilogy(f, 1e3 * np.abs(measured), ".", color=color, markersize=2.0)
                above.semilogy(f, 1e3 * np.abs(fitted), color=color, label=response.label)
                below.plot(f, np.degrees(np.angle(measured)), ".", color=color, markersize=2.0)
                below.plot(f, np.degrees(np.angle(fitted)), color=color)
            above.set_title(f"{one.pose.test.name}{' (validation)' * one.pose.test.validation}", loc="left")
            above.set_ylabel("receptance (mm/N)")
            above.legend()
            below.set_ylabel("phase (°)")
            below.set_yticks([-180, -90, 0, 90, 180])
            below.set_xlabel("frequency (Hz)")
        figure.savefig(content, format="png")
    write_atomically(path, content.getvalue(), "picture", ours=True)
    return path
