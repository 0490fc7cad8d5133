"""A map from its plan to its file: postures, then quantities in parallel, part by part, resumable."""

import hashlib
import io
import json
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from threading import local
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from ..batch.batch import Batch
from ..common.arrays import Array, Booleans, Indices
from ..common.errors import InputError, SolveError, check_known, did_you_mean, quoted
from ..common.files import check_folder, check_new_folder, write_atomically
from ..common.keys import MOST_RUNS
from ..common.python_files import allowed_python, python_allowed
from ..common.structs import struct
from ..common.tables import shown
from ..mbs.fields.field_types import Quantity
from ..mbs.linear.linearisation import labelled
from ..mbs.linear.poses import PoseEvaluator
from ..mbs.posture.workspace import TURN, GridAxis, Postures, grid_postures
from ..mbs.scene.space import SPACES
from ..milling.process import Milling, stable_depths
from ..run.inputs import changed, fingerprints, read_tables
from ..run.prepare import prepare_scene
from ..run.result import Solution
from ..run.watcher import Watcher
from ..scene.load import load_scene
from ..scene.scene import Scene

MOST_AXES = 3


def parse_grid(texts: Sequence[str], scene: Scene) -> tuple[GridAxis, ...]:
    """Return the axes of a grid over joints of `scene`, or over x, y, z of a point and turns of a tool.

    Each of `texts` is "NAME=FIRST:LAST:COUNT" or "NAME=VALUE,VALUE", in m or rad. Raises `InputError` for other texts,
    and for joints and directions that are mixed, unknown, or too many.
    """
    axes = tuple(_axis(text, scene) for text in texts)
    names = [axis.name for axis in axes]
    if twice := {name for name in names if names.count(name) > 1}:
        raise InputError("--over: expected each joint or direction once", f"{quoted(sorted(twice))} again")
    long = [axis for axis in axes if len(axis.values) > 1]
    if any(axis.is_place for axis in axes) and not all(axis.is_place for axis in long):
        raise InputError(
            "--over: expected joints alone or directions of a point alone, or with joints of one value",
            quoted(names),
        )
    if not axes or len(long) > MOST_AXES:
        raise InputError(f"--over: expected one to {MOST_AXES} axes with several values", len(long))
    if (count := math.prod(len(axis.values) for axis in axes)) > MOST_RUNS:
        raise InputError(f"--over: expected at most {MOST_RUNS} poses", count)
    return axes


def _axis(text: str, scene: Scene) -> GridAxis:
    name, equals, values = (part.strip() for part in text.partition("="))
    places = ["xyz"[k] for k in SPACES[scene.space].translations] + [TURN] * (not scene.is_planar)
    units = {joint.name: joint.units[0] for joint in scene.joint if joint.units}
    joints = list(units)
    if not equals or name not in (*joints, *places):
        raise InputError(
            f"--over: expected NAME=FIRST:LAST:COUNT of a joint ({quoted(joints)}) or of {quoted(places)}",
            f'"{shown(text)}"{did_you_mean(name, joints)}',
        )
    number, grid = TypeAdapter(Quantity).validate_python, None
    with suppress(ValueError):  # pydantic's are, too
        match values.split(":"):
            case [first, last, count] if 1 <= int(count) <= MOST_RUNS:
                grid = np.linspace(number(first), number(last), int(count))
            case [listed]:
                grid = np.array([number(each) for each in listed.split(",")])
    if grid is None:
        raise InputError(
            "--over: expected NAME=FIRST:LAST:COUNT or NAME=VALUE,VALUE, such as shoulder=-90*deg:90*deg:31",
            f'"{shown(text)}"',
        )
    return GridAxis(name, grid, name not in joints, units.get(name, "rad" if name == TURN else "m"))


PLAN, POSTURES, PARTS = "plan.json", "postures.npz", "parts"
A_PART = 64  # poses that one process judges before it asks for more
OUT_OF_REACH, OUTSIDE_LIMITS, NO_EQUILIBRIUM = 1, 2, 3
STATUS = ("found", "out of reach", "outside joint limits", "no equilibrium")


@struct
class MapPlan:
    """Settings of a map of a scene over the grid of `axes`, with its folder."""

    scene: Path
    axes: tuple[GridAxis, ...]
    point: str  # "BODY.POINT" whose stiffness is mapped, and whose positions a grid over x, y, z has
    keeps_orientation: bool  # whether the body of the point keeps the orientation of the start
    count: int  # number of natural frequencies in each pose
    frequencies: Array  # (F,) of the frequency response, Hz
    folder: Path
    milling: Milling | None = None  # process whose stable depths are mapped

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of grid points along each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def turned_about(self) -> Array | None:
        """Unit vector (3,) about which the grid turns a tool, in its axes, else global ones; None without turns."""
        if self.milling is None or not any(axis.is_turn for axis in self.axes):
            return None
        return np.array(self.milling.axis) / np.linalg.norm(self.milling.axis)


