"""What the standard figures are made of: curves, names, points that bend."""

from __future__ import annotations

import hashlib

import numpy as np

from ...results.file import Results
from .figure_file import Curve

NO_DEFLECTION = 1e-6  # of the largest: points that the reference condition fixes are there but for round-off


def curves_of(results: Results, dataset: str, column: str = "", *, magnitude: bool = False) -> tuple[Curve, ...]:
    """That dataset, or a column of it, of every analysis that has it."""
    names = ((analysis, f"{analysis}/{dataset}") for analysis in results.analyses)
    return tuple(Curve(data=name + column, label=a, magnitude=magnitude) for a, name in names if results.has(name))


def members(results: Results, group: str) -> list[str]:
    """Names in a group of any analysis, each once, in the order of the scene."""
    order = [keys["name"] for table in ("body", "joint") for keys in results.scene.get(table, [])]
    names = dict.fromkeys(name for a in results.analyses for name in results.names(f"{a}/{group}"))
    return sorted(names, key=lambda name: order.index(name) if name in order else len(order))


def bending_points(results: Results, analysis: str | None = None) -> list[str]:
    """Points whose deflection is visible next to that of the others, in one analysis or in any."""
    largest: dict[str, float] = {}
    for each in results.analyses if analysis is None else [analysis]:
        for point in results.names(f"{each}/points"):
            deflection = np.linalg.norm(results[f"{each}/points/{point}/deflection"], axis=1)
            largest[point] = max(largest.get(point, 0.0), float(deflection.max(initial=0.0)))
    visible = NO_DEFLECTION * max(largest.values(), default=0.0)
    return [point for point, value in largest.items() if value > visible]


def both_ways(limit: float | list[float]) -> tuple[float, ...]:
    """The limits of patches, one for all or one each, in both directions, each once."""
    return tuple(sorted({sign * float(one) for one in np.atleast_1d(limit) for sign in (-1.0, 1.0)}))


def file_name(*parts: str) -> str:
    """A file name: everything but letters, digits, `.` and `-` becomes `_`.

    Letters other than a to z and signs take a few digits of their own besides: names of other scripts stay apart.
    """
    joined = "_".join(parts)
    plain = "".join(c if c.isascii() and (c.isalnum() or c in ".-") else "_" for c in joined)
    lost = any(c != p and c not in " /_" for c, p in zip(joined, plain, strict=True))
    return f"{plain}-{hashlib.sha256(joined.encode()).hexdigest()[:6]}" if lost else plain
