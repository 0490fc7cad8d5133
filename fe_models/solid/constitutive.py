"""Hooke's law of the materials of a solid, in the axes of the link. NumPy only."""

from collections.abc import Sequence

import numpy as np

from ...common.arrays import Array
from ..link_records.link import Material, OrthotropicMaterial


def stiffness(material: Material | OrthotropicMaterial) -> Array:
    """C (6, 6), σ = C ε, Pa; rows σ_xx, σ_yy, σ_zz, σ_yz, σ_xz, σ_xy, columns ε_xx … and 2ε_yz, 2ε_xz, 2ε_xy.

    Inverse of the compliance of Jones, Mechanics of Composite Materials (1999), eq. 2.26; equal constants if isotropic.
    """
    E, nu = np.full(3, material.youngs_modulus), np.full(3, material.poissons_ratio)
    of_shear = material.shear_modulus if isinstance(material, OrthotropicMaterial) else E / (2 * (1 + nu))
    G_xy, G_yz, G_xz = of_shear
    C = np.diag([0.0, 0.0, 0.0, G_yz, G_xz, G_xy])
    C[:3, :3] = np.linalg.inv(_normal_compliance(E, nu))
    return C


def is_stable(material: OrthotropicMaterial) -> bool:
    """Whether every strain stores energy: the compliance of normal strains is positive definite."""
    return bool(np.linalg.eigvalsh(_normal_compliance(material.youngs_modulus, material.poissons_ratio))[0] > 0)


def _normal_compliance(E: Sequence[float] | Array, nu: Sequence[float] | Array) -> Array:
    """(3, 3) ε_xx, ε_yy, ε_zz under unit σ_xx, σ_yy, σ_zz, in 1/Pa."""
    return np.array(
        [
            [1 / E[0], -nu[0] / E[0], -nu[2] / E[0]],
            [-nu[0] / E[0], 1 / E[1], -nu[1] / E[1]],
            [-nu[2] / E[0], -nu[1] / E[1], 1 / E[2]],
        ]
    )