@struct
class PoseMap:
    """A map of P poses: `values` (P, …) by name, in units of `map_file.UNITS`, NaN without a pose or a limit.

    `motors` have coordinates in `units`, "rad" or "m", and `limits` (motors,), N·m or N. `status` (P,): index in
    `STATUS`. `q` (P, n_q): coordinates of the model, SI units.
    """

    plan: MapPlan
    motors: tuple[str, ...]
    units: tuple[str, ...]
    limits: Array
    status: Indices
    values: Mapping[str, Array]
    q: Array


def plan_map(
    scene: Path,
    over: tuple[str, ...],
    folder: Path,
    point: str | None = None,
    orientation: str = "auto",
    count: int = 3,
    frequencies: Array | None = None,
    milling: Milling | None = None,
) -> MapPlan:
    """Return the plan of a map with frequency responses at `frequencies` (F,), Hz; see `MapPlan`.

    `over`: texts of the grid's axes. `orientation` "start" keeps that of the start, "auto" if paths prescribe one.
    Raises `InputError` for a wrong scene, grid or point, and for a folder of something else.
    """
    check_folder(folder)
    loaded = load_scene(scene)
    axes = parse_grid(over, loaded)
    if milling is None and any(axis.is_turn for axis in axes):
        raise InputError(f"--over: {TURN}: expected --milling with the axis that the tool turns about", "none")
    keeps = orientation == "start"
    if orientation == "auto":
        keeps = any(axis.is_place for axis in axes) and any(path.orientation is not None for path in loaded.trajectory)
    point, at = point or default_point(loaded), np.zeros(0) if frequencies is None else frequencies
    return MapPlan(scene, axes, point, keeps, count, frequencies=at, folder=folder, milling=milling)


def default_point(scene: Scene) -> str:
    """Return the scene's tool, else a point of the last body: that of a payload, "tip", or the last one."""
    body = scene.body[-1]
    carried = [one.point for one in scene.payload if one.point.partition(".")[0] == body.name]
    points = ["tip"] if body.rigid is None else list(body.rigid.points)
    last = "tip" if "tip" in points else points[-1]
    return scene.tool_point or (carried[-1] if carried else f"{body.name}.{last}")


def make_map(plan: MapPlan, batch: Batch, watcher: Watcher) -> PoseMap:
    """Compute all poses of the grid; parts from an earlier run of the same plan are read from the folder.

    Raises `InputError` without motors, and for unknown points or axes; `SolveError` if no pose is possible.
    """
    solution = prepare_scene(plan.scene, watcher)
    if not solution.model.motors:
        raise InputError(
            f"{plan.scene}: joint: expected motors that keep the poses of a map",
            "none: joints of kinematic loops have them with motor = true alone",
        )
    check_point(solution, plan.point)
    watcher.stage("postures")
    request = _request(plan)
    kept = _kept_postures(plan, request)
    postures = kept or grid_postures(
        solution.model, plan.axes, plan.point, keeps_orientation=plan.keeps_orientation, turned_about=plan.turned_about
    )
    good = postures.reached & postures.within
    if not good.any():
        raise SolveError(f"{plan.scene}: no pose of the grid is within reach and the limits of the joints")
    first = tuple(postures.q[int(good.argmax())])
    of = _PosesOf(f"{request}{first}", replace(plan, scene=plan.scene.absolute()), allowed_python(), first)
    evaluator = of.evaluator(solution)
    if kept is None:  # what was made from other input goes
        for file in (plan.folder / POSTURES, *(plan.folder / PARTS).glob("*.npz")):
            file.unlink(missing_ok=True)
        content = json.dumps(request).encode()
        write_atomically(plan.folder / PLAN, content, "plan of the map", make_folder=True, ours=True)
        _write(plan.folder / POSTURES, postures._asdict())
    numbers = np.flatnonzero(good)
    parts = [numbers[k : k + A_PART] for k in range(0, len(numbers), A_PART)]
    named = {hashlib.sha256(part.tobytes() + postures.q[part].tobytes()).hexdigest()[:24]: part for part in parts}
    judged = _judged(of, postures, named, batch, watcher)
    if not any(columns["stands"].any() for columns in judged.values()):
        raise SolveError(f"{plan.scene}: no pose of the grid has a stable equilibrium")
    return _assembled(plan, solution, evaluator, postures, [(part, judged[name]) for name, part in named.items()])


def check_point(solution: Solution, point: str, place: str = "--point") -> None:
    """Raise `InputError` where the robot has no such point; `place`: the option or table that names it."""
    known = [f"{body}.{name}" for body, of in solution.bodies.items() for name in of.spatial.points]
    check_known(point, known, f"{solution.scene.path}: {place}: expected one of {quoted(known)}")


