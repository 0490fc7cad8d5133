"""A scene in space as a whole: its keys, what it refers to, and the one list of what space does not have yet."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ..actuation.patches.spatial_records import SpatialPztLayout
from ..actuation.spatial_points import SpatialActuationPoints
from ..common.arrays import Array
from ..common.errors import InputError
from ..common.toml_files import load_toml, read_text
from ..common.validation import did_you_mean, quoted, validate
from ..fe_models.link_file import LinkTable, read_link
from ..mbs.fields.derivatives import check_derivatives
from ..mbs.fields.field_types import GROUND, NotEmpty
from ..mbs.fields.functions import check_domain
from ..mbs.fields.references import Reference, under
from ..mbs.fields.spelling import PLANAR, SPATIAL
from ..mbs.scene.analysis import Surroundings
from ..mbs.scene.spatial.mechanism import SpatialMechanismKeys, SpatialMechanismScene
from ..mbs.scene.spatial.planar_spelling import in_3d
from ..mbs.scene.spatial.trajectories import SpatialTrajectory
from .actuation_times import with_times_of_actuation
from .kinds import KINDS, AnalysisInSpace

# Keys of planar scenes that scenes in space do not have, by the table in which they stand, and what there is instead.
_AXES = "forces at points are along x, y and z, axes of the body"
UNAVAILABLE = {
    "load": {
        "force": "forces that depend on the motion (functions of Python) are those of planar scenes; what depends on"
        " time alone is x, y, z, mx, my, mz"
    },
    "trajectory": {
        "angle": "the orientation of a point is rotation_vector, rpy or tool_axis with direction, that of a joint its"
        " value"
    },
    "initial": {
        "angles": "the guess is of joint coordinates, joints = { … }",
        "rates": "the guess is of joint coordinates, joint_rates = { … }",
    },
    "actuation_points": {"transverse": _AXES, "axial": _AXES},
}


class SpatialSceneKeys(SpatialMechanismKeys):
    """Keys of a 3D scene file."""

    pzt: tuple[SpatialPztLayout, ...] = ()
    """Layouts of piezoelectric patches; names distinguish several on one body."""
    actuation_points: tuple[SpatialActuationPoints, ...] = ()
    """Points of forces that replace the driving forces."""
    analysis: Annotated[tuple[AnalysisInSpace, ...], NotEmpty]
    """Analyses, in this order."""

    def references(self) -> Iterator[Reference]:
        """All that records of the scene refer to, with their full keys."""
        yield from super().references()
        for layout in self.pzt:
            yield from under(f'pzt "{layout.label}"', layout.references())
        for points in self.actuation_points:
            yield from under(f'actuation_points "{points.body}"', points.references())
        for analysis in self.analysis:
            yield from under(f'analysis "{analysis.name}"', analysis.references())


class SpatialScene(SpatialSceneKeys, SpatialMechanismScene):
    """A validated scene in space, with the absolute `path` of its file and the raw `text` that results files carry."""


def is_spatial(path: Path) -> bool:
    """Whether the scene file says `space = "spatial"`; False of what cannot be read, which others tell."""
    try:
        return bool(load_toml(path, "scene file").get("space") == "spatial")
    except InputError:
        return False


def load_spatial_scene(path: Path) -> SpatialScene:
    """Read and validate the scene file at `path`; paths in it come out relative to its folder.

    Raises `InputError` with one line for each wrong key: file, key, expected, found.
    """
    return available_scene(load_toml(path, "scene file"), path, read_text(path, "scene file"))


def available_scene(
    data: dict[str, Any], path: Path, text: str, functions: Mapping[str, object] | None = None
) -> SpatialScene:
    """The validated scene of `data`, all of which the program can do. Raises `InputError` as `load_spatial_scene`."""
    scene = spatial_scene(data, path, text, functions)
    check_available(scene)
    return scene


def check_available(scene: SpatialScene) -> None:
    """Raise `InputError` with a line for each thing that the records can say and the program cannot do yet."""
    found = [f"{scene.path}: {problem}" for problem in _not_available(scene)]
    if found:
        raise InputError("\n".join(found))


def spatial_scene(
    data: dict[str, Any], path: Path, text: str, functions: Mapping[str, object] | None = None
) -> SpatialScene:
    """The validated scene of `data`, which was read from `path` as `text`; `functions` of Python by their names."""
    space = SPATIAL if data.get("space") == SPATIAL else PLANAR
    refused = [f"{path}: {problem}" for problem in _unavailable_keys(data)] if space == SPATIAL else []
    if refused:
        raise InputError("\n".join(refused))
    keys = validate(SpatialSceneKeys, with_times_of_actuation(data), path, functions, space)
    found = [f"{path}: {problem}" for problem in _problems(keys)]
    if found:
        raise InputError("\n".join(found))
    for link in (body.link for body in keys.body):
        if isinstance(link, LinkTable):
            read_link(link)
    _check_functions(keys, path)
    return SpatialScene.model_construct(**dict(in_3d(keys)), path=path.absolute(), text=text)  # the keys are validated


def _unavailable_keys(data: dict[str, object]) -> Iterator[str]:
    """Keys that only planar scenes have so far, before they are called unknown."""
    for table, keys in UNAVAILABLE.items():
        found = data.get(table, [])
        for entry in found if isinstance(found, list) else [found]:
            for key, instead in keys.items():
                if isinstance(entry, dict) and key in entry:
                    yield f'{table}: {key}: expected no such key in space = "spatial", found it: {instead}'


def _problems(scene: SpatialSceneKeys) -> Iterator[str]:
    """Everything in the scene that refers to something that does not exist or does not fit, a line each."""
    for kind in ("body", "joint", "trajectory", "analysis"):
        for name, count in Counter(record.name for record in getattr(scene, kind)).items():
            if count > 1:
                yield f'{kind} "{name}": expected one {kind} of this name, found {count}'
    for label, count in Counter(layout.label for layout in scene.pzt).items():
        if count > 1:
            yield f'pzt "{label}": name: expected a separate name for each layout on a body, found {count} of this'
    for name, count in Counter(points.body for points in scene.actuation_points).items():
        if count > 1:
            yield f'actuation_points "{name}": body: expected one table for each body, found {count}'
    yield from _reference_problems(scene)
    counts = {layout.label: layout.patch_count for layout in scene.pzt}
    for k, load in enumerate(scene.load, 1):
        count, found = counts.get(load.pzt or "", 0), len(load.voltage or ())
        if count and found != count:
            of = f'one for each patch of "{load.pzt}"'
            yield f"load no. {k}: voltage: expected {count} expressions, {of}, found {found}"
        loaded = next((joint for joint in scene.joint if joint.name == load.joint), None)
        if loaded is not None and not loaded.units:
            yield (
                f'load no. {k}: joint: expected one with coordinates, found "{loaded.name}", a {loaded.type} joint:'
                " forces and moments on what it joins are loads on points (x, y, z, mx, my, mz)"
            )
        elif loaded is not None and len(load.moments) != len(loaded.units):
            of = f'one for each coordinate of "{loaded.name}" ({", ".join(loaded.units)})'
            yield f"load no. {k}: moment: expected {len(loaded.units)} expressions, {of}, found {len(load.moments)}"
    for k, analysis in enumerate(scene.analysis):
        for problem in analysis.problems(Surroundings(scene.analysis[:k], scene.analysis[k:], KINDS)):
            yield f'analysis "{analysis.name}": {problem}'
        for need in analysis.needs():
            if not getattr(scene, need.table, ()):
                label = f'analysis "{analysis.name}": {need.key}'
                yield f'{label}: expected at least one [[{need.table}]] for "{need.value}", found none'


def _reference_problems(scene: SpatialSceneKeys) -> Iterator[str]:
    bodies, joints = [body.name for body in scene.body], {joint.name: joint for joint in scene.joint}
    rigid = [body.name for body in scene.body if body.rigid is not None]
    layouts = [layout.label for layout in scene.pzt]
    if GROUND in bodies:
        yield f'body "{GROUND}": name: expected any other name, found "{GROUND}", which is the fixed frame'
    for reference in scene.references():
        name = reference.name
        if reference.kind == "joint":
            if name not in joints:
                yield f'{reference.key}: expected one of the joints {quoted(joints)}, found "{name}"' + did_you_mean(
                    name, joints
                )
            elif not (joints[name].units or joints[name].guess_units):
                yield f'{reference.key}: expected a joint that moves, found "{name}", a {joints[name].type}'
        elif reference.kind == "elastic joint":
            elastic = [each for each, joint in joints.items() if getattr(joint, "stiffness", None) is not None]
            if name not in elastic:
                yield f'{reference.key}: expected a joint with stiffness ({quoted(elastic)}), found "{name}"'
        elif reference.kind == "patched body":
            patched = [layout.body for layout in scene.pzt]
            if name not in patched:
                known = quoted(dict.fromkeys(patched)) or "none"
                hint = did_you_mean(name, patched)
                yield f'{reference.key}: expected a body with patches, {known}, found "{name}"{hint}'
        elif reference.kind == "patches":
            if name not in layouts:
                known = f"one of the layouts {quoted(layouts)}" if layouts else "a layout of patches ([[pzt]])"
                yield f'{reference.key}: expected {known}, found "{name}"' + did_you_mean(name, layouts)
        elif (body := name.partition(".")[0]) not in bodies:
            yield f'{reference.key}: expected one of the bodies {quoted(bodies)}, found "{body}"' + did_you_mean(
                body, bodies
            )
        elif reference.kind == "flexible body" and name in rigid:
            yield f'{reference.key}: expected a flexible body, found "{name}", which is rigid'


def _not_available(scene: SpatialSceneKeys) -> Iterator[str]:
    """The list of what the records can say and the program cannot do yet."""
    for joint in scene.joint:
        if not joint.units and getattr(joint, "motor", False):
            yield (
                f"{joint.label}: motor: expected false of a {joint.type} joint, which has no coordinates for motors,"
                " found true: revolute and prismatic joints in series have them"
            )
    for layout in scene.pzt:
        if layout.adds_mass and scene.geometric_stiffening:
            yield (
                'geometric_stiffening: expected no patches with structural = ["mass"], whose inertia loads the link'
                f' between its interfaces, found those of "{layout.label}"'
            )


def _check_functions(scene: SpatialSceneKeys, path: Path) -> None:
    """Raise `InputError` for a function of time without a value at an output time at which it is needed."""
    for analysis in scene.analysis:
        times = np.clip(analysis.times, 0.0, analysis.last_time)
        for trajectory in scene.trajectory if analysis.follows_trajectories else ():
            _check_path(trajectory, times, f'{path}: trajectory "{trajectory.name}"')
        for k, load in enumerate(scene.load, 1):
            for component, function in load.components.items():
                check_domain(function, times, f"{path}: load no. {k}: {component}", 0)
        for key, function, derivatives in analysis.prescribed():
            check_domain(function, times, f'{path}: analysis "{analysis.name}": {key}', derivatives)


def _check_path(trajectory: SpatialTrajectory, times: Array, label: str) -> None:
    """Of one trajectory at `times` (T,), with its derivatives."""
    places = None if trajectory.path is None else "via" if trajectory.waypoints is None else "waypoints"
    functions = [(f"{label}: {places or name}", function) for name, function in trajectory.components.items()]
    law = trajectory.orientation
    functions += [] if law is None else [(f"{label}: {law.kind}", function) for function in law.functions]
    for key, function in functions:
        check_domain(function, times, key, 2)
        if len(times) > 1:
            check_derivatives(function, float(times[-1]), key)
    if law is not None and law.kind == "direction":
        sizes = np.linalg.norm([function.sample(times)[0] for function in law.functions], axis=0)
        if sizes.min() <= 1e-9 * sizes.max():
            raise InputError(
                f"{label}: direction: expected a direction at all times, found none at t ="
                f" {times[sizes.argmin()]:.9g} s"
            )
