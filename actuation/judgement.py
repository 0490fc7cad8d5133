"""What motors and patches of a robot have to do against what they can, and what nothing does."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..common.arrays import Array
from ..common.structs import struct
from ..fe_models.modal_body import ModalBody
from ..mbs.model.body import Body
from ..mbs.quantities.motion import RobotMotion
from ..mbs.scene.analysis import Analysis
from .feasibility import Feasibility, ModalMotion, PatchFeasibility, Unsupplied, judge_patches, seen_at_points
from .motors import judge_motors

if TYPE_CHECKING:  # robots without patches do without them
    from .patches.link_patches import LinkPatches
    from .patches.patches import Voltages
    from .patches.records import PztLayout

ROUNDING = 1e-6  # of the largest modal force: less is what ill-conditioned patches leave
NEGLIGIBLE = 1e-6  # of the length of a link, of a deflection; rad


@struct
class LinkInMotion:
    """A link with modes, over time."""

    modal: ModalBody  # its modal body
    spatial: Body  # its equations
    p: Array  # (T, n) coordinates of the modes of the modal body
    F_p: Array  # (T, n) modal forces on these that patches would have to supply


def links_in_motion(motion: RobotMotion, bodies: Mapping[str, tuple[ModalBody, Body]]) -> dict[str, LinkInMotion]:
    """The links of a motion by name; `bodies` are their modal bodies and equations."""
    forces, found = motion.motor_forces, {}
    assert forces is not None
    for name, (modal, spatial) in bodies.items():
        found[name] = LinkInMotion(modal, spatial, motion.modal(name), forces.modal[name])
    return found


def judge_actuators(
    path: Path,
    motion: RobotMotion,
    links: Mapping[str, LinkInMotion],
    patches: Mapping[str, LinkPatches],
    voltages: Mapping[str, Voltages],
    analysis: Analysis,
    others: Container[str],
) -> Feasibility:
    """Required against available of motors by joint ("JOINT 2" of a second coordinate) and of patches by layout.

    `others`: links on which something else than patches supplies modal forces.
    """
    judged: dict[str, PatchFeasibility] = {}
    for body, of_link in patches.items():
        link = links[body]
        for name, array in of_link.arrays.items():
            modes = of_link.modes[name]
            trial = None if analysis.is_repeated else partial(_largest_voltage, path, motion, link, array.layout)
            modal = ModalMotion(motion.time, modes.coordinates(link.p), modes.forces(link.F_p))
            judged[name] = judge_patches(array, voltages[name], modal, trial)
    missing = find_unsupplied(motion, links, patches, voltages, others)
    return Feasibility(judge_motors(motion, analysis), judged, missing)


def _largest_voltage(
    path: Path, motion: RobotMotion, link: LinkInMotion, layout: PztLayout, count: int
) -> float | None:
    """V, that so many patches of a layout would need alone, evenly spread; None where they have no room."""
    from .patches.link_patches import on_kept_modes, with_count
    from .patches.patches import voltage_gain

    found = with_count(path, layout, link.modal, link.spatial, count)
    if found is None:
        return None
    if link.spatial.name in motion.model.tree.index:  # else in pieces, with all modes
        found = on_kept_modes(found, motion.node(link.spatial.name).body)
    return float(np.abs(found.reached.forces(link.F_p) @ voltage_gain(found.reach).T).max())


def find_unmet(
    links: Mapping[str, LinkInMotion],
    patches: Mapping[str, LinkPatches],
    voltages: Mapping[str, Voltages],
    *,
    limited: bool,
) -> dict[str, Array]:
    """By link: F_p less what its patches do (T, n) at the voltages that are required, or at those within limits."""
    found = {}
    for name, link in links.items():
        found[name] = link.F_p
        if (of_link := patches.get(name)) is not None:
            of = [voltages[layout] for layout in of_link.arrays]
            applied = np.concatenate([one.within_limit if limited else one.required for one in of], axis=1)
            found[name] = of_link.unmet(link.F_p, applied)
    return found


def find_unsupplied(
    motion: RobotMotion,
    links: Mapping[str, LinkInMotion],
    patches: Mapping[str, LinkPatches],
    voltages: Mapping[str, Voltages],
    others: Container[str],
) -> Unsupplied | None:
    """What no voltages supply, but of links with `others` for that; None where that bends no link."""
    largest = max((float(np.abs(link.F_p).max(initial=0.0)) for link in links.values()), default=0.0)
    found: list[tuple[float, float, str, str]] = []
    for name, left in find_unmet(links, patches, voltages, limited=False).items():
        modal, counts = links[name].modal, np.abs(left).max(axis=0) > ROUNDING * largest
        deflection, rotation = _largest_shift(links[name], left)
        if name not in others and counts.any() and max(deflection / modal.length, rotation) > NEGLIGIBLE:
            of_modes = dict.fromkeys(family for family, one in zip(modal.family, counts, strict=True) if one)
            found.append((deflection, rotation, name, ", ".join(of_modes)))
    if not found:
        return None
    found.sort(reverse=True)
    deflections, rotations, bodies, families = zip(*found, strict=True)
    about = Unsupplied(bodies, bool(patches))
    if not motion.space.is_plane:
        about = replace(about, families=families, deflection=deflections, rotation=rotations)
    if not (motion.motors_fit and links.keys() <= motion.model.tree.index.keys()):
        return about  # motors do not say where points are, or links are in pieces
    followed = [path.point for path in motion.model.scene.trajectory if path.point is not None]
    points = followed or [f"{body}.{label}" for body, labels in motion.points.items() for label in labels]
    return seen_at_points(about, motion, find_unmet(links, patches, voltages, limited=True), points)


def _largest_shift(link: LinkInMotion, left: Array) -> tuple[float, float]:
    """Of the points of a link over time, by modal forces (T, n): m, rad."""
    body = link.spatial.whole
    p = left @ body.modal_transform / body.stiffness
    shifts = [(p @ at.translation.T, p @ at.rotation.T) for at in body.points.values()]
    deflection, rotation = (max(float(np.linalg.norm(shift[k], axis=1).max()) for shift in shifts) for k in range(2))
    return deflection, rotation
