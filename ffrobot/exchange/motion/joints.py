"""Coordinates, rates and moments of the joints of an analysis, of planar and of spatial results alike."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...common.arrays import Array, as_rows
from ...common.errors import InputError, did_you_mean, quoted
from ...common.tables import TableWriter
from ...results.file import Results


@dataclass(frozen=True, eq=False)
class JointMotion:
    """One coordinate of a joint over T outputs.

    Attributes:
        name: of the joint; "NAME[k]" of coordinate k where it has several.
        coordinate: (T,) rad, or m along a way.
        rate: (T,) rad/s or m/s.
        moment: (T,) N·m or N, at the joint, behind a gear; None of a joint without motor.
    """

    name: str
    coordinate: Array
    rate: Array
    moment: Array | None


@dataclass(frozen=True, eq=False)
class RobotMotion:
    """The joints of an analysis with their coordinates, at `time` (T,) s; `remarks` say what to know of it."""

    analysis: str
    time: Array
    joints: tuple[JointMotion, ...]
    remarks: tuple[str, ...]


def robot_motion(path: Path, analysis: str | None) -> RobotMotion:
    """From the results file at `path`: of `analysis`, else of the first that has joints which move.

    Raises:
        InputError: there is no such analysis, or none of its joints moves.
    """
    with Results(path) as results:
        known = [name for name in results.analyses if any(_moving(results, name))]
        if analysis is not None and analysis not in results.analyses:
            raise InputError(
                f"{path}: --analysis: expected one of {quoted(results.analyses)}, found"
                f' "{analysis}"{did_you_mean(analysis, results.analyses)}'
            )
        if not known or analysis not in (None, *known):
            raise InputError(f"{path}: expected an analysis with joints that move, found none in {analysis or 'it'}")
        name = analysis or known[0]
        joints = tuple(part for joint in _moving(results, name) for part in _parts(results, name, joint))
        time = results.time(name)
        status = results.attributes(name)["status"]
    if status != "completed":
        return RobotMotion(name, time, joints, (f"{name} ended at t = {time[-1]:g} s: {status}",))
    return RobotMotion(name, time, joints, ())


def _moving(results: Results, analysis: str) -> Iterator[str]:
    """Joints that have a coordinate at each output, in the order of the scene."""
    names = [str(entry["name"]) for entry in results.scene.get("joint", ())]
    return (name for name in names if results.has(f"{analysis}/joints/{name}/coordinate"))


def _parts(results: Results, analysis: str, joint: str) -> Iterator[JointMotion]:
    group = f"{analysis}/joints/{joint}"
    outputs = len(results.time(analysis))
    coordinate, rate = (results[f"{group}/{key}"].reshape(outputs, -1).T for key in ("coordinate", "rate"))
    has_motor = results.has(f"{group}/moment")
    moment = results[f"{group}/moment"].reshape(outputs, -1).T if has_motor else [None] * len(coordinate)
    for k, values in enumerate(zip(coordinate, rate, moment, strict=True)):
        yield JointMotion(joint if len(coordinate) == 1 else f"{joint}[{k}]", *values)


def csv_text(motion: RobotMotion) -> str:
    """A table: `time`, then NAME.coordinate, NAME.rate and, with a motor, NAME.moment of every joint; SI units."""
    columns = {"time": motion.time}
    for joint in motion.joints:
        columns |= {f"{joint.name}.coordinate": joint.coordinate, f"{joint.name}.rate": joint.rate}
        if joint.moment is not None:
            columns[f"{joint.name}.moment"] = joint.moment
    text = io.StringIO()
    TableWriter(text).writerow(columns)
    lines = [",".join(map(repr, row)) for row in as_rows(np.stack(list(columns.values()), axis=1))]
    return text.getvalue() + "\n".join(lines) + "\n"
