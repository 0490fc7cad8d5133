"""What is allowed in a scene but looks like another unit or a slip; a remark each, for nothing here is certain."""

import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from ..common.errors import InputError
from ..fe_models.remarks import LONGEST, is_beam, remarks_on_length, remarks_on_link
from ..mbs.scene.bodies import ROUND_OFF, RigidBody, tensor

if TYPE_CHECKING:  # scenes of rigid bodies do without the records of links
    from ..actuation.patches.records import PztLayout
    from ..fe_models.link_records.link import BeamLink, Link
    from .scene import Scene

TURNS = 4 * np.pi  # rad: joints of robots that come to rest do so within two turns
SPINNING = 0.1  # rate at the end over the largest: what still turns then is a wheel
HEAVIEST_BODY = 1e5  # kg
CARRIED = 100.0  # times its own mass: no robot carries more
WIDEST = 3.0  # radius of gyration over the length of all bodies: kg·cm² in place of kg·m² is a factor of 100
HEAVIEST_ROTOR = 10.0  # kg·m²: motors of 100 kW have less
HEAVIEST_FALL = 100.0  # m/s²: Jupiter has 25
SOFTEST_PATCH, LARGEST_D31 = 1e7, 1e-7  # Pa, m/V: polymers have 2e9, single crystals 1e-9
RESTING = 3.0  # how many times longer than its path a run may take
SAMPLES = 201
OUTPUT = 5e3  # bytes for each body and output, while results are evaluated: a link of four modes in space takes 5.5e3


def remarks(scene: "Scene") -> Iterator[str]:
    """Yield remarks on a valid scene, one line each: on units, angles, times of paths."""
    links: dict[str, Link] = {}
    for body in scene.body:
        if body.link is not None:
            from ..fe_models.link_file import read_link

            with suppress(InputError):  # which stage 1 tells
                links[body.name] = read_link(body.link)
                yield from remarks_on_link(links[body.name], f'link "{body.name}"')
        elif body.modal is not None:
            from ..fe_models.link import is_outdated

            if is_outdated(body.modal):
                link, made = body.modal.with_suffix(".toml").name, body.modal.name
                yield f"{made} is older than {link}, or than the program: ffrobot link {link} makes it again"
        elif body.rigid is not None:
            yield from remarks_on_length(_size(body.rigid), f'body "{body.name}"')
    if (fall := float(np.linalg.norm(scene.gravity))) > HEAVIEST_FALL:
        yield f"gravity of {fall:g} m/s²: units are SI; is it in mm/s²?"
    yield from _joints(scene)
    for tool in scene.tool:
        label = f'tool "{tool.name}"'
        yield from remarks_on_length(float(np.linalg.norm(tool.at)), label)
        if (angle := max(map(abs, (*tool.rpy, tool.angle)))) > TURNS / 2:
            yield f"{label} is turned by {angle:g} rad: angles are in rad; is it in degrees (45*deg)?"
    yield from _masses(scene, links)
    yield from _inertias(scene, links)
    yield from _patches(scene, links)
    yield from _voltages(scene)
    yield from _angles(scene)
    found = (one.fastest or ((of := one.shaper) and of.kind != "none" and not of.frequency) for one in scene.trajectory)
    if not any(found):  # by the run
        yield from remarks_on_times(scene)
    for analysis in scene.analysis:
        if analysis.kind == "tracking":  # known before the search, which takes minutes
            from ..mbs.tracking.advice import rough_ends

            functions = [function for one in scene.trajectory for _, function in one.targets]
            yield from (f'analysis "{analysis.name}": {text}' for text in rough_ends(functions, analysis.last_time))
        if step := getattr(analysis, "output_step", None):
            outputs = round(analysis.last_time / step) + 1
            yield from remarks_on_memory(outputs, len(scene.body), memory(), f'analysis "{analysis.name}"')


def _masses(scene: "Scene", links: "Mapping[str, Link]") -> Iterator[str]:
    robot = 0.0
    for body in scene.body:
        if body.rigid is not None:
            robot += body.rigid.mass
            if body.rigid.mass > HEAVIEST_BODY:
                yield f'body "{body.name}" has a mass of {body.rigid.mass:g} kg: units are SI; is it in g?'
        elif is_beam(link := links.get(body.name)):
            robot += link.material.density * link.sections[0].area * link.geometry.length
        else:
            return  # known after stage 1 alone
    for payload in scene.payload:
        if payload.mass > CARRIED * robot:
            yield (
                f'payload at "{payload.point}": {payload.mass:g} kg on a robot of {robot:.3g} kg: units are SI; is it'
                " in g?"
            )


