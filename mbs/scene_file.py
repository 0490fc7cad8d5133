"""Loading a scene file: syntax, keys, and that everything it refers to exists."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..validation import did_you_mean, load_toml, quoted, validate
from .scene_records import GROUND, Analysis, Load, Scene, SceneKeys, Trajectory
from .time_functions import check_domain


def load_scene(path: Path) -> Scene:
    """Read and validate the scene file at `path`; paths in it come out relative to its folder.

    Raises `InputError` with one line for each wrong key: file, key, expected, found. What depends on modal bodies
    (their points, the length of a link) is checked when these are known.
    """
    data = load_toml(path, "scene file")
    _refuse_unavailable(data, path)
    keys = validate(SceneKeys, _with_times_of_actuation(data), path)
    problems = [f"{path}: {problem}" for problem in _problems(keys)]
    if problems:
        raise InputError("\n".join(problems))
    for describe, item, times in _prescribed(keys):
        for component, function in item.components.items():
            key = "waypoints" if isinstance(item, Trajectory) and item.waypoints is not None else component
            derivatives = 2 if isinstance(item, Trajectory) else 0
            check_domain(function, times, f"{path}: {describe}: {key}", derivatives)
    return Scene(**dict(keys), path=path.absolute(), text=path.read_text(encoding="utf-8"))


def _refuse_unavailable(data: dict[str, Any], path: Path) -> None:
    """Say so plainly, before the keys of what is not there yet are called wrong."""
    if data.get("space") == "spatial":
        raise InputError(f'{path}: space: expected "planar", found "spatial", which is not available yet')
    analyses = data.get("analysis")
    for analysis in analyses if isinstance(analyses, list) else []:
        if isinstance(analysis, dict) and analysis.get("kind") == "fcid":
            name = analysis.get("name")
            raise InputError(
                f'{path}: analysis "{name}": kind: expected "pcid", "forward" or "static", found "fcid", which is not'
                " available yet"
            )


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
    yield from _duplicates("pzt", (layout.body for layout in scene.pzt))
    yield from _body_problems(scene)
    yield from _joint_references(scene)
    yield from _pzt_problems(scene)
    for k, analysis in enumerate(scene.analysis):
        for problem in _analysis_problems(scene, analysis, scene.analysis[:k]):
            yield f'analysis "{analysis.name}": {problem}'


def _duplicates(kind: str, names: Iterable[str]) -> Iterator[str]:
    for name, count in Counter(names).items():
        if count > 1:
            yield f'{kind} "{name}": expected one {kind} of this name, found {count}'


def _references(scene: SceneKeys) -> Iterator[tuple[str, str]]:
    """Every (key, "BODY" or "BODY.POINT") in the scene."""
    for joint in scene.joint:
        for k, side in enumerate(joint.between):
            if side != GROUND:
                yield f'joint "{joint.name}": between[{k}]', side
    for trajectory in scene.trajectory:
        if trajectory.point is not None:
            yield f'trajectory "{trajectory.name}": point', trajectory.point
        if trajectory.angle is not None:
            yield f'trajectory "{trajectory.name}": angle', trajectory.angle
    for layout in scene.pzt:
        yield f'pzt "{layout.body}": body', layout.body
    for k, load in enumerate(scene.load, 1):
        if load.point is not None:
            yield f"load no. {k}: point", load.point
    for k, payload in enumerate(scene.payload, 1):
        yield f"payload no. {k}: point", payload.point
    for table, guesses in (("angles", scene.initial.angles), ("rates", scene.initial.rates)):
        for body in guesses:
            yield f"initial.{table}", body


def _body_problems(scene: SceneKeys) -> Iterator[str]:
    bodies = {body.name: body for body in scene.body}
    if GROUND in bodies:
        yield f'body "{GROUND}": name: expected any other name, found "{GROUND}", which is the fixed frame'
    for key, reference in _references(scene):
        name, _, point = reference.partition(".")
        if name not in bodies:
            hint = did_you_mean(name, bodies)
            yield f'{key}: expected one of the bodies {quoted(bodies)}, found "{reference}"{hint}'
            continue
        rigid = bodies[name].rigid
        if point and rigid is not None and point not in rigid.points:
            hint = did_you_mean(point, rigid.points)
            yield f'{key}: expected one of the points {quoted(rigid.points)} of "{name}", found "{reference}"{hint}'


def _joint_references(scene: SceneKeys) -> Iterator[str]:
    joints = [joint.name for joint in scene.joint]
    uses = [(f'trajectory "{trajectory.name}": joint', trajectory.joint) for trajectory in scene.trajectory]
    uses += [(f"load no. {k}: joint", load.joint) for k, load in enumerate(scene.load, 1)]
    for key, name in uses:
        if name is not None and name not in joints:
            yield f'{key}: expected one of the joints {quoted(joints)}, found "{name}"{did_you_mean(name, joints)}'


def _pzt_problems(scene: SceneKeys) -> Iterator[str]:
    rigid = [body.name for body in scene.body if body.rigid is not None]
    layouts = {layout.body: layout for layout in scene.pzt}
    for name in layouts:
        if name in rigid:
            yield f'pzt "{name}": body: expected a flexible body, found "{name}", which is rigid'
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


def _analysis_problems(scene: SceneKeys, analysis: Analysis, earlier: tuple[Analysis, ...]) -> Iterator[str]:
    if analysis.kind == "pcid" and not scene.trajectory:
        yield 'kind: expected at least one [[trajectory]] for "pcid", found none'
    if analysis.actuation is None:
        return
    sources = {source.name: source for source in earlier}
    source = sources.get(analysis.actuation)
    if source is None:
        later = any(analysis.actuation == other.name for other in scene.analysis)
        why = ", which does not come before this one" if later else did_you_mean(analysis.actuation, sources)
        yield f'actuation: expected an earlier analysis, {quoted(sources)}, found "{analysis.actuation}"{why}'
        return
    if source.kind != "pcid":
        yield f'actuation: expected an analysis of kind "pcid", found "{source.name}" of kind "{source.kind}"'
    elif source.integrator == "generalized-alpha":
        yield (
            f"actuation: expected an analysis whose steps can be made again to replay it (any integrator but"
            f' "generalized-alpha"), found "{source.name}" with that'
        )
    elif analysis.end > source.end:
        yield f'end: expected at most {source.end:g}, where "{source.name}" ends, found {analysis.end:g}'
    if analysis.apply == "joints+pzt" and not scene.pzt:
        yield 'apply: expected at least one [[pzt]] for "joints+pzt", found none'


def _prescribed(scene: SceneKeys) -> Iterator[tuple[str, Trajectory | Load, Any]]:
    """Trajectories and loads with all the output times at which they are needed."""
    specified = [a for a in scene.analysis if a.kind != "forward"]
    for trajectory in scene.trajectory:
        for analysis in specified:
            yield f'trajectory "{trajectory.name}"', trajectory, analysis.times
    for k, load in enumerate(scene.load, 1):
        for analysis in scene.analysis:
            yield f"load no. {k}", load, analysis.times
