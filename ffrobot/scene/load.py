"""Loading a scene from a file or from Python: syntax, keys, and that everything it refers to exists."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ..common.arrays import Array
from ..common.deferred import loaded
from ..common.errors import InputError, did_you_mean, quoted, refuse
from ..common.files import AnyPath
from ..common.python_files import python_allowed
from ..common.toml_files import load_toml, parse_toml, read_text
from ..common.validation import plain, validate
from ..fe_models.link_source import LinkTable
from ..mbs._core import TimeFunction
from ..mbs.fields.field_types import GROUND
from ..mbs.fields.functions import check_derivatives, check_domain
from ..mbs.fields.spelling import PLANAR, SPATIAL
from ..mbs.joints.joint import JointRecord, coordinate_names
from ..mbs.scene.analysis import Analysis, Surroundings
from ..mbs.scene.bodies import BodyKeys
from ..mbs.scene.mechanism import in_3d
from ..mbs.scene.space import SPACES
from ..mbs.scene.trajectories import Trajectory
from .kinds import KINDS
from .scene import Scene, SceneKeys

DRIVEN = 'that voltages drive (electrodes = "driven", no shunt)'
MADE_IN_PYTHON = "<scene made in Python>"

# Keys of planar scenes that 3D scenes do not have, by the table in which they stand, and what there is instead.
_AXES = "forces at points are along x, y and z, axes of the body"
UNAVAILABLE = {
    "initial": {
        "angles": "the guess is of joint coordinates, joints = { … }",
        "rates": "the guess is of joint coordinates, joint_rates = { … }",
    },
    "actuation_points": {"transverse": _AXES, "axial": _AXES},
}


def load_scene(path: AnyPath, *, allow_python: Sequence[AnyPath] = ()) -> Scene:
    """Read and validate a scene file; paths in it become relative to its folder.

    `solve` checks values that depend on modal bodies, such as points and lengths of links.

    Args:
        path: the scene file.
        allow_python: as in `solve`.

    Returns:
        The scene, which is immutable.

    Raises:
        InputError: one line for each wrong key.

    Example:
        scene = ffrobot.load_scene("scene.toml")
    """
    path = Path(path)
    with python_allowed(map(Path, allow_python)):
        return validated_scene(load_toml(path, "scene file"), path, read_text(path, "scene file"))


def load_robot(path: Path) -> Scene:
    """Read a scene file as `load_scene`, except that it may have no analyses, as imported robots have none."""
    data, rest = load_toml(path, "scene file"), [{"name": "rest", "kind": "static"}]
    scene = validated_scene({"analysis": rest} | data, path, read_text(path, "scene file"))
    return scene if "analysis" in data else scene.model_copy(update={"analysis": ()})


def make_scene(*, folder: PathLike[str] | str = ".", **keys: Any) -> Scene:
    """Make a scene in Python, with the keys of a scene file.

    Args:
        folder: folder of the files that the scene names.
        keys: tables are dictionaries, arrays of tables lists of them. NumPy numbers and arrays, tuples and paths can
            replace numbers, lists and text; functions can replace expressions. None omits a key.

    Returns:
        The scene, for `solve`.

    Raises:
        InputError: one line for each wrong key.

    Example:
        scene = ffrobot.make_scene(name="arm", body=[{"name": "arm", "link": "arm.toml"}], joint=[...], analysis=[...])
    """
    import tomli_w

    path = Path(folder) / MADE_IN_PYTHON
    functions: dict[str, object] = {}
    try:
        text = tomli_w.dumps(plain(keys, functions))
    except (TypeError, RecursionError) as error:
        raise InputError(f"{path}: expected numbers, text, lists and tables", f"something else: {error}") from None
    return validated_scene(parse_toml(text, path, "scene"), path, text, functions)


def validated_scene(
    data: dict[str, Any], path: Path, text: str, functions: Mapping[str, object] | None = None
) -> Scene:
    """Validate the scene `data`, which was read from `path` as `text`; `functions` of Python by their names in it.

    Raises `InputError` as `load_scene` does.
    """
    space = SPATIAL if data.get("space") == SPATIAL else PLANAR
    refuse(_unavailable_keys(data) if space == SPATIAL else (), path)
    keys = validate(SceneKeys, with_times_of_actuation(data), path, functions, space)
    refuse(problems(keys), path)
    for link in (body.link for body in keys.body):
        if isinstance(link, LinkTable):
            from ..fe_models.link_file import read_link

            read_link(link)
    check_functions(keys, path)
    return Scene.model_construct(**dict(in_3d(keys)), path=path.absolute(), text=text)  # the keys are validated


def _unavailable_keys(data: dict[str, object]) -> Iterator[str]:
    for table, keys in UNAVAILABLE.items():
        tables = data.get(table, [])
        for entry in tables if isinstance(tables, list) else [tables]:
            for key, instead in keys.items():
                if isinstance(entry, dict) and key in entry:
                    yield f'{table}: {key}: expected no such key in space = "spatial", found it: {instead}'


def with_times_of_actuation(data: dict[str, Any]) -> dict[str, Any]:
    """Return `data` with `end` and `output_step` of analyses that lack them taken from their `actuation`."""
    try:
        sources = {analysis["name"]: analysis for analysis in data["analysis"]}
        analyses = []
        for analysis in data["analysis"]:
            record = KINDS.modules.get(analysis.get("kind", "")) if "actuation" in analysis else None
            takes = record is not None and "actuation" in loaded(record).model_fields
            source = sources.get(analysis.get("actuation"), {}) if takes else {}
            times = {key: source[key] for key in ("end", "output_step") if key in source}
            analyses.append(times | analysis)
    except (KeyError, TypeError, AttributeError):
        return data  # malformed: validation says how
    return data | {"analysis": analyses}


def problems(scene: SceneKeys) -> Iterator[str]:
    """Yield a line on everything in the scene that refers to something that does not exist or does not fit."""
    yield from _all_duplicates(scene)
    yield from _reference_problems(scene)
    yield from _guess_problems(scene)
    yield from _load_problems(scene)
    yield from _stiffening_problems(scene)
    driven = {joint.name for joint in scene.motor_joints}
    for joint in scene.joint:
        if getattr(joint, "stiffness", None) is not None and joint.name not in driven:
            yield f"{joint.label}: stiffness: expected a joint with a motor (in loops motor = true), found one without"
    for k, analysis in enumerate(scene.analysis):
        among = Surroundings(scene.analysis[:k], scene.analysis[k:], KINDS.records)
        for problem in (*_unmet_needs(scene, analysis), *analysis.problems(among)):
            yield f'analysis "{analysis.name}": {problem}'


def check_functions(scene: SceneKeys, path: Path) -> None:
    """Raise `InputError` for a function of time without a value at an output time at which it is needed."""
    following = [analysis for analysis in scene.analysis if analysis.follows_trajectories]
    for trajectory in scene.trajectory:
        for analysis in following:
            times = np.clip(analysis.times, 0.0, analysis.last_time)
            _check_trajectory(trajectory, times, f'{path}: trajectory "{trajectory.name}"')
    for k, load in enumerate(scene.load, 1):
        for component, function in load.components.items():
            for analysis in scene.analysis:
                times = np.clip(analysis.times, 0.0, analysis.last_time)
                check_domain(function, times, f"{path}: load no. {k}: {component}", 0)
    for analysis in scene.analysis:
        for key, function, derivatives in analysis.prescribed():
            label = f'{path}: analysis "{analysis.name}": {key}'
            if derivatives == 2:
                _check_path(function, analysis.times, label)
            else:
                check_domain(function, analysis.times, label, derivatives)


def _check_trajectory(trajectory: Trajectory, times: Array, label: str) -> None:
    places = None if trajectory.path is None else "via" if trajectory.waypoints is None else "waypoints"
    for component, function in trajectory.components.items():
        _check_path(function, times, f"{label}: {places or component}")
    if (law := trajectory.orientation) is None:
        return
    for function in law.functions:
        _check_path(function, times, f"{label}: {law.kind}")
    if law.kind == "direction":
        sizes = np.linalg.norm([function.sample(times)[0] for function in law.functions], axis=0)
        if sizes.min() <= 1e-9 * sizes.max():
            at = times[sizes.argmin()]
            raise InputError(f"{label}: direction: expected a direction at all times", f"none at t = {at:.9g} s")


def _check_path(function: TimeFunction, times: Array, label: str) -> None:
    """Raise `InputError` for a function of time that no motion can follow, or whose derivatives are others."""
    check_domain(function, times, label, 2)
    if len(times) > 1:
        check_derivatives(function, float(times[-1]), label)


def _all_duplicates(scene: SceneKeys) -> Iterator[str]:
    kinds = ("body", "joint", "trajectory", "analysis")
    named = [(kind, f"expected one {kind} of this name", [one.name for one in getattr(scene, kind)]) for kind in kinds]
    layouts, bodies = [layout.label for layout in scene.pzt], [points.body for points in scene.actuation_points]
    named.append(("pzt", "name: expected a separate name for each layout on a body", layouts))
    named.append(("actuation_points", "body: expected one table for each body", bodies))
    for table, expected, names in named:
        for name, count in Counter(names).items():
            if count > 1:
                yield f'{table} "{name}": {expected}, found {count}'


def _reference_problems(scene: SceneKeys) -> Iterator[str]:
    bodies = {body.name: body for body in scene.body}
    if GROUND in bodies:
        yield f'body "{GROUND}": name: expected any other name, found "{GROUND}", which is the fixed frame'
    joints: dict[str, JointRecord] = {joint.name: joint for joint in scene.joint}
    elastic = [name for name, joint in joints.items() if getattr(joint, "stiffness", None) is not None]
    moving = [name for name, joint in joints.items() if _moves(joint)]
    patched = list(dict.fromkeys(layout.body for layout in scene.pzt))
    layouts = [layout.label for layout in scene.pzt]
    axes = tuple(f"/{'xyz'[k]}" for k in SPACES[scene.space].translations)
    commands = [name for joint in scene.motor_joints for name in coordinate_names(joint.name, len(joint.units))]
    commands += [f"pzt/{of.label}/{k + 1}" for of in scene.pzt if of.is_driven for k in range(of.patch_count)]
    for reference in scene.references():
        key, name = reference.key, reference.name
        match reference.kind:
            case "body":
                yield from _body_problems(scene, bodies, key, name)
            case "elastic joint" if name not in elastic:
                yield f'{key}: expected a joint with stiffness ({quoted(elastic)}), found "{name}"'
            case "joint" if name not in joints:
                yield f'{key}: expected a joint ({quoted(joints)}), found "{name}"{did_you_mean(name, joints)}'
            case "joint" if name not in moving:
                yield f'{key}: expected a joint that moves ({quoted(moving)}), found "{name}", a {joints[name].type}'
            case "flexible body" if name in bodies and bodies[name].rigid is not None:
                yield f'{key}: expected a flexible body, found "{name}", which is rigid'
            case "patched body" if name not in patched:
                hint = did_you_mean(name, patched)
                yield f'{key}: expected a body with patches, {quoted(patched)}, found "{name}"{hint}'
            case "command" | "input" if name not in commands:
                takes_forces = reference.kind == "input"
                if not (takes_forces and name.startswith("force/") and name.endswith(axes)):
                    also = ', or "force/BODY.POINT/x"' * takes_forces
                    wanted = f"motors or driven patches ({quoted(commands)}{also})"
                    yield f'{key}: expected {wanted}, found "{name}"{did_you_mean(name, commands)}'
            case "patches" if name not in layouts:
                wanted = f"one of the layouts {quoted(layouts)}" if layouts else "a layout of patches ([[pzt]])"
                yield f'{key}: expected {wanted}, found "{name}"{did_you_mean(name, layouts)}'


def _body_problems(scene: SceneKeys, bodies: Mapping[str, BodyKeys], key: str, reference: str) -> Iterator[str]:
    """Of "BODY" or "BODY.POINT"; points of links are known with their files."""
    name, _, point = reference.partition(".")
    if name not in bodies:
        yield f'{key}: expected one of the bodies {quoted(bodies)}, found "{reference}"{did_you_mean(name, bodies)}'
    elif point and (rigid := bodies[name].rigid) is not None:
        tools = (tool.reference.partition(".") for tool in scene.tool)
        known = [*rigid.points, *(tool for body, _, tool in tools if body == name)]
        if point not in known:
            hint = did_you_mean(point, known)
            yield f'{key}: expected one of the points {quoted(known)} of "{name}", found "{reference}"{hint}'


def _moves(joint: JointRecord) -> bool:
    """Whether it has coordinates, or a place that [initial] can guess."""
    return bool(joint.units or joint.guess_units)


def _guess_problems(scene: SceneKeys) -> Iterator[str]:
    """Guesses of joints between bodies whose own guesses say the same."""
    initial = scene.initial
    for key, of_joints, bodies, of_bodies in (
        ("joints", initial.joints, "angles", initial.angles),
        ("joint_rates", initial.joint_rates, "rates", initial.rates),
    ):
        for joint in scene.joint:
            turns = joint.name in of_joints and joint.type == "revolute"
            known = [body for body in joint.bodies if body in of_bodies]
            if turns and known and all(body in (GROUND, *known) for body in joint.bodies):
                yield (
                    f"initial.{key}.{joint.name}: expected no guess where initial.{bodies} has {quoted(known)},"
                    " found one"
                )


def _load_problems(scene: SceneKeys) -> Iterator[str]:
    counts = {layout.label: layout.patch_count for layout in scene.pzt}
    shunted = [layout.label for layout in scene.pzt if layout.shunt is not None]
    bare = {layout.body for layout in scene.pzt} - {layout.body for layout in scene.pzt if layout.is_driven}
    for analysis in scene.analysis:
        damped = (name for one in getattr(analysis, "controller", ()) for name in getattr(one, "bodies", ()))
        for name in bare.intersection(damped):
            yield f'analysis "{analysis.name}": bodies: expected patches {DRIVEN}, found "{name}"'
        for sensor in getattr(analysis, "sensor", ()):
            if sensor.pzt in shunted:
                expected = "patches without a shunt, over which their charge flows off"
                yield f'analysis "{analysis.name}": sensor: pzt: expected {expected}, found "{sensor.pzt}"'
    joints: dict[str, JointRecord] = {joint.name: joint for joint in scene.joint}
    for k, load in enumerate(scene.load, 1):
        count, number = counts.get(load.pzt or "", 0), len(load.voltage or ())
        if count and number != count:
            of = f'one for each patch of "{load.pzt}"'
            yield f"load no. {k}: voltage: expected {count} expressions, {of}, found {number}"
        if any(layout.label == load.pzt and not layout.is_driven for layout in scene.pzt):
            yield f'load no. {k}: pzt: expected patches {DRIVEN}, found "{load.pzt}"'
        joint = joints.get(load.joint or "")
        if joint is None or not _moves(joint):
            continue
        if not joint.units:
            yield (
                f'load no. {k}: joint: expected one with coordinates, found "{joint.name}", a {joint.type} joint:'
                " forces and moments on what it joins are loads on points (x, y, z, mx, my, mz)"
            )
        elif (number := len(load.moments)) != len(joint.units):
            of = f'one for each coordinate of "{joint.name}" ({", ".join(joint.units)})'
            yield f"load no. {k}: moment: expected {len(joint.units)} expressions, {of}, found {number}"


def _stiffening_problems(scene: SceneKeys) -> Iterator[str]:
    """Of loads between the interfaces of a link modal body files have no geometric stiffness."""
    if not scene.geometric_stiffening:
        return
    for points in scene.actuation_points if scene.is_planar else ():
        yield f'geometric_stiffening: expected false with [[actuation_points]], found those of "{points.body}"'
    for layout in scene.pzt:
        if layout.adds_mass:
            yield (
                'geometric_stiffening: expected no patches with structural = ["mass"], whose inertia loads the link'
                f' between its interfaces, found those of "{layout.label}"'
            )


def _unmet_needs(scene: SceneKeys, analysis: Analysis) -> Iterator[str]:
    for need in analysis.needs():
        if need.table == "trajectory" and analysis.allocates_patches and not scene.motor_joints:
            continue  # patches alone act, as on a beam that is welded to the ground
        if not getattr(scene, need.table):
            yield f'{need.key}: expected at least one [[{need.table}]] for "{need.value}", found none'