def _size(rigid: RigidBody) -> float:
    """How far a point of a rigid body is from its origin, m."""
    return max(float(np.linalg.norm(place)) for place in (rigid.center, *rigid.points.values()))


def _inertias(scene: "Scene", links: "Mapping[str, Link]") -> Iterator[str]:
    """Radii of gyration beyond the robot, and moments of inertia of an interface that no body has."""
    lengths = [links[body.name].geometry.length for body in scene.body if body.name in links]
    lengths += [_size(body.rigid) for body in scene.body if body.rigid is not None]
    of_bodies = [(f'body "{one.name}"', one.rigid.mass, one.rigid.inertia) for one in scene.body if one.rigid]
    of_payloads = [(f'payload at "{one.point}"', one.mass, one.inertia) for one in scene.payload if one.mass]
    for label, mass, inertia in (*of_bodies, *of_payloads):
        radius = float(np.sqrt(np.linalg.eigvalsh(tensor(inertia)).max() / mass))
        if radius > WIDEST * sum(lengths) > 0.0:
            yield f"{label}: its radius of gyration is {radius:.3g} m: units are SI; is its inertia in kg cm² or g mm²?"
    for body, link in links.items() if scene.space == "spatial" else ():
        for record in link.interface:
            if max(record.inertia) > (1.0 + ROUND_OFF) * sum(record.inertia) / 2:
                moments = ", ".join(f"{moment:g}" for moment in record.inertia)
                yield (
                    f'link "{body}": interface "{record.name}": no body has the moments of inertia {moments} kg m²: one'
                    " is larger than the sum of the others"
                )


def _joints(scene: "Scene") -> Iterator[str]:
    for joint in scene.joint:
        label = f'joint "{joint.name}"'
        if (away := float(np.linalg.norm(joint.at))) > LONGEST:
            yield f"{label} is {away:g} m from the origin: units are SI; is this in mm?"
        if (rotor := getattr(joint, "rotor_inertia", 0.0)) > HEAVIEST_ROTOR:
            yield f"{label}: a rotor_inertia of {rotor:g} kg m²: units are SI; is it in kg cm² or g cm²?"
        if joint.type != "revolute":
            continue
        for low, high in joint.position_limits:
            if TURNS < max(abs(low), abs(high)) < np.inf:
                yield f"{label}: a position_limit of {low:g} … {high:g} rad is many turns: is it in degrees (180*deg)?"
        first = float(np.abs(scene.initial.joints.get(joint.name, 0.0)).max())
        if scene.space == "spatial" and first > TURNS:
            yield f"{label} begins at {first:g} rad: angles are in rad; is it in degrees (45*deg)?"
    for payload in scene.payload:
        yield from remarks_on_length(float(np.linalg.norm(payload.center)), f'payload at "{payload.point}": center')


def _patches(scene: "Scene", links: "Mapping[str, Link]") -> Iterator[str]:
    for layout in scene.pzt:
        label = f'pzt "{layout.label}"'
        if layout.modulus < SOFTEST_PATCH:
            yield f"{label}: a modulus of {layout.modulus:g} Pa: units are SI; is it in GPa?"
        if abs(layout.d31) > LARGEST_D31:
            yield f"{label}: a d31 of {layout.d31:g} m/V: units are SI; is it in pm/V?"
        if not is_beam(link := links.get(layout.body)):
            continue
        thick, _ = _thickness_and_face(layout, link)
        if (layers := layout.layers * layout.thickness) > thick:
            yield f"{label}: patches {layers:g} m thick on a link of {thick:g} m: units are SI; is this in mm?"

    for first, second in combinations(scene.pzt, 2):
        from ..actuation.patches.patches import patch_edges

        if first.body != second.body or first.normal != second.normal or not is_beam(link := links.get(first.body)):
            continue
        is_one_face = len({first.face, second.face} - {None, "both"}) < 2
        edges, others = (patch_edges(one, link.geometry.length) for one in (first, second))
        begins = np.maximum(edges[:, None, 0], others[None, :, 0])
        ends = np.minimum(edges[:, None, 1], others[None, :, 1]) - ROUND_OFF
        k = np.unravel_index(int(np.argmax(ends - begins)), ends.shape)  # the longest part that they share, if any
        begin, end = begins[k], ends[k]
        if is_one_face and end > begin and first.width + second.width > _thickness_and_face(first, link)[1]:
            yield (
                f'pzt "{first.label}", "{second.label}": patches on one place of "{first.body}", {begin:g} to'
                f" {end:g} m, each computed as if it lay on the link itself: for a stack take layers"
            )


