"""Draw the upper arm with gmsh's OpenCASCADE kernel and write it as a STEP file, in millimetres.

    .venv/bin/python cases/arm_6r/make_part.py

An open milled part: a tapered plate with round ends, a rim around it and two ribs across, on two bosses. It is drawn in
the axes of the link "upper_arm" of arm.urdf: shoulder and elbow turn about y, the faces of both bosses lie in the plane
y = 0, the elbow is 400 mm above the shoulder. The script prints what <inertial> has.
"""

from collections.abc import Sequence
from pathlib import Path

import gmsh
import numpy as np

HERE = Path(__file__).parent
DENSITY = 2700.0  # kg/m³
REACH = 400.0  # mm, from shoulder to elbow
ROUND = (62.0, 50.0)  # mm, outer radius at the shoulder and at the elbow
WALL = 12.0  # mm, of plate, rim and ribs
BOSS = (44.0, 36.0, 10.0)  # mm, radii of the bosses and how far they stand out
DEPTH = 62.0  # mm, from the faces of the bosses to the edge of the rim
RIBS = (145.0, 265.0)  # mm, where they are, from the shoulder on

Shape = list[tuple[int, int]]


def tapered(radii: Sequence[float], y: float, depth: float) -> Shape:
    """A plate from y on, as thick as `depth`: round about both joints, with straight flanks that touch both rounds."""
    occ = gmsh.model.occ
    lean = (radii[0] - radii[1]) / REACH  # sine of the angle of the flanks
    normal = np.array([np.sqrt(1 - lean**2), lean])
    ends = list(zip(radii, (0, REACH), strict=True))
    flanks = [(side * r * normal[0], z + r * normal[1]) for side in (1, -1) for r, z in ends]
    corners = [occ.addPoint(x, y, z) for x, z in (flanks[0], flanks[1], flanks[3], flanks[2])]
    lines = [occ.addLine(corners[k], corners[k - 3]) for k in range(4)]
    face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    between = [each for each in occ.extrude([(2, face)], 0, depth, 0) if each[0] == 3]
    rounds = [(3, occ.addCylinder(0, y, z, 0, depth, 0, r)) for r, z in zip(radii, (0, REACH), strict=True)]
    return list(occ.fuse(between, rounds)[0])


def draw() -> int:
    """The solid of the upper arm; returns its volume's tag."""
    occ = gmsh.model.occ
    outside = tapered(ROUND, BOSS[2], DEPTH - BOSS[2])
    pocket = tapered([r - WALL for r in ROUND], BOSS[2] + WALL, DEPTH)
    ribs = [(3, occ.addBox(-2 * ROUND[0], 0, z - WALL / 2, 4 * ROUND[0], 2 * DEPTH, WALL)) for z in RIBS]
    pocket, _ = occ.cut(pocket, ribs)
    milled, _ = occ.cut(outside, pocket)
    bosses = [(3, occ.addCylinder(0, 0, z, 0, BOSS[2], 0, r)) for r, z in zip(BOSS, (0, REACH), strict=False)]
    (arm,), _ = occ.fuse(milled, bosses)
    occ.synchronize()
    return int(arm[1])


def inertial(volume: int) -> str:
    """Mass (kg), center (m) and inertia about it (kg·m²), in axes of the link."""
    occ = gmsh.model.occ
    J = np.reshape(occ.getMatrixOfInertia(3, volume), (3, 3)) * DENSITY * 1e-15  # of mm⁵
    center = np.array(occ.getCenterOfMass(3, volume)) / 1e3
    mass = occ.getMass(3, volume) * DENSITY * 1e-9
    entries = " ".join(f'i{"xyz"[k]}{"xyz"[j]}="{J[k, j]:.9g}"' for k in range(3) for j in range(k, 3))
    return f'<origin xyz="{" ".join(f"{x:.9g}" for x in center)}"/><mass value="{mass:.9g}"/><inertia {entries}/>'


def main() -> None:
    """Write upper_arm.step beside this script."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
    gmsh.model.add("upper_arm")
    print(inertial(draw()))
    gmsh.write(str(HERE / "upper_arm.step"))
    gmsh.finalize()


if __name__ == "__main__":
    main()
