"""Reading the points that a figure compares results with."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError


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