def _thickness_and_face(layout: "PztLayout", link: "BeamLink") -> tuple[float, float]:
    """Of a link across the patches, and the width of the face that they lie on, m."""
    extents = max(one.height for one in link.sections), max(one.width for one in link.sections)
    thick, wide = extents if layout.normal == "y" else extents[::-1]
    return thick, np.pi * wide if link.shapes[0].shape != "rectangle" else wide


def _voltages(scene: "Scene") -> Iterator[str]:
    layouts = {layout.label: layout for layout in scene.pzt}
    last = max((analysis.last_time for analysis in scene.analysis), default=0.0)
    for label, one in layouts.items() if last else ():
        if (delay := one.amplifiers().delay.max()) >= last:
            yield f'pzt "{label}": a delay of {delay:g} s, the run ends at {last:g} s: is it in ms?'
    for k, load in enumerate(scene.load, 1):
        layout = layouts.get(load.pzt or "")
        if layout is None:
            continue
        limits = layout.amplifiers().range.T
        functions = [function for name, function in load.components.items() if name.startswith("voltage")]
        for number, (function, (lowest, highest)) in enumerate(zip(functions, limits, strict=False), 1):
            voltage = np.nan_to_num(function.sample(np.linspace(0.0, last, SAMPLES))[0])
            most, limit = max((voltage.max(), highest), (-voltage.min(), -lowest), key=lambda one: one[0] / one[1])
            if most > limit * (1.0 + ROUND_OFF):
                yield f"load no. {k}: patch {number} gets {most:.4g} V, beyond its limit of {limit:g} V"


def remarks_on_memory(outputs: int, bodies: int, available: float, label: str) -> Iterator[str]:
    """Yield a remark if that many outputs may take more than half of the `available` bytes."""
    if (needed := outputs * bodies * OUTPUT) > available / 2:
        yield (
            f"{label}: {outputs} outputs may take {needed / 1e9:.2g} GB of memory, of {available / 1e9:.2g} GB in"
            " total: a larger output_step needs less and does not change the steps of the integrator"
        )


def memory() -> float:
    """Memory of this machine in bytes; infinite where unknown."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):
        return np.inf


def _angles(scene: "Scene") -> Iterator[str]:
    turning = {joint.name for joint in scene.joint if joint.type == "revolute"}
    sliding = {joint.name for joint in scene.joint if joint.type == "prismatic"}
    last = max((analysis.last_time for analysis in scene.analysis if analysis.follows_trajectories), default=0.0)
    for one in scene.trajectory:
        if one.largest_turn_of_poses > np.pi:
            yield (
                f'trajectory "{one.name}": an angle in via changes by {np.degrees(one.largest_turn_of_poses):.4g}° from'
                " one pose to the next: the section turns the shorter way, half a turn at most; add poses between"
            )
        slides, turned = one.joint in sliding, {one.joint, getattr(one, "motor", None)} & turning
        if not slides and not turned and getattr(one, "angle", None) is None:
            continue
        for function in one.components.values():
            value, rate, _ = np.abs(function.sample(np.linspace(0.0, last, SAMPLES)))
            spins = rate[-1] > SPINNING * rate.max() > 0
            if slides:
                yield from remarks_on_length(float(np.nan_to_num(value).max()), f'the way of trajectory "{one.name}"')
            elif np.isfinite(value).all() and value.max() > TURNS and not spins:
                yield (
                    f'trajectory "{one.name}" reaches {value.max():.4g} rad, {value.max() / (2 * np.pi):.3g} turns:'
                    " angles are in rad; is it in degrees (45*deg)?"
                )


def remarks_on_times(scene: "Scene") -> Iterator[str]:
    """Yield remarks on trajectories that begin or end at other times than the runs."""
    for analysis in scene.analysis:
        if not analysis.follows_trajectories or not analysis.last_time:
            continue
        for one in scene.trajectory:
            if (path := one.path) is None:
                continue
            label, last = f'analysis "{analysis.name}": trajectory "{one.name}"', analysis.last_time
            round_off = 1e-9 * max(abs(path.begin), abs(path.end), last)
            if path.begin >= last:
                yield f"{label} begins at {path.begin:g} s, when the run is over ({last:g} s): none of it is followed"
            elif path.end > last + round_off:
                yield f"{label} ends at {path.end:g} s, the run at {last:g} s: the rest of it is not followed"
            elif path.end <= 0.0:
                yield f"{label} is over at {path.end:g} s, before the run begins: it rests where it ends"
            elif path.begin < -round_off:
                yield f"{label} begins at {path.begin:g} s, before the run: what is before 0 s is not followed"
            elif last > RESTING * path.end:
                yield f"{label} ends at {path.end:g} s, and rests for the other {last - path.end:g} s of the run"
