"""Peaks of histories in results files: of all times that were looked at, which are closer than the outputs."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import h5py
import numpy as np

from ..common.arrays import Array, Indices
from ..common.meanings import matches, meaning
from ..common.peaks import largest, shares
from ..mbs.joints.joint import JointRecord
from ..mbs.quantities.motion import deflection, joint_motion, reported_points
from ..mbs.quantities.supply import followed_trajectories, motor_moments, motor_motion, path_force

if TYPE_CHECKING:  # reading can do without the core
    from ..run.result import AnalysisResult

POWER = "peak_power"
"""Attribute of a joint with one coordinate: the largest power of its motor, W."""
MEAN_POWER, RMS_POWER = "mean_power", "rms_power"
"""Attributes of a joint: of the power of its motor, summed over its coordinates, W."""


def peaking(result: "AnalysisResult") -> Iterator[tuple[str, Array]]:
    """Name and values (T, …) of each history of an analysis that has peaks, at all times of `result.histories`.

    In SI units and along the axes of the scene. If `result.wants` only some: these, and others that cost nothing.
    """
    of, wants = result.histories, result.wants
    run, space = of.run, of.run.space
    for body, labels in reported_points(run).items():
        for point in (f"{body}.{label}" for label in labels):
            if wants(name := f"points/{point}/deflection"):
                yield name, space.along(deflection(run, point))
    for joint in result.prepared.scene.joint:
        if wants(place := f"joints/{joint.name}"):
            for key, values in _of_joint(result, joint, place):
                yield f"{place}/{key}", values
    for trajectory in followed_trajectories(run):
        yield f"trajectories/{trajectory.name}/force", path_force(run, trajectory.name)
    for body, forces in of.point_forces.items() if wants("actuation_points") else ():
        yield f"actuation_points/{body}/force", forces.force
    for body, stress in of.stresses.items() if wants("stress") else ():
        for point, at in stress.points.items():
            yield f"stress/{body}/points/{point}/von_mises", at.von_mises
        if stress.surface is not None:
            yield f"stress/{body}/surface/von_mises_max", stress.surface.von_mises_max
    actuation = of.actuation if wants("pzt") else None
    for name, voltages in ({} if actuation is None else actuation.voltages).items():
        yield f"pzt/{name}/voltage", voltages.within_limit
        yield f"pzt/{name}/required_voltage", voltages.required


def _of_joint(result: "AnalysisResult", joint: JointRecord, place: str) -> Iterator[tuple[str, Array]]:
    of, wants, is_single = result.histories, result.wants, len(joint.units) == 1
    run = of.run
    if wants(f"{place}/reaction"):
        yield "reaction", run.space.along(of.reactions[joint.name].force)
    # In the plane a revolute joint carries no moment about its axis.
    if not (run.space.is_plane and joint.type == "revolute") and wants(f"{place}/reaction_moment"):
        yield "reaction_moment", run.space.about(of.reactions[joint.name].moment)
    if (moving := joint_motion(run, joint.name)) is not None:
        yield "rate", np.squeeze(moving[1], 1) if is_single else moving[1]
    moment, motor = motor_moments(run).get(joint.name), motor_motion(run, joint.name)
    if moment is not None and joint.name in run.model.motors:
        moment = np.squeeze(moment, 1) if is_single else moment
        yield "moment", moment
        if joint.given_gear_ratio is not None or motor is not None:
            yield "motor_moment", moment / (joint.given_gear_ratio or 1.0)
    if motor is not None:
        yield "motor_rate", motor[1]
        yield "gear_moment", motor[2]


def peak_of(dataset: h5py.Dataset, time: Array, column: int | None = None) -> tuple[float, float]:
    """Return the largest absolute value of one column or of all (of vectors: length), in its unit, and its time, s.

    By the peaks in the file, or without them (a column of a vector, old files) at the outputs `time` (T,), s.
    """
    peaks, times = (np.atleast_1d(dataset.attrs.get(key, ())) for key in ("peak", "peak_time"))
    if len(peaks) and (column is None or len(peaks) == np.prod(dataset.shape[1:])):
        k = int(peaks.argmax()) if column is None else column
        return float(peaks[k]), float(times[k])
    values = dataset[()].reshape(len(time), -1)
    if column is not None:
        return largest(time, values[:, column])
    is_vector = _is_vector(dataset.name.split("/", 2)[2])
    return largest(time, np.linalg.norm(values, axis=1) if is_vector else np.abs(values).max(axis=1))


def write_peaks(group: h5py.Group, time: Array, histories: Mapping[str, Array], outputs: Indices) -> None:
    """Write `histories` (T, …), SI units, at `time` (T,), s: datasets at `outputs`, with attributes by all times.

    The attributes are `peak`, `peak_time`, `rms`, `mean` of every column, or of the length of vectors.
    """
    weights = shares(time)
    for name, values in histories.items():
        dataset = group.create_dataset(name, data=values[outputs])
        if len(time):
            columns = values.reshape(len(time), -1)
            columns = np.linalg.norm(columns, axis=1, keepdims=True) if _is_vector(name) else columns
            tops = np.array([largest(time, column) for column in columns.T])
            if matches(name, "pzt/*/voltage"):  # cut off at its limit, it has no smooth top there
                limit = dataset.parent.attrs.get("limit", np.inf)
                tops[:, 0] = np.minimum(tops[:, 0], np.maximum(np.abs(columns).max(axis=0), limit))
            means = {"rms": np.sqrt(weights @ columns**2), "mean": weights @ columns}
            for key, sizes in ({"peak": tops[:, 0], "peak_time": tops[:, 1]} | means).items():
                dataset.attrs[key] = sizes[0] if len(sizes) == 1 else sizes
    for name, joint in group.get("joints", {}).items():
        of = f"joints/{name}/"
        moment, rate = histories.get(of + "moment"), histories.get(of + "motor_rate", histories.get(of + "rate"))
        if moment is not None and rate is not None and len(time):
            power = (moment * rate).reshape(len(time), -1).sum(axis=1)
            joint.attrs[MEAN_POWER], joint.attrs[RMS_POWER] = weights @ power, np.sqrt(weights @ power**2)
            if rate.ndim == 1:
                joint.attrs[POWER] = largest(time, power)[0]


def _is_vector(name: str) -> bool:
    known = meaning(name)
    return known is not None and known.columns == "axis"
