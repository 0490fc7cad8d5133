"""The link file as records: what stage 1 reads, checked key by key."""

from .attached import Coupling, InterfaceRecord, SurfacePatches
from .link import FAMILIES, BeamLink, Family, Link, Material, OrthotropicMaterial, SolidLink

__all__ = [
    "FAMILIES",
    "BeamLink",
    "Coupling",
    "Family",
    "InterfaceRecord",
    "Link",
    "Material",
    "OrthotropicMaterial",
    "SolidLink",
    "SurfacePatches",
]
