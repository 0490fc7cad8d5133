"""Element order and size where a link file names none: in one place, since both are to be chosen from measurements."""

from __future__ import annotations

from .cells import CellName

# Elements along a full circle of a curved face, and along that of a solid bar: there, where a cell has two edges on the
# circle, it cannot follow it between them. With these a bar lacks 0.03 % of its volume, a part with holes 0.002 %.
CIRCLE = 12
BAR = 12
# How much larger an element may be at unit distance from a curved face.
GROWTH = 0.4

# Wanted edge length in hydraulic diameters, by order of the displacements.
_SIZE = {1: 0.25, 2: 0.6, 3: 1.5}


def default_order(cell: CellName) -> int:
    """Polynomial order of the displacements."""
    return 3 if cell == "tetrahedron" else 2


def default_size(volume: float, surface: float, order: int) -> float:
    """Edge length for a part of so much volume and surface.

    Measured by the hydraulic diameter 4 V/A, which is about the smaller side of a solid bar's section, and twice the
    thickness of a wall.

    Args:
        volume: in m³.
        surface: in m².
        order: of the displacements.
    """
    return _SIZE[order] * 4 * volume / surface
