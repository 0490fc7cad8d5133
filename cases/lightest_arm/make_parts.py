"""Draw the tubes of the lightest arm with gmsh's OpenCASCADE kernel and write them as STEP files, in millimetres.

    .venv/bin/python cases/lightest_arm/make_parts.py

Diameters are those that `ffrobot optimise` finds (README.md), holes rounded down to 0.1 mm. Axes of tubes are along x.
"""

from dataclasses import dataclass
from pathlib import Path

import gmsh

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Tube:
    """Measures of a link in millimetres."""

    name: str
    length: float
    outer: float
    inner: float


TUBES = (Tube("upper_arm", 500.0, 40.0, 32.9), Tube("forearm", 400.0, 40.0, 37.2))


def draw(tube: Tube) -> None:
    """The solid of a tube."""
    occ, diameters = gmsh.model.occ, (tube.outer, tube.inner)
    outside, hole = ((3, occ.addCylinder(0, 0, 0, tube.length, 0, 0, diameter / 2)) for diameter in diameters)
    occ.cut([outside], [hole])
    occ.synchronize()


def main() -> None:
    """Write NAME.step for each tube beside this script."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
    for tube in TUBES:
        gmsh.model.add(tube.name)
        draw(tube)
        gmsh.write(str(HERE / f"{tube.name}.step"))
        gmsh.model.remove()
    gmsh.finalize()


if __name__ == "__main__":
    main()
