"""What `ffrobot link PART --inspect` prints."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from ..common.arrays import Array
from ..mesh.inspection import Inspection
from .lines import plain_table

LISTED = 30


def print_inspection(file: Path, part: Inspection, density: float | None, console: Console) -> None:
    """Unit, extent, volume, mass where the density is known, and a table of the faces, largest first."""
    said = "" if part.is_declared else ", a guess by its size: --unit sets it"
    size = " × ".join(f"{1000 * value:.6g}" for value in part.high - part.low)
    mass = "" if density is None else f"; mass {density * part.volume:.6g} kg with {density:g} kg/m³"
    lines = [
        f"{file}: drawn in {part.unit}{said}",
        f"extent {size} mm, from {_point(part.low)} to {_point(part.high)} mm",
        f"volume {1e6 * part.volume:.6g} cm³ of the mesh{mass}; center of volume {_point(part.center)} mm",
    ]
    if part.groups:
        lines.append(f"groups {', '.join(part.groups)}")
    for line in (*lines, *(f"remark     {remark}" for remark in part.remarks)):
        console.print(line, soft_wrap=True)
    rows = []
    for k, face in enumerate(part.faces[:LISTED], start=1):
        radius = "–" if face.radius is None else f"{1000 * face.radius:.5g}"
        direction = f"({', '.join(f'{value + 0.0:.4g}' for value in face.direction.round(4))})"
        rows.append((str(k), face.kind, _point(face.center), direction, radius, f"{1e6 * face.area:.5g}"))
    console.print(plain_table(("face", "kind", "center mm", "normal or axis", "radius mm", "area mm²"), rows))
    if (more := len(part.faces) - LISTED) > 0:
        console.print(f"and {more} smaller faces")


def _point(place: Array) -> str:
    return f"({', '.join(f'{value + 0.0:.5g}' for value in (1000 * place).round(6))})"
