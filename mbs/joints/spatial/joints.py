"""The types of joints that a scene may have."""

from __future__ import annotations

from typing import Annotated, get_args

from pydantic import Field

from ...fields.spelling import TaggedInPlane
from .cylindrical import SpatialCylindrical
from .free import SpatialFree
from .joint import SpatialJoint
from .planar_joint import SpatialPlanar
from .prismatic import SpatialPrismatic
from .revolute import SpatialRevolute
from .screw import SpatialScrew
from .spherical import SpatialSpherical
from .universal import SpatialUniversal
from .weld import SpatialWeld

AnySpatialJoint = Annotated[
    SpatialRevolute
    | SpatialPrismatic
    | SpatialScrew
    | SpatialCylindrical
    | SpatialUniversal
    | SpatialSpherical
    | SpatialPlanar
    | SpatialWeld
    | SpatialFree,
    Field(discriminator="type"),
    TaggedInPlane(),
]
"""The list of all types, told apart by the key `type`: a new one is a file beside this one and an entry here."""

SPATIAL_JOINT_TYPES: dict[str, type[SpatialJoint]] = {
    record.type_name(): record for record in get_args(get_args(AnySpatialJoint)[0])
}
"""The records by what the key `type` says."""
