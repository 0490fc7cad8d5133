"""What link files and modal bodies call alike: families of modes, and the reference conditions that hold the root."""

from collections.abc import Mapping
from typing import Literal

Family = Literal["in-plane-bending", "out-of-plane-bending", "axial", "torsion"]

DEFAULT_COUNT: Mapping[Family, int] = {"in-plane-bending": 6, "out-of-plane-bending": 6, "axial": 1, "torsion": 1}
"""Eigenmodes of each family where a link file leaves their number out: attachment modes have the statics."""

FAMILIES: tuple[Family, ...] = tuple(DEFAULT_COUNT)

LOCAL = "local"
"""What a solid's mode is called in which its cross sections hardly move."""

HOLDING_ROOT = ("cantilever", "craig-bampton")
"""Reference conditions under which the root's section stays where it is in the frame."""
