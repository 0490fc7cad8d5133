"""Peaks of histories in results files: of all times that were looked at, which are closer than the outputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import h5py
import numpy as np

from ..common.arrays import Array, as_floats
from ..common.peaks import largest, shares
from .meanings import matches, meaning

PEAKING = (
    "points/*/deflection", "joints/*/rate", "joints/*/moment", "joints/*/motor_moment", "joints/*/motor_rate",
    "joints/*/gear_moment", "joints/*/reaction", "joints/*/reaction_moment", "pzt/*/voltage", "pzt/*/required_voltage",
    "trajectories/*/force", "actuation_points/*/force", "stress/*/points/*/von_mises", "stress/*/surface/von_mises_max",
)  # fmt: skip
"""Datasets with peaks: of each column, of vectors of the length; the moment in a joint of the plane is its own."""

VOLTAGE = "pzt/*/voltage"

POWER = "peak_power"
"""Attribute of a joint with one coordinate: the largest power of its motor, W."""


def write_peaks(group: h5py.Group, write: Callable[[h5py.Group], None] | None) -> None:
    """Attributes `peak`, `peak_time`, `rms` of the histories of an analysis, each of every column or of the length.

    `write` writes the same analysis at closer times to a group; None where there are none.
    """
    if write is None:
        _write(group, group)
        return
    with h5py.File("closer", "w", driver="core", backing_store=False) as file:
        write(file)
        _write(group, file)


def peak_of(dataset: h5py.Dataset, time: Array, column: int | None = None) -> tuple[float, float]:
    """The largest of all columns, or of one, and when it is, s; of files without peaks that of the outputs."""
    if "peak" not in dataset.attrs:
        values = np.abs(dataset[()].reshape(len(time), -1))
        if column is not None:
            return largest(time, values[:, column])
        sizes = np.linalg.norm(values, axis=1) if _is_vector(dataset.name.split("/", 2)[2]) else values.max(axis=1)
        return largest(time, sizes)
    peaks, times = np.atleast_1d(dataset.attrs["peak"]), np.atleast_1d(dataset.attrs["peak_time"])
    k = int(peaks.argmax()) if column is None else column
    return float(peaks[k]), float(times[k])


def _write(group: h5py.Group, closer: h5py.Group) -> None:
    time = closer["time"][()]
    for name, values in _histories(closer, len(time)):
        if name in group and len(time):
            tops = np.array([largest(time, column) for column in values.T])
            if matches(name, VOLTAGE):  # cut off at its limit, it has no smooth top there
                limit = group[name].parent.attrs.get("limit", np.inf)
                tops[:, 0] = np.minimum(tops[:, 0], np.maximum(np.abs(values).max(axis=0), limit))
            means = np.sqrt(shares(time) @ values**2)
            single = values.shape[1] == 1
            attributes = group[name].attrs
            for key, found in (("peak", tops[:, 0]), ("peak_time", tops[:, 1]), ("rms", means)):
                attributes[key] = found[0] if single else found
    for name, joint in closer.get("joints", {}).items():
        rate = joint.get("motor_rate", joint.get("rate"))
        if "moment" in joint and rate is not None and rate.ndim == 1 and len(time):
            group[f"joints/{name}"].attrs[POWER] = largest(time, joint["moment"][()] * rate[()])[0]


def _histories(group: h5py.Group, count: int) -> Iterator[tuple[str, Array]]:
    """Name and values (T, columns) of what has peaks."""
    names: list[str] = []
    group.visit(names.append)
    for name in names:
        if any(matches(name, pattern) for pattern in PEAKING) and (found := group[name]).shape[0] == count:
            values = as_floats(found[()].reshape(count, -1))
            yield name, np.linalg.norm(values, axis=1, keepdims=True) if _is_vector(name) else values


def _is_vector(name: str) -> bool:
    known = meaning(name)
    return known is not None and known.columns == "axis"
