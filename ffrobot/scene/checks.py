"""What is wrong with a scene that no single table can tell: what it refers to does not exist or does not fit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from ..common.arrays import Array
from ..common.validation import did_you_mean, quoted
from ..mbs._core import TimeFunction
from ..mbs.fields.derivatives import check_derivatives
from ..mbs.fields.field_types import GROUND
from ..mbs.fields.functions import check_domain
from ..mbs.scene.analysis import Surroundings
from .kinds import KINDS, AnyKind
from .scene import SceneKeys

PATCHED = ("patches", "patched body")  # in the plane a body has one layout, which has its name


def problems(scene: SceneKeys) -> Iterator[str]:
    """Everything in the scene that refers to something that does not exist or does not fit, a line each."""
    for kind in ("body", "joint", "trajectory", "analysis"):
        yield from _duplicates(kind, (record.name for record in getattr(scene, kind)))
    for kind in ("pzt", "actuation_points"):
        yield from _duplicates(kind, (layout.body for layout in getattr(scene, kind)))
    yield from _body_problems(scene)
    yield from _joint_problems(scene)
    yield from _guess_problems(scene)
    yield from _flexible_body_problems(scene)
    yield from _patch_problems(scene)
    yield from _stiffening_problems(scene)
    for k, analysis in enumerate(scene.analysis):
        among = Surroundings(scene.analysis[:k], scene.analysis[k:], KINDS)
        for problem in (*_unmet_needs(scene, analysis), *analysis.problems(among)):
            yield f'analysis "{analysis.name}": {problem}'


def check_functions(scene: SceneKeys, path: Path) -> None:
    """Raise `InputError` for a function of time without a value at an output time at which it is needed."""
    following = [analysis for analysis in scene.analysis if analysis.follows_trajectories]
    for trajectory in scene.trajectory:
        for component, function in trajectory.components.items():
            key = component if trajectory.path is None else "via" if trajectory.waypoints is None else "waypoints"
            for analysis in following:
                times = np.clip(analysis.times, 0.0, analysis.last_time)
                _check_path(function, times, f'{path}: trajectory "{trajectory.name}": {key}')
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


def _check_path(function: TimeFunction, times: Array, label: str) -> None:
    """Raise `InputError` for a function of time that no motion can follow, or whose derivatives are others."""
    check_domain(function, times, label, 2)
    if len(times) > 1:
        check_derivatives(function, float(times[-1]), label)


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
    elastic = [name for name, joint in joints.items() if joint.elastic_gear("section")]
    moving = [name for name, joint in joints.items() if joint.coordinate("section") is not None]
    for reference in scene.references():
        key, name = reference.key, reference.name
        if reference.kind == "elastic joint" and name not in elastic:
            yield f'{key}: expected a joint with stiffness ({quoted(elastic)}), found "{name}"'
        elif reference.kind == "joint" and name not in joints:
            yield f'{key}: expected one of the joints {quoted(joints)}, found "{name}"{did_you_mean(name, joints)}'
        elif reference.kind == "joint" and name not in moving:
            found = f'"{name}", a {joints[name].type}'
            yield f"{key}: expected a joint that moves ({quoted(moving)}), found {found}"


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


def _flexible_body_problems(scene: SceneKeys) -> Iterator[str]:
    rigid = [body.name for body in scene.body if body.rigid is not None]
    for reference in scene.references():
        if reference.kind == "flexible body" and reference.name in rigid:
            yield f'{reference.key}: expected a flexible body, found "{reference.name}", which is rigid'


def _patch_problems(scene: SceneKeys) -> Iterator[str]:
    layouts = {layout.body: layout for layout in scene.pzt}
    uses = [(reference.key, reference.name) for reference in scene.references() if reference.kind in PATCHED]
    uses += [(f"load no. {k}: pzt", load.pzt) for k, load in enumerate(scene.load, 1) if load.pzt is not None]
    for key, body in uses:
        if body not in layouts:
            hint = did_you_mean(body, layouts)
            yield f'{key}: expected a body with patches, {quoted(layouts)}, found "{body}"{hint}'
    for k, load in enumerate(scene.load, 1):
        count = layouts[load.pzt].patch_count if load.pzt in layouts else 0
        if count and load.voltage is not None and len(load.voltage) != count:
            yield (
                f"load no. {k}: voltage: expected {count} expressions, one for each patch of"
                f' "{load.pzt}", found {len(load.voltage)}'
            )


def _stiffening_problems(scene: SceneKeys) -> Iterator[str]:
    """What acts between the interfaces of a link: modal body files hold no geometric stiffness of such loads."""
    if scene.geometric_stiffening is False:
        return
    for points in scene.actuation_points:
        yield f'geometric_stiffening: expected false with [[actuation_points]], found those of "{points.body}"'
    for layout in scene.pzt:
        if layout.adds_mass:
            yield (
                'geometric_stiffening: expected no patches with structural = ["mass"], whose inertia loads the link'
                f' between its interfaces, found those of "{layout.body}"'
            )


def _unmet_needs(scene: SceneKeys, analysis: AnyKind) -> Iterator[str]:
    for need in analysis.needs():
        if not getattr(scene, need.table):
            yield f'{need.key}: expected at least one [[{need.table}]] for "{need.value}", found none'
    if analysis.needs_actuators and not scene.motor_joints and not scene.pzt:
        yield (
            f'kind: expected motors or [[pzt]] for "{analysis.kind}", found neither: nothing to control the robot with'
        )
