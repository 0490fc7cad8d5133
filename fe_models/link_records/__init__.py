"""The link file as records: what stage 1 reads, checked key by key."""

from .link import (
    DEFAULT_COUNT,
    FAMILIES,
    HOLDING_ROOT,
    BeamLink,
    Coupling,
    Family,
    InterfaceRecord,
    Link,
    Material,
    OrthotropicMaterial,
    SolidLink,
    Solver,
    SurfacePatches,
)
from .measured import Measured, MeasuredMode, paired, read_measured

__all__ = [
    "DEFAULT_COUNT",
    "FAMILIES",
    "HOLDING_ROOT",
    "BeamLink",
    "Coupling",
    "Family",
    "InterfaceRecord",
    "Link",
    "Material",
    "Measured",
    "MeasuredMode",
    "OrthotropicMaterial",
    "SolidLink",
    "Solver",
    "SurfacePatches",
    "paired",
    "read_measured",
]
