"""The types of joints that a scene may have."""

from __future__ import annotations

from typing import Annotated, get_args

from pydantic import Field

from .joint import JointRecord
from .prismatic import PrismaticJoint
from .revolute import RevoluteJoint
from .weld import WeldJoint

Joint = Annotated[RevoluteJoint | PrismaticJoint | WeldJoint, Field(discriminator="type")]
"""The list of all types, told apart by the key `type`: a new one is a file beside this one and an entry here."""

JOINT_TYPES: dict[str, type[JointRecord]] = {record.type_name(): record for record in get_args(get_args(Joint)[0])}
"""The records by what the key `type` says."""
