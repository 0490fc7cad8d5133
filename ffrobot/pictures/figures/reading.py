"""Reading what a figure draws: curves of results, and points that they are compared with."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...results.file import Results
from .figure_file import Curve


def curve_points(results: Results, curve: Curve, scale: float) -> tuple[Array, Array]:
    """Of a curve over time (s), or over its `x`: x (T,), and `scale` times its values (T, columns)."""
    values = results.data(curve.data)
    if curve.magnitude:
        values = np.linalg.norm(values, axis=1)[:, None]
    x = results.time(curve.data) if curve.x is None else results.data(curve.x)[:, 0]
    if len(x) != len(values):
        raise InputError(
            f'{results.path}: expected as many values in "{curve.x}" as in "{curve.data}" ({len(values)}), found'
            f" {len(x)}"
        )
    return x, scale * values


def read_points(path: Path, column: str) -> tuple[Array, Array]:
    """Times and values of one column of a CSV file whose first column is the time; lines with # are comments."""
    try:
        text = path.read_text(encoding="utf-8-sig")
        rows = list(csv.reader(line for line in text.splitlines() if line and not line.startswith("#")))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: cannot read the points: {getattr(error, 'strerror', None) or error}") from None
    if not rows or column not in rows[0]:
        header = rows[0] if rows else []
        raise InputError(f'{path}: expected the column "{column}", found {header}')
    k = rows[0].index(column)
    try:
        return np.array([float(row[0]) for row in rows[1:]]), np.array([float(row[k]) for row in rows[1:]])
    except (ValueError, IndexError) as error:
        raise InputError(f'{path}: expected numbers in the column "{column}": {error}') from None
