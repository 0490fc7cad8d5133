"""Ratios of times that were taken in turn."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median


def ratios(seconds: Sequence[float], beside: Sequence[float]) -> tuple[float, float]:
    """Ratio of the minima, and median of the ratios of neighbours: when they disagree, the machine was busy."""
    return min(seconds) / min(beside), median(a / b for a, b in zip(seconds, beside, strict=True))
