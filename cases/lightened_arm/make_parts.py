"""Draw the two links of the lightened arm with gmsh's OpenCASCADE kernel and write them as STEP files, in millimetres.

    .venv/bin/python cases/lightened_arm/make_parts.py

Each link is a tapered plate with round lightening holes. Its axis is x, the plane of motion xy, its thickness along z;
the joints sit on the plane faces at its ends.
"""

from dataclasses import dataclass
from pathlib import Path

import gmsh

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Part:
    """Measures of a link in millimetres."""

    name: str
    length: float
    root_height: float
    tip_height: float
    width: float
    holes: int

    def height(self, x: float) -> float:
        """Of the tapered plate at x."""
        return self.root_height + (self.tip_height - self.root_height) * x / self.length


PARTS = (
    Part("upper_arm", length=500.0, root_height=60.0, tip_height=44.0, width=12.0, holes=7),
    Part("forearm", length=400.0, root_height=44.0, tip_height=30.0, width=8.0, holes=6),
)


def draw(part: Part) -> int:
    """The solid of a part; returns its volume's tag."""
    occ = gmsh.model.occ
    half_root, half_tip = part.root_height / 2, part.tip_height / 2
    corners = [
        occ.addPoint(x, y, -part.width / 2)
        for x, y in ((0, -half_root), (part.length, -half_tip), (part.length, half_tip), (0, half_root))
    ]
    lines = [occ.addLine(corners[k], corners[(k + 1) % 4]) for k in range(4)]
    face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    (_, plate), *_ = [entity for entity in occ.extrude([(2, face)], 0, 0, part.width) if entity[0] == 3]
    spacing = part.length / (part.holes + 1)
    holes = [
        (3, occ.addCylinder(x, 0, -part.width, 0, 0, 2 * part.width, 0.3 * part.height(x)))
        for x in (spacing * (k + 1) for k in range(part.holes))
    ]
    (link,), _ = occ.cut([(3, plate)], holes)
    occ.synchronize()
    return int(link[1])


def main() -> None:
    """Write NAME.step for each part beside this script."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
    for part in PARTS:
        gmsh.model.add(part.name)
        draw(part)
        gmsh.write(str(HERE / f"{part.name}.step"))
        gmsh.model.remove()
    gmsh.finalize()


if __name__ == "__main__":
    main()
