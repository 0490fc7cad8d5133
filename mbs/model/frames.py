"""Coordinates of revolute joints between frames of bodies, not sections, for `motors = "frame"`.

They are coordinates of a joint where modes turn its sections about its axis alone. Where they tilt the axis there are
none: a moment between frames has virtual work there, but no angle that goes with it.
"""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np

from ..joints.joint import JointRecord
from .tree import KinematicTree, Section

ALONG = 1e-12  # of the largest rotation of modes: what is left of them across an axis about which they all turn


def with_coordinates_of_frames(tree: KinematicTree) -> KinematicTree:
    """The tree with such coordinates of all joints that have them."""
    found, joints = copy.copy(tree), (*(node.joint for node in tree.nodes), *tree.loops)
    found.on_frames = frozenset(joint.name for joint in joints if _has_angle_of_frames(tree, joint))
    found.nodes = tuple(
        replace(node, inner=node.inner._replace(still=True), outer=node.outer._replace(still=True))
        if node.joint.name in found.on_frames
        else node
        for node in tree.nodes
    )
    return found


def _has_angle_of_frames(tree: KinematicTree, joint: JointRecord) -> bool:
    sides = zip(joint.between, joint.triads(), strict=True)
    return joint.type == "revolute" and all(_turns_about_z(tree, tree.section(side, triad)) for side, triad in sides)


def _turns_about_z(tree: KinematicTree, section: Section) -> bool:
    """Whether modes turn a section about z of its triad alone."""
    if section.body < 0 or not section.point:
        return True
    body = tree.nodes[section.body].body
    rotation = body.points[section.point].rotation
    if body.stiffening is not None:
        rotation = np.hstack([rotation, body.stiffening.at(section.point)[3:].reshape(3, -1)])
    across = section._replace(still=True).turned(rotation)
    return bool(np.abs(across).max(initial=0.0) <= ALONG * np.abs(rotation).max(initial=0.0))