def _judged(
    of: "_PosesOf", postures: Postures, parts: Mapping[str, Indices], batch: Batch, watcher: Watcher
) -> Mapping[str, Mapping[str, Array]]:
    """Findings by name of the part, from files or as jobs of `batch`."""
    files = {name: of.plan.folder / PARTS / f"{name}.npz" for name in parts}
    known = {name: columns for name, file in files.items() if (columns := _read(file)) is not None}
    left = [name for name in parts if name not in known]
    watcher.stage(f"{sum(len(parts[name]) for name in left)} poses")
    for number, columns in batch.results(_judge, [(of, postures.q[parts[name]]) for name in left]):
        _write(files[left[number]], columns)
        known[left[number]] = columns
        watcher.advance(len(known), len(parts))
    return known


_evaluators = local()  # which serves one thread


@struct
class _PosesOf:
    """Job data: plan of a map, folders with allowed Python files, some posture q (n_q,); `key`: text of all inputs."""

    key: str
    plan: MapPlan
    allowed: tuple[Path, ...]
    q: tuple[float, ...]

    def evaluator(self, solution: Solution | None = None) -> PoseEvaluator:
        """Made once in each thread; processes forked from this one inherit it."""
        kept = vars(_evaluators)
        if self.key not in kept:
            kept.clear()
            with python_allowed(self.allowed):
                model = (solution or prepare_scene(self.plan.scene)).model
            judge = partial(stable_depths, self.plan.milling) if self.plan.milling else None
            omega = 2 * np.pi * self.plan.frequencies
            kept[self.key] = PoseEvaluator(
                model, np.array(self.q), self.plan.point, count=self.plan.count, omega=omega, judge=judge
            )
        made: PoseEvaluator = kept[self.key]
        return made


def _judge(job: tuple[_PosesOf, Array]) -> dict[str, Array]:
    """Findings of poses q (N, n_q) by name, (N, …); nan where there is no equilibrium."""
    evaluator = job[0].evaluator()
    poses = list[dict[str, Array]]()
    for each in job[1]:
        poses.append({})
        with suppress(SolveError):
            poses[-1] = evaluator.at(each)
    judged = next(filter(None, poses), {})
    none = {name: np.full_like(value, np.nan) for name, value in judged.items()}
    table = {name: np.array([(one or none)[name] for one in poses]) for name in judged}
    return {"stands": np.array(list(map(bool, poses))), **table}


def _read(path: Path) -> dict[str, Array] | None:
    with suppress(OSError, ValueError, KeyError, EOFError), np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}
    return None


def _write(path: Path, columns: Mapping[str, Array]) -> None:
    content = io.BytesIO()
    np.savez(content, **columns)
    write_atomically(path, content.getvalue(), "part of the map", make_folder=True, ours=True)


def _request(plan: MapPlan) -> dict[str, Any]:
    asked = {
        "scene": str(plan.scene.absolute()),
        "axes": [[axis.name, axis.values.tolist()] for axis in plan.axes],
        "point": plan.point,
        "keeps_orientation": plan.keeps_orientation,
        "count": plan.count,
        "frequencies": plan.frequencies.tolist(),
        **({} if plan.milling is None else {"milling": plan.milling.model_dump(mode="json")}),
    }
    return {"asked": asked, "inputs": fingerprints(read_tables(plan.scene), plan.scene)}


def _kept_postures(plan: MapPlan, request: Mapping[str, Any]) -> Postures | None:
    """Postures of an earlier run of the same map; None without one. Raises `InputError` for other files."""
    before: dict[str, Any] = {}
    with suppress(OSError, ValueError):
        before = json.loads((plan.folder / PLAN).read_text(encoding="utf-8"))
    if not before:
        check_new_folder(plan.folder)
    if before.get("asked") != request["asked"] or changed(before.get("inputs", {}), request["inputs"]):
        return None
    stored: dict[str, Any] = _read(plan.folder / POSTURES) or {}
    return Postures(**stored) if stored.keys() == set(Postures._fields) else None


def _assembled(
    plan: MapPlan,
    solution: Solution,
    evaluator: PoseEvaluator,
    postures: Postures,
    parts: list[tuple[Indices, Mapping[str, Array]]],
) -> PoseMap:
    status = np.where(postures.reached, np.where(postures.within, 0, OUTSIDE_LIMITS), OUT_OF_REACH).astype(np.intp)
    values: dict[str, Array] = {}
    for part, columns in parts:
        stands: Booleans = columns["stands"].astype(bool)
        status[part[~stands]] = NO_EQUILIBRIUM
        for name, value in columns.items():
            if name != "stands":
                whole = values.setdefault(name, np.full((len(status), *value.shape[1:]), np.nan))
                whole[part] = value
    names, about = tuple(name.split("/")[1] for name in evaluator.motors), dict[str, tuple[str, float]]()
    for joint in solution.scene.motor_joints:
        labels = [name.removeprefix("joint/") for name, _ in labelled(solution.model, joint.name)]
        about |= zip(labels, zip(joint.units, (limit.moment for limit in joint.motor_limits), strict=True), strict=True)
    units, moments = zip(*(about[name] for name in names), strict=True)
    limits = np.where(np.isfinite(moments), moments, np.nan)
    values["torque_share"] = np.abs(values["torque"]) / limits
    return PoseMap(plan, names, units, limits, status, values=values, q=postures.q)
