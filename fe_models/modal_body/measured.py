"""Measured frequencies and damping ratios in a modal body: shapes are those of the model, its stiffness is measured.

With mass-orthonormal modes K_ff = diag(ω²): a measured ω is a statement on the stiffness, as in model updating by the
modal stiffness alone (Friswell and Mottershead, Finite Element Model Updating in Structural Dynamics, 1995, ch. 1).
Stresses per unit of a mode go with its stiffness, so that those under a constant load stay what equilibrium asks for.
"""

from dataclasses import replace

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ..link_records.families import FAMILIES
from ..link_records.link import Link
from ..link_records.measured import paired, read_measured
from .body import ModalBody
from .parts import MeasuredValues

FARTHEST = 2.0  # times the computed frequency: beyond it the rows are of other modes, or the shapes of another link


def with_measured(body: ModalBody, link: Link) -> ModalBody:
    """The modal body with measured values of `link` put in; unchanged where there are none.

    Rows of modes that the body does not have are left out. Raises `InputError` where no row is of a mode of the body,
    or a frequency is far from the computed one.
    """
    if link.measured is None:
        return body
    path = link.measured.table
    rows = dict(paired(read_measured(path, FAMILIES), body.family[: body.eigenmode_count]))
    if not rows:
        raise InputError(f"{path}: expected rows of modes that the link has ({body.modes_in_words})", "none")
    frequency, flags = body.frequency.copy(), np.zeros((2, body.mode_count), dtype=np.int64)
    for k, row in rows.items():
        flags[:, k] = row.frequency is not None, row.damping_ratio is not None
        if row.frequency is not None:
            if not 1 / FARTHEST <= row.frequency / frequency[k] <= FARTHEST:
                raise InputError(
                    f"{path}: line {row.line}: frequency: expected {row.label} within a factor of {FARTHEST:g} of the"
                    f" computed {frequency[k]:.6g} Hz",
                    f"{row.frequency:g} Hz: is it another mode? (ffrobot fit brings the model nearer)",
                )
            frequency[k] = row.frequency
    damping = damping_ratio(link, 2 * np.pi * frequency)
    for k, row in rows.items():
        damping[k] = damping[k] if row.damping_ratio is None else row.damping_ratio
    values = MeasuredValues(flags[0], flags[1], body.frequency)
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


def damping_ratio(link: Link, omega: Array) -> Array:
    """ζ (n,), no unit, as given, or of Rayleigh damping D = aM + bK: a/(2ω) + bω/2; `omega` (n,) is ω in rad/s.

    A list is for the eigenmodes: its last number is that of the attachment modes, too.
    """
    if link.damping.rayleigh is not None:
        a, b = link.damping.rayleigh
        return a / (2 * omega) + b * omega / 2
    ratio = np.asarray(link.damping.ratio or 0.0, dtype=np.float64)
    if ratio.ndim:
        ratio = np.pad(ratio, (0, omega.size - ratio.size), mode="edge")
    return np.broadcast_to(ratio, omega.shape).copy()


def canonical_signs(fields: Array) -> Array:
    """Factors 1 or −1 (n,) of each mode; `fields` (6, k, n): u, v, w (m), φ_x, φ_y, φ_z (rad), root first.

    The dominant translation is then positive at the station nearest the root where it exceeds half its largest value;
    of a mode without translation, the dominant rotation.
    """
    rows = np.where(np.any(fields[:3], axis=(0, 1)), fields[:3], fields[3:])
    largest = np.abs(rows).max(axis=1).argmax(axis=0)
    dominant = np.take_along_axis(rows, largest[None, None], axis=0)[0]
    first = np.argmax(np.abs(dominant) > 0.5 * np.abs(dominant).max(axis=0), axis=0)
    return np.sign(np.take_along_axis(dominant, first[None], axis=0)[0])
