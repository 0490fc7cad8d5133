"""Measured frequencies and damping ratios in a modal body: shapes are those of the model, its stiffness is measured.

With mass-orthonormal modes K_ff = diag(ω²): a measured ω is a statement on the stiffness, as in model updating by the
modal stiffness alone (Friswell and Mottershead, Finite Element Model Updating in Structural Dynamics, 1995, ch. 1).
Stresses per unit of a mode go with its stiffness, so that those under a constant load stay what equilibrium asks for.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ..link_records.families import FAMILIES
from ..link_records.link import Link
from ..link_records.measured import MeasuredMode, paired, read_measured
from .body import ModalBody
from .damping import damping_ratio
from .parts import MeasuredValues

FARTHEST = 2.0  # times the computed frequency: beyond it the rows are of other modes, or the shapes of another link


def with_measured(body: ModalBody, link: Link) -> ModalBody:
    """Return the modal body with measured values of `link` put in; unchanged where there are none.

    Rows of modes that the body does not have are left out. Raises `InputError` where no row is of a mode of the body,
    or a frequency is far from the computed one.
    """
    if link.measured is None:
        return body
    path = link.measured.table
    rows = dict(paired(read_measured(path, FAMILIES), body.family[: body.eigenmode_count]))
    if not rows:
        raise InputError(f"{path}: expected rows of modes that the link has ({body.modes_in_words})", "none")
    frequency = body.frequency.copy()
    for k, row in rows.items():
        if row.frequency is not None:
            _check_distance(path, row, float(body.frequency[k]))
            frequency[k] = row.frequency
    damping = damping_ratio(link, 2 * np.pi * frequency)
    for k, row in rows.items():
        damping[k] = damping[k] if row.damping_ratio is None else row.damping_ratio
    values = MeasuredValues(
        _flags(rows, "frequency", body.mode_count), _flags(rows, "damping_ratio", body.mode_count), body.frequency
    )
    return replace(_with_frequency(body, frequency), damping_ratio=damping, measured=values)


def as_computed(body: ModalBody) -> ModalBody:
    """The modal body with the frequencies of its finite element model; the damping ratios stay."""
    if body.measured is None:
        return body
    return replace(_with_frequency(body, body.measured.computed_frequency), measured=None)


def _with_frequency(body: ModalBody, frequency: Array) -> ModalBody:
    """The body with other frequencies (n,), Hz, of the same shapes, and the stresses that go with its stiffness."""
    stiffer = (frequency / body.frequency) ** 2
    return replace(
        body,
        frequency=frequency,
        stiffness=np.diag((2 * np.pi * frequency) ** 2),
        stress={name: replace(point, stress=point.stress * stiffer) for name, point in body.stress.items()},
        surface_stress=None if body.surface_stress is None else body.surface_stress * stiffer,
    )


def _check_distance(path: Path, row: MeasuredMode, computed: float) -> None:
    assert row.frequency is not None
    if not 1 / FARTHEST <= row.frequency / computed <= FARTHEST:
        raise InputError(
            f"{path}: line {row.line}: frequency: expected {row.label} within a factor of {FARTHEST:g} of the computed"
            f" {computed:.6g} Hz",
            f"{row.frequency:g} Hz: is it another mode? (ffrobot fit brings the model nearer)",
        )


def _flags(rows: Mapping[int, MeasuredMode], what: str, count: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """(count,) 1 of the modes whose row has that value."""
    flags = np.zeros(count, dtype=np.int64)
    flags[[k for k, row in rows.items() if getattr(row, what) is not None]] = 1
    return flags
