"""Bodies as matrices in .npz files, for EXUDYN, and Craig–Bampton's.

EXUDYN's ObjectFFRFreducedOrderInterface.LoadFromFile has the notation of A. Zwölfer and J. Gerstmayr (Acta Mech. 231,
2020): a~ is the matrix of the cross product with a, and of a mode ψ_l, three columns 3l … 3l + 2. Then
∫ρ a~ᵀ b = −∫ρ a×b and ∫ρ a~ᵀ b~ = ∫ρ [(a·b) E − b aᵀ].

Craig–Bampton coordinates: tx ty tz rx ry rz of each interface, root first, then fixed-interface modes; the link is
free, so that K has six zero eigenvalues. MATLAB's and Simscape's reduced order models have the same order.
"""

import io
from typing import Any

import numpy as np

from ...common.errors import InputError
from ...common.rotations import skew
from ...fe_models.modal_body import ModalBody
from ...fe_models.modal_body.craig_bampton import AXES, CONDITION, ROOT, craig_bampton
from .integrals import ShapeIntegrals, integrals_of, nodes_of

REMARKS = (
    "not carried by EXUDYN's file: rotations of sections at nodes, damping, geometric stiffness, stresses, the surface",
)


def exudyn_file(body: ModalBody) -> tuple[bytes, tuple[str, ...]]:
    """Return the content of EXUDYN's .npz file of a body, SI units, and remarks on node numbers and losses."""
    nodes, numbers = nodes_of(body)
    arrays = _reduced_order(integrals_of(body)) | {
        "modeBasis": np.concatenate([at.translation for at in nodes.values()]),
        "xRef": np.concatenate([at.position for at in nodes.values()]),
        "trigList": np.zeros((0, 3), dtype=np.int64),
        "postProcessingModes": np.array({}, dtype=object),
        "infoList": np.array([body.mode_count, len(nodes), 3, 4, 7, 7 + body.mode_count]),
        "rigidBodyNodeType": "NodeType.RotationEulerParameters",
        "fileVersion": 1,
        "type": "ObjectFFRFreducedOrderInterface",
    }
    content = io.BytesIO()
    np.savez(content, **arrays)
    names = ", ".join(f"{name} = {number - 1}" for name, number in numbers.items())
    return content.getvalue(), (*REMARKS, f"numbers of nodes, from 0: {names}")


def _reduced_order(integrals: ShapeIntegrals) -> dict[str, Any]:
    n, S, one = integrals.n_modes, integrals.S_bar_kl, np.eye(3)
    center = integrals.first_moment / integrals.mass
    tilde_tilde = np.einsum("ab,lm->lamb", one, np.trace(S)) - np.einsum("balm->lamb", S)
    return {
        "massMatrixReduced": integrals.modal_mass,
        "stiffnessMatrixReduced": integrals.stiffness,
        "inertiaLocal": integrals.inertia,
        "Mtt": integrals.mass * one,
        "totalMass": integrals.mass,
        "chiU": center,
        "chiUtilde": skew(center),
        "mPsiTildePsi": integrals.spin_slope.transpose(1, 0, 2).reshape(3 * n, n),
        "mPsiTildePsiTilde": tilde_tilde.reshape(3 * n, 3 * n),
        "mPhitTPsi": integrals.S_bar,
        "mPhitTPsiTilde": skew(integrals.S_bar.T).transpose(1, 0, 2).reshape(3, 3 * n),
        "mXRefTildePsi": -integrals.spin,
        "mXRefTildePsiTilde": (integrals.gyroscopic / 2).transpose(0, 2, 1).reshape(3, 3 * n),
    }


LOST = (
    "not carried by Craig–Bampton matrices: centrifugal and Coriolis terms of the deformation, geometric stiffness",
)


def craig_bampton_file(body: ModalBody) -> tuple[bytes, tuple[str, ...]]:
    """Return an .npz file with matrices M, K, C (c, c), SI units, and remarks on losses.

    The c `coordinates` are displacements and rotations (m, rad) of the i `interfaces` at `origins` (i, 3), m, then
    modal ones. `recovery` (3 k, c): displacements of k `points` (k, 3), m, per unit of coordinates. Raises
    `InputError` for bodies with other modes.
    """
    if body.reference_condition != CONDITION:
        raise InputError(
            f'modal body {body.name}: expected one with [reference] condition = "{CONDITION}" in its link file, with'
            " fixed-interface modes",
            f'"{body.reference_condition}"',
        )
    link = craig_bampton(body)
    names = [ROOT, *(name for name in body.interfaces if name != ROOT)]
    wanted = [f"{name}/{axis}" for name in names for axis in AXES]
    if link.coordinates[: len(wanted)] != wanted:
        missing = [name for name in wanted if name not in link.coordinates]
        raise InputError(
            f"modal body {body.name}: expected six coordinates of each interface",
            f'none for {", ".join(missing)}: use [modes] family = "all"',
        )
    damping = np.diag(2 * body.damping_ratio * 2 * np.pi * body.frequency)
    points = body.stations.position
    shapes = body.stations.translation @ link.recovery  # those of the modes, and of the root's frame
    shapes[:, :, :3] += np.eye(3)
    shapes[:, :, 3:6] -= skew(points - body.interfaces[ROOT].position)
    content = io.BytesIO()
    np.savez(
        content, M=link.mass, K=link.stiffness, C=link.recovery.T @ damping @ link.recovery,
        origins=np.array([body.interfaces[name].position for name in names]), interfaces=np.array(names),
        coordinates=np.array(link.coordinates), points=points, recovery=shapes.reshape(3 * len(points), -1),
    )  # fmt: skip
    return content.getvalue(), LOST
