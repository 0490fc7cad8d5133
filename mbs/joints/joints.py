"""The types of joints that a scene may have."""

from __future__ import annotations

from typing import Annotated, get_args

from ...common.deferred import Deferred
from ..fields.spelling import TaggedInPlane
from .cylindrical import CylindricalJoint
from .free import FreeJoint
from .joint import JointRecord
from .planar_joint import PlanarJoint
from .prismatic import PrismaticJoint
from .revolute import RevoluteJoint
from .screw import ScrewJoint
from .spherical import SphericalJoint
from .universal import UniversalJoint
from .weld import WeldJoint

AnyJoint = Annotated[
    RevoluteJoint
    | PrismaticJoint
    | ScrewJoint
    | CylindricalJoint
    | UniversalJoint
    | SphericalJoint
    | PlanarJoint
    | WeldJoint
    | FreeJoint,
    Deferred("type"),
    TaggedInPlane(),
]
"""All types, by the key `type`: a new one is a file beside this one and an entry here."""

JOINT_TYPES: dict[str, type[JointRecord]] = {record.type_name(): record for record in get_args(get_args(AnyJoint)[0])}
"""The records by what the key `type` says."""
