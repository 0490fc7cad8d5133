"""Bodies for EXUDYN: what its ObjectFFRFreducedOrderInterface.LoadFromFile reads from an .npz file.

Notation of A. Zwölfer and J. Gerstmayr (Acta Mech. 231, 2020): a~ is the matrix of the cross product with a, and of a
mode ψ_l, three columns 3l … 3l + 2. Then ∫ρ a~ᵀ b = −∫ρ a×b and ∫ρ a~ᵀ b~ = ∫ρ [(a·b) E − b aᵀ].
"""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from ...common.arrays import as_floats
from ...common.rotations import skew
from ...fe_models.modal_body import ModalBody
from .integrals import ShapeIntegrals, integrals_of, nodes_of

REMARKS = (
    "not carried by EXUDYN's file: rotations of sections at nodes, damping, geometric stiffness, stresses, the surface",
)


def exudyn_file(body: ModalBody) -> tuple[bytes, tuple[str, ...]]:
    """The .npz file of a body, its nodes in the order of the remark, and what it does not carry."""
    nodes, numbers = nodes_of(body)
    arrays = reduced_order(integrals_of(body))
    arrays |= {
        "modeBasis": np.concatenate([node.at.translation for node in nodes]),
        "xRef": np.concatenate([node.at.position for node in nodes]),
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


def reduced_order(found: ShapeIntegrals) -> dict[str, Any]:
    """The constant matrices of ObjectFFRFreducedOrder."""
    n, S, one = found.n_modes, found.S_bar_kl, np.eye(3)
    total = S[0, 0] + S[1, 1] + S[2, 2]
    center = as_floats(found.first_moment / found.mass)
    tilde_tilde = np.einsum("ab,lm->lamb", one, total) - np.einsum("balm->lamb", S)
    return {
        "massMatrixReduced": found.modal_mass,
        "stiffnessMatrixReduced": found.stiffness,
        "inertiaLocal": found.inertia,
        "Mtt": found.mass * one,
        "totalMass": found.mass,
        "chiU": center,
        "chiUtilde": skew(center),
        "mPsiTildePsi": found.spin_slope.transpose(1, 0, 2).reshape(3 * n, n),
        "mPsiTildePsiTilde": tilde_tilde.reshape(3 * n, 3 * n),
        "mPhitTPsi": found.S_bar,
        "mPhitTPsiTilde": skew(found.S_bar.T).transpose(1, 0, 2).reshape(3, 3 * n),
        "mXRefTildePsi": -found.spin,
        "mXRefTildePsiTilde": (found.gyroscopic / 2).transpose(0, 2, 1).reshape(3, 3 * n),
    }
