"""What motors and patches of a robot in space have to do against what they can, and what nothing does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from ..common.arrays import Array
from ..fe_models.modal_body import ModalBody
from ..mbs.model.spatial_body import SpatialBody
from ..mbs.quantities.spatial_motion import SpatialMotion
from .feasibility import Feasibility, ModalMotion, PatchFeasibility, judge_patches
from .motors import MotorFeasibility, judge_motion
from .patches.spatial_patches import LinkPatches, with_count
from .patches.spatial_records import SpatialPztLayout
from .patches.voltages import Voltages

ROUNDING = 1e-6  # of the largest modal force: less is what ill-conditioned patches leave
NEGLIGIBLE = 1e-6  # of the length of a link, of a deflection; rad


@dataclass(frozen=True)
class LinkInMotion:
    """A link with modes, over time.

    Attributes:
        modal: its modal body.
        spatial: its equations.
        p: (T, n) coordinates of the modes of the modal body.
        F_p: (T, n) modal forces on these that patches would have to supply.
    """

    modal: ModalBody
    spatial: SpatialBody
    p: Array
    F_p: Array


@dataclass(frozen=True)
class UnsuppliedInSpace:
    """Modal forces that no patch supplies, whatever its limit: of links, families and the deflection that they leave.

    Attributes:
        bodies: links, the worst first.
        families: of each, those of the modes concerned, in words.
        with_patches: whether any link has patches.
        deflection: m, of each, the largest of a point by Φ K⁻¹ r, quasi-static, the link held as its modes are.
        rotation: rad, likewise, of a section.
    """

    bodies: tuple[str, ...]
    families: tuple[str, ...]
    with_patches: bool
    deflection: tuple[float, ...]
    rotation: tuple[float, ...]

    @property
    def in_words(self) -> str:
        """What it means, and what to do."""
        links = [
            f"{body} ({families}), off by {1e3 * deflection:.2g} mm and {np.degrees(turn):.2g}°"
            for body, families, deflection, turn in zip(
                self.bodies, self.families, self.deflection, self.rotation, strict=True
            )
        ]
        return (
            f"no actuator provides all modal forces required on {'; '.join(links)}, quasi-static, with"
            f" {_whoever(self.with_patches)}. Patches ([[pzt]]) bend links in two planes, fibers at an angle twist them"
        )


def _whoever(with_patches: bool) -> str:
    return "motors and patches within their limits" if with_patches else "motors only"


def links_in_motion(
    motion: SpatialMotion, bodies: Mapping[str, tuple[ModalBody, SpatialBody]]
) -> dict[str, LinkInMotion]:
    """The links of a motion by name; `bodies` are their modal bodies and equations."""
    forces, found = motion.motor_forces, {}
    assert forces is not None
    for name, (modal, spatial) in bodies.items():
        found[name] = LinkInMotion(modal, spatial, motion.body(name).modal, forces.modal[name])
    return found


def judge_in_space(
    path: Path,
    motion: SpatialMotion,
    links: Mapping[str, LinkInMotion],
    patches: Mapping[str, LinkPatches],
    voltages: Mapping[str, Voltages],
    end: float,
) -> tuple[Feasibility, UnsuppliedInSpace | None]:
    """Required against available of motors by joint ("JOINT 2" of a second coordinate) and of patches by layout."""
    judged: dict[str, PatchFeasibility] = {}
    for body, of_link in patches.items():
        link = links[body]
        for name, array in of_link.arrays.items():
            assert isinstance(array.layout, SpatialPztLayout)
            modes = of_link.modes[name]
            trial = partial(with_count, path, array.layout, link.modal, link.spatial)
            modal = ModalMotion(motion.time, modes.coordinates(link.p), modes.forces(link.F_p))
            judged[name] = judge_patches(array, voltages[name], modal, trial)
    return Feasibility(judge_motors_in_space(motion, end), judged), unsupplied_in_space(links, patches, voltages)


def judge_motors_in_space(motion: SpatialMotion, end: float) -> dict[str, MotorFeasibility]:
    """What the motors have to do up to the `end` (s) of the path; a number behind the joint tells coordinates apart."""
    forces, found = motion.motor_forces, {}
    assert forces is not None
    for joint in motion.model.scene.motor_joints:
        of_joint = motion.joint(joint.name)
        assert of_joint is not None
        motor = motion.motor_motion(joint.name)  # behind a gear that gives
        moments, rates = forces.moments[joint.name], of_joint[1] if motor is None else motor[1][:, None]
        for k, limits in enumerate(joint.motor_limits):
            name = joint.name if len(joint.units) == 1 else f"{joint.name} {k + 1}"
            found[name] = judge_motion(motion.time, moments[:, k], rates[:, k], limits, end)
    return found


def unmet_in_space(
    links: Mapping[str, LinkInMotion], patches: Mapping[str, LinkPatches], voltages: Mapping[str, Voltages]
) -> dict[str, Array]:
    """By link: F_p less what its patches do at the voltages that are required, without limits (T, n)."""
    found = {}
    for name, link in links.items():
        found[name] = link.F_p
        if (of_link := patches.get(name)) is not None:
            required = np.concatenate([voltages[layout].required for layout in of_link.arrays], axis=1)
            found[name] = of_link.unmet(link.F_p, required)
    return found


def unsupplied_in_space(
    links: Mapping[str, LinkInMotion], patches: Mapping[str, LinkPatches], voltages: Mapping[str, Voltages]
) -> UnsuppliedInSpace | None:
    """What no voltages supply; None where that bends no link."""
    largest = max((float(np.abs(link.F_p).max(initial=0.0)) for link in links.values()), default=0.0)
    found: list[tuple[float, float, str, str]] = []
    for name, left in unmet_in_space(links, patches, voltages).items():
        modal, counts = links[name].modal, np.abs(left).max(axis=0) > ROUNDING * largest
        deflection, rotation = _largest_shift(links[name], left)
        if max(deflection / modal.length, rotation) > NEGLIGIBLE and counts.any():
            of_modes = dict.fromkeys(family for family, one in zip(modal.family, counts, strict=True) if one)
            found.append((deflection, rotation, name, ", ".join(of_modes)))
    if not found:
        return None
    found.sort(reverse=True)
    deflections, rotations, bodies, families = zip(*found, strict=True)
    return UnsuppliedInSpace(bodies, families, bool(patches), deflections, rotations)


def _largest_shift(link: LinkInMotion, left: Array) -> tuple[float, float]:
    """Of the points of a link over time, by modal forces (T, n): m, rad."""
    body = link.spatial.whole
    p = left @ body.modal_transform / body.stiffness
    shifts = [(p @ at.translation.T, p @ at.rotation.T) for at in body.points.values()]
    deflection, rotation = (max(float(np.linalg.norm(shift[k], axis=1).max()) for shift in shifts) for k in range(2))
    return deflection, rotation
