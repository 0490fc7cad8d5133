"""Craig–Bampton matrices for programs that take M, K and C of interface coordinates and fixed-interface modes.

Coordinates: tx ty tz rx ry rz of each interface, root first, then the modes of the link held at all of them; the link
is free in space, so that K has six eigenvalues of zero. This is the order of MATLAB's and Simscape's reduced order
models and of Newton's `ModalGeneratorCraigBampton`.
"""

from __future__ import annotations

import io

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.rotations import skew
from ...fe_models.modal_body import ModalBody
from ...fe_models.modal_body.craig_bampton import AXES, CONDITION, ROOT, craig_bampton

REMARKS = (
    "not carried by Craig–Bampton matrices: centrifugal and Coriolis terms of the deformation, geometric stiffness",
)


def craig_bampton_file(body: ModalBody) -> tuple[bytes, tuple[str, ...]]:
    """An .npz file with M, K, C, origins, interfaces, coordinates and the recovery of displacements.

    Raises:
        InputError: the body has other modes, or its interfaces do not move in all six components.
    """
    if body.reference_condition != CONDITION:
        raise InputError(
            f'modal body {body.name}: expected one with [reference] condition = "{CONDITION}" in its link file,'
            f' with fixed-interface modes, found "{body.reference_condition}"'
        )
    link = craig_bampton(body)
    names = [ROOT, *(name for name in body.interfaces if name != ROOT)]
    wanted = [f"{name}/{axis}" for name in names for axis in AXES]
    if link.coordinates[: len(wanted)] != wanted:
        missing = [name for name in wanted if name not in link.coordinates]
        raise InputError(
            f"modal body {body.name}: expected six coordinates of each interface, found none for {', '.join(missing)}:"
            ' take [modes] family = "all"'
        )
    damping = np.diag(2 * body.damping_ratio * 2 * np.pi * body.frequency)
    content = io.BytesIO()
    np.savez(
        content, M=link.mass, K=link.stiffness, C=link.recovery.T @ damping @ link.recovery,
        origins=np.array([body.interfaces[name].position for name in names]), interfaces=np.array(names),
        coordinates=np.array(link.coordinates), points=body.stations.position, recovery=_recovery(body, link.recovery),
    )  # fmt: skip
    return content.getvalue(), REMARKS


def _recovery(body: ModalBody, modal: Array) -> Array:
    """(3 k, m) displacements of the k stations by the coordinates: those of the root's frame, and of the modes."""
    x, Phi = body.stations.position, body.stations.translation
    shapes = np.einsum("ian,nm->iam", Phi, modal)
    shapes[:, :, :3] += np.eye(3)
    shapes[:, :, 3:6] -= skew(x - body.interfaces[ROOT].position)
    return np.asarray(shapes.reshape(3 * len(x), -1))
