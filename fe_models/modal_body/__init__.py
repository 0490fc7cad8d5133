"""The modal body, and what beams and solids share in making one."""

from .body import ModalBody
from .parts import Interface, MeasuredValues, OutlinedPatches, PictureMesh, Stations, StressPoint

__all__ = ["Interface", "MeasuredValues", "ModalBody", "OutlinedPatches", "PictureMesh", "Stations", "StressPoint"]
