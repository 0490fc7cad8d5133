"""Whether the numbers of a URDF can be metres and kilograms; a remark each, for nothing here is certain."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...common.tables import shown
from .robot import Robot

LONGEST = 20.0  # m from joint to joint: arms of excavators and cranes have less
SHORTEST = 1e-3  # m, the whole robot
# Radius of gyration over the robot's reach. Links of the robots of example-robot-data lie between 2e-3 and 0.6;
# kg·cm² in place of kg·m² is a factor of 100, kg·mm² of 1000.
WIDEST, NARROWEST = 3.0, 1e-4
TURNS = 4 * np.pi  # rad: limits of joints that turn are within; a full turn in degrees is 360
ROTATION = 2 * np.pi  # rad: angles of frames are within


def remarks_on_scale(robot: Robot) -> Iterator[str]:
    """What looks like another unit, one line each."""
    ways = {joint.name: float(np.linalg.norm(joint.origin.xyz)) for joint in robot.joints.values()}
    reach = sum(ways.values())
    if ways and max(ways.values()) > LONGEST:
        name = max(ways, key=lambda key: ways[key])
        yield (
            f'joint "{shown(name)}" is {ways[name]:g} m from that of its parent: URDF is in metres; is this file in'
            " millimetres?"
        )
    for joint in robot.joints.values():
        label, limits = f'joint "{shown(joint.name)}"', [joint.limits.get(key, 0.0) for key in ("lower", "upper")]
        if joint.type == "revolute" and max(map(abs, limits)) > TURNS:
            yield f"{label}: limits {limits[0]:g} … {limits[1]:g} rad are many turns: are they in degrees?"
        if max(map(abs, joint.origin.rpy)) > ROTATION:
            yield f"{label}: rpy {' '.join(f'{angle:g}' for angle in joint.origin.rpy)} rad: is it in degrees?"
    if 0 < reach < SHORTEST:
        yield f"all joints are within {reach:g} m: URDF is in metres; is this file in kilometres?"
    for link in robot.links.values():
        if (part := link.inertial) is None or part.mass == 0 or reach == 0:
            continue
        gyration = float(np.sqrt(np.abs(np.linalg.eigvalsh(part.inertia)).max() / part.mass))
        if not NARROWEST * reach <= gyration <= WIDEST * reach:
            yield (
                f'link "{shown(link.name)}": radius of gyration {gyration:.3g} m, in a robot whose joints span'
                f" {reach:.3g} m: URDF is in kg m²; is this inertia in another unit, or a placeholder?"
            )
