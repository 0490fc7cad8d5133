"""Loading a scene file: syntax, keys, and that everything it refers to exists."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ...common.errors import InputError
from ...common.validation import did_you_mean, load_toml, plain, quoted, validate
from ...fe_models.link_file import LinkTable, read_link
from ..fields.field_types import GROUND
from ..fields.functions import check_domain
from .analysis_records import Analysis
from .linear_checks import linear_problems
from .loads import Load
from .scene import Scene, SceneKeys
from .trajectories import Trajectory

MADE_IN_PYTHON = "<scene made in Python>"


def load_scene(path: Path) -> Scene:
    """Read and validate the scene file at `path`; paths in it come out relative to its folder.

    Raises `InputError` with one line for each wrong key: file, key, expected, found. What depends on modal bodies
    (their points, the length of a link) is checked when these are known.
    """
    data = load_toml(path, "scene file")
    return _scene(data, path, path.read_text(encoding="utf-8"))


def make_scene(*, folder: PathLike[str] | str = ".", **keys: Any) -> Scene:  # noqa: ANN401 (whatever TOML may hold)
    """A scene from Python, with the keys of a scene file: tables are dictionaries, arrays of tables lists of them.

    Files it names are looked for in `folder`. NumPy numbers and arrays, tuples and paths may stand for numbers, lists
    and text; keys that are None are left out. Functions may stand for expressions: see `functions.user_function`.
    Raises `InputError` as `load_scene` does.
    """
    import tomli_w

    path = Path(folder) / MADE_IN_PYTHON
    functions: dict[str, object] = {}
    try:
        text = tomli_w.dumps(plain(keys, functions))
    except TypeError as error:
        raise InputError(f"{path}: expected numbers, text, lists and tables, found something else: {error}") from None
    return _scene(tomllib.loads(text), path, text, functions)


def _scene(data: dict[str, Any], path: Path, text: str, objects: Mapping[str, object] | None = None) -> Scene:
    """The validated scene of `data`, which was read from `path` as `text`."""
    _refuse_unavailable(data, path)
    keys = validate(SceneKeys, _with_times_of_actuation(data), path, objects)
    problems = [f"{path}: {problem}" for problem in _problems(keys)]
    if problems:
        raise InputError("\n".join(problems))
    for link in (body.link for body in keys.body):
        if isinstance(link, LinkTable):
            read_link(link)
    for describe, item, times in _prescribed(keys):
        for component, function in item.components.items():
            key = "waypoints" if isinstance(item, Trajectory) and item.waypoints is not None else component
            derivatives = 2 if isinstance(item, Trajectory) else 0
            check_domain(function, times, f"{path}: {describe}: {key}", derivatives)
    for analysis in keys.analysis:
        for body, functions in (analysis.modal or {}).items():
            for k, function in enumerate(functions):
                check_domain(function, analysis.times, f'{path}: analysis "{analysis.name}": modal.{body}[{k}]')
    return Scene(**dict(keys), path=path.absolute(), text=text)


def _refuse_unavailable(data: dict[str, Any], path: Path) -> None:
    """Say so plainly, before the keys of what is not there yet are called wrong."""
    if data.get("space") == "spatial":
        raise InputError(f'{path}: space: expected "planar", found "spatial", which is not available yet')


def _with_times_of_actuation(data: dict[str, Any]) -> dict[str, Any]:
    """`data` with the `end` and `output_step` of forward analyses taken from their actuation where not given."""
    try:
        sources = {analysis["name"]: analysis for analysis in data["analysis"]}
        analyses = []
        for analysis in data["analysis"]:
            source = sources.get(analysis.get("actuation"), {})
            times = {key: source[key] for key in ("end", "output_step") if key in source}
            analyses.append(times | analysis)
    except (KeyError, TypeError, AttributeError):
        return data  # malformed: validation says how
    return data | {"analysis": analyses}


def _problems(scene: SceneKeys) -> Iterator[str]:
    """Everything in the scene that refers to something that does not exist or does not fit."""
    for kind in ("body", "joint", "trajectory", "analysis"):
        yield from _duplicates(kind, (record.name for record in getattr(scene, kind)))
    for kind in ("pzt", "actuation_points"):
        yield from _duplicates(kind, (layout.body for layout in getattr(scene, kind)))
    yield from _body_problems(scene)
    yield from _joint_problems(scene)
    yield from _pzt_problems(scene)
    yield from _stiffening_problems(scene)
    yield from _disturbance_problems(scene)
    for k, analysis in enumerate(scene.analysis):
        for problem in _analysis_problems(scene, analysis, scene.analysis[:k]):
            yield f'analysis "{analysis.name}": {problem}'


def _duplicates(kind: str, names: Iterable[str]) -> Iterator[str]:
    for name, count in Counter(names).items():
        if count > 1:
            yield f'{kind} "{name}": expected one {kind} of this name, found {count}'


def _body_problems(scene: SceneKeys) -> Iterator[str]:
    bodies = {body.name: body for body in scene.body}
    if GROUND in bodies:
        yield f'body "{GROUND}": name: expected any other name, found "{GROUND}", which is the fixed frame'
    for reference in scene.references():
        if reference.kind != "body":
            continue
        name, _, point = reference.name.partition(".")
        if name not in bodies:
            hint = did_you_mean(name, bodies)
            yield f'{reference.key}: expected one of the bodies {quoted(bodies)}, found "{reference.name}"{hint}'
            continue
        rigid = bodies[name].rigid
        if point and rigid is not None and point not in rigid.points:
            hint = did_you_mean(point, rigid.points)
            yield (
                f'{reference.key}: expected one of the points {quoted(rigid.points)} of "{name}", found'
                f' "{reference.name}"{hint}'
            )


def _joint_problems(scene: SceneKeys) -> Iterator[str]:
    joints = {joint.name: joint for joint in scene.joint}
    yield from _elastic_joint_problems(scene, [name for name, joint in joints.items() if joint.elastic_gear("section")])
    for reference in scene.references():
        if reference.kind != "joint":
            continue
        if reference.name not in joints:
            hint = did_you_mean(reference.name, joints)
            yield f'{reference.key}: expected one of the joints {quoted(joints)}, found "{reference.name}"{hint}'
        elif joints[reference.name].coordinate("section") is None:
            moving = [name for name, joint in joints.items() if joint.coordinate("section") is not None]
            yield (
                f"{reference.key}: expected a joint that moves ({quoted(moving)}), found"
                f' "{reference.name}", a {joints[reference.name].type}'
            )


def _elastic_joint_problems(scene: SceneKeys, elastic: list[str]) -> Iterator[str]:
    for a in scene.analysis:
        of_motors = [(f"sensor no. {k}: motor", s.motor) for k, s in enumerate(a.sensor, 1)]
        for k, controller in enumerate(a.controller, 1):
            if getattr(controller, "side", "joint") == "motor":
                of_motors += [(f"controller no. {k}: side: motor", name) for name in getattr(controller, "joints", ())]
        for key, name in of_motors:
            if name is not None and name not in elastic:
                yield f'analysis "{a.name}": {key}: expected a joint with stiffness ({quoted(elastic)}), found "{name}"'


def _pzt_problems(scene: SceneKeys) -> Iterator[str]:
    rigid = [body.name for body in scene.body if body.rigid is not None]
    layouts = {layout.body: layout for layout in scene.pzt}
    uses = [(f'pzt "{name}": body', name) for name in layouts]
    uses += [(f'analysis "{a.name}": modal', name) for a in scene.analysis for name in a.modal or ()]
    for key, name in uses:
        if name in rigid:
            yield f'{key}: expected a flexible body, found "{name}", which is rigid'
    for analysis in scene.analysis:
        for key, body in _patches_of_loop(analysis):
            if body not in layouts:
                hint = did_you_mean(body, layouts)
                yield f'{key}: expected a body with patches, {quoted(layouts)}, found "{body}"{hint}'
    for k, load in enumerate(scene.load, 1):
        if load.pzt is None or load.voltage is None:
            continue
        if load.pzt not in layouts:
            hint = did_you_mean(load.pzt, layouts)
            yield f'load no. {k}: pzt: expected a body with patches, {quoted(layouts)}, found "{load.pzt}"{hint}'
        elif len(load.voltage) != (count := layouts[load.pzt].patch_count):
            yield (
                f"load no. {k}: voltage: expected {count} expressions, one for each patch of"
                f' "{load.pzt}", found {len(load.voltage)}'
            )


def _patches_of_loop(analysis: Analysis) -> Iterator[tuple[str, str]]:
    """Every (key, body) whose patches a closed loop reads or drives."""
    for k, sensor in enumerate(analysis.sensor, 1):
        if sensor.pzt is not None:
            yield f'analysis "{analysis.name}": sensor no. {k}: pzt', sensor.pzt
    for k, controller in enumerate(analysis.controller, 1):
        for body in getattr(controller, "bodies", ()):
            yield f'analysis "{analysis.name}": controller no. {k}: bodies', body


def _stiffening_problems(scene: SceneKeys) -> Iterator[str]:
    """What acts between the interfaces of a link: modal body files hold no geometric stiffness of such loads."""
    if scene.geometric_stiffening is False:
        return
    for points in scene.actuation_points:
        yield f'geometric_stiffening: expected false beside [[actuation_points]], found those of "{points.body}"'
    for layout in scene.pzt:
        if "mass" in layout.structural:
            yield (
                'geometric_stiffening: expected no patches with structural = ["mass"], whose inertia loads the link'
                f' between its interfaces, found those of "{layout.body}"'
            )


def _disturbance_problems(scene: SceneKeys) -> Iterator[str]:
    for analysis in scene.analysis:
        for k, load in enumerate(analysis.disturbance, 1):
            if load.force is not None:
                key = f'analysis "{analysis.name}": disturbance no. {k}: force'
                yield f"{key}: expected expressions in t, found a function, which only a [[load]] may have"


def _analysis_problems(scene: SceneKeys, analysis: Analysis, earlier: tuple[Analysis, ...]) -> Iterator[str]:
    if analysis.kind in ("pcid", "fcid", "motors-only") and not scene.trajectory:
        yield f'kind: expected at least one [[trajectory]] for "{analysis.kind}", found none'
    if analysis.kind in ("linear", "placement"):
        yield from linear_problems(scene, analysis, earlier)
    if analysis.actuation is None:
        return
    sources = {source.name: source for source in earlier}
    source = sources.get(analysis.actuation)
    if source is None:
        later = any(analysis.actuation == other.name for other in scene.analysis)
        why = ", which does not come before this one" if later else did_you_mean(analysis.actuation, sources)
        yield f'actuation: expected an earlier analysis, {quoted(sources)}, found "{analysis.actuation}"{why}'
        return
    if source.kind not in ("pcid", "fcid", "motors-only"):
        yield (
            f'actuation: expected an analysis of kind "pcid", "fcid" or "motors-only", found "{source.name}" of kind'
            f' "{source.kind}"'
        )
    elif source.kind == "pcid" and source.integrator == "generalized-alpha":
        yield (
            f"actuation: expected an analysis whose steps can be made again to replay it (any integrator but"
            f' "generalized-alpha"), found "{source.name}" with that'
        )
    elif analysis.end > source.end:
        yield f'end: expected at most {source.end:g}, where "{source.name}" ends, found {analysis.end:g}'
    if analysis.kind == "closed-loop" and analysis.feed_forward == "joints+pzt" and not scene.pzt:
        yield 'feed_forward: expected at least one [[pzt]] for "joints+pzt", found none'
    if analysis.apply == "joints+pzt" and not scene.pzt:
        yield 'apply: expected at least one [[pzt]] for "joints+pzt", found none'
    if analysis.apply == "points" and not scene.actuation_points:
        yield 'apply: expected at least one [[actuation_points]] for "points", found none'
    if source.kind == "motors-only" and analysis.feed_forward == "joints+pzt":
        yield 'feed_forward: expected "joints" with an analysis of kind "motors-only", found "joints+pzt"'
    if source.kind == "motors-only" and analysis.kind == "forward" and analysis.apply != "joints":
        yield f'apply: expected "joints" with an analysis of kind "motors-only", found "{analysis.apply}"'
    if analysis.apply == "trajectory" and source.kind == "fcid":
        yield (
            f'apply: expected "joints", "joints+pzt" or "points" with an analysis of kind "fcid", found "trajectory":'
            f' "{source.name}" takes more than the forces on its trajectories'
        )


def _prescribed(scene: SceneKeys) -> Iterator[tuple[str, Trajectory | Load, Any]]:
    """Trajectories and loads with all the output times at which they are needed."""
    specified = [a for a in scene.analysis if a.kind != "forward"]
    for analysis in scene.analysis:
        for k, load in enumerate(analysis.disturbance, 1):
            yield f'analysis "{analysis.name}": disturbance no. {k}', load, analysis.times
    for trajectory in scene.trajectory:
        for analysis in specified:
            yield f'trajectory "{trajectory.name}"', trajectory, np.clip(analysis.times, 0.0, analysis.end)
    for k, load in enumerate(scene.load, 1):
        for analysis in scene.analysis:
            yield f"load no. {k}", load, np.clip(analysis.times, 0.0, analysis.end)
