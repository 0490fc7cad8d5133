"""Stress in the cross section of a beam from the forces and moments that it carries. NumPy only.

Normal stress is linear over the section. Shear stress of a transverse force is Zhuravskii's, the mean along the chord
through the point across the force (Timoshenko, Strength of Materials I, §26); of a torque, St Venant's.
"""

from math import hypot, pi

import numpy as np

from ...common.arrays import Array
from ...mesh.records import RectangleSection, SectionRecord
from ..link_records.section import Section

MEAN_POINTS = 40  # of a mean over a face: 1e-6 where the patch is as wide as the face, at whose edges shear falls to 0
TERMS = 2000  # of the series for rectangles: 2e-4 of the largest stress at their corners, far less elsewhere


def contains(record: SectionRecord, y: float, z: float) -> bool:
    """Whether the point (y, z), in m from the axis, lies in the section, to round-off."""
    slack = 1e-9
    if isinstance(record, RectangleSection):
        return abs(y) <= record.height / 2 * (1 + slack) and abs(z) <= record.width / 2 * (1 + slack)
    return record.inner * (1 - slack) <= 2 * hypot(y, z) <= record.outer * (1 + slack)


def section_stress(record: SectionRecord, section: Section, F: Array, M: Array, y: float, z: float) -> Array:
    """Stress (6, n), rows xx, yy, zz, yz, xz, xy, Pa, at the point (y, z), m from the axis.

    F (3, n) N and M (3, n) N·m about the centroid: what the part beyond the section exerts on it, in n cases.
    """
    stress = np.zeros((6, F.shape[1]))
    stress[0] = F[0] / section.area - M[2] * y / section.I_yy + M[1] * z / section.I_zz
    shear_y, shear_z = _torsion(record, y, z)
    stress[5] = F[1] * _transverse(record, y) / section.I_yy + M[0] / section.torsion * shear_y
    stress[4] = F[2] * _transverse(record, z, across=True) / section.I_zz + M[0] / section.torsion * shear_z
    return stress


def surface_shear(extent: float, across: float, width: float) -> float:
    """Shear strain along x by twist (1 rad/m), in m: its mean over the middle `width` (m) of a face of a rectangle.

    The face is `across` (m) wide, the opposite one `extent` (m) away.
    """
    nodes, weights = np.polynomial.legendre.leggauss(MEAN_POINTS)
    record = RectangleSection(shape="rectangle", height=extent, width=across)
    values = [_torsion(record, extent / 2, node * width / 2)[1] for node in nodes]
    return float(np.dot(weights, values)) / 2


def _transverse(record: SectionRecord, distance: float, across: bool = False) -> float:
    """Q/b in m²: first moment of the section beyond `distance` from the axis over the length of the chord there."""
    if isinstance(record, RectangleSection):
        half = (record.width if across else record.height) / 2
        return (half**2 - distance**2) / 2
    # Q = ⅔ (outer^³⁄₂ − inner^³⁄₂), b = 2 (outer^½ − inner^½), written without the quotient.
    outer, inner = (max(radius**2 - distance**2, 0.0) for radius in (record.outer / 2, record.inner / 2))
    return float(outer + np.sqrt(outer * inner) + inner) / 3


def _torsion(record: SectionRecord, y: float, z: float) -> tuple[float, float]:
    """σ_xy and σ_xz over G φ', in m."""
    if not isinstance(record, RectangleSection):
        return -z, y
    if record.height <= record.width:
        dX, dY = _stress_function(record.height / 2, record.width / 2, y, z)
        return dY, -dX
    dX, dY = _stress_function(record.width / 2, record.height / 2, z, y)
    return dX, -dY


def _stress_function(a: float, b: float, X: float, Y: float) -> tuple[float, float]:
    """∂/∂X and ∂/∂Y of Prandtl's stress function over G φ' in the rectangle |X| ≤ a ≤ b, |Y| ≤ b.

    Timoshenko & Goodier, Theory of Elasticity, §109, eq. 166, with Σ ± sin(nπX/2a)/n² = π²X/8a summed.
    """
    n = np.arange(1, 2 * TERMS, 2)
    sign = np.where(n % 4 == 1, 1.0, -1.0)
    k = n * pi / (2 * a)
    decay = np.exp(-k * (b - min(abs(Y), b))) / (1 + np.exp(-2 * k * b))
    cosh, sinh = decay * (1 + np.exp(-2 * k * abs(Y))), np.sign(Y) * decay * (1 - np.exp(-2 * k * abs(Y)))
    scale = 16 * a / pi**2 * sign / n**2
    return float(-2 * X + (scale * cosh) @ np.sin(k * X)), float(-(scale * sinh) @ np.cos(k * X))
