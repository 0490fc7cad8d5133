"""Modal elements of MBDyn: `.fem` files (MBDyn input manual, joint `modal`), a sequence of numbered records.

Files are written with rigid body inertia (record 12) and invariants (records 14 to 18), which newer versions of MBDyn
read. They are read from these, else from the lumped masses of record 11.

    Inv3 = ∫ρ Φ   Inv4 = ∫ρ x×Φ   Inv8_j = −∫ρ x~ Φ~_j   Inv5_jk = ∫ρ Φ_j×Φ_k   Inv9_jk = ∫ρ Φ~_j Φ~_k
"""

import re
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.rotations import point_inertia
from ...fe_models.modal_body import Interface, ModalBody
from ...fe_models.modal_body.parts import LEVI_CIVITA
from ...mesh.included import number_of
from .integrals import ShapeIntegrals, integrals_of, modal_body, nodes_of, note, slopes

GROUP = re.compile(r"\*\*\s*RECORD GROUP\s+(\d+)")
TITLES = {
    2: "FINITE ELEMENT NODE LIST", 3: "INITIAL MODAL DISPLACEMENTS", 4: "INITIAL MODAL VELOCITIES",
    5: "NODAL X COORDINATES", 6: "NODAL Y COORDINATES", 7: "NODAL Z COORDINATES", 8: "MODE SHAPES",
    9: "MODAL MASS MATRIX", 10: "MODAL STIFFNESS MATRIX", 12: "RIGID BODY INERTIA MATRIX", 13: "MODAL DAMPING MATRIX",
    14: "INVARIANT 3", 15: "INVARIANT 4", 16: "INVARIANT 8", 17: "INVARIANT 5", 18: "INVARIANT 9",
}  # fmt: skip
HEADER = ("** RECORD GROUP 1, HEADER", "**   REVISION.  NODES.  NORMAL, ATTACHMENT, CONSTRAINT, REJECTED MODES.")
REMARKS = (
    "records 14 to 18 carry the coupling with rigid motion: a version of MBDyn that does not read them takes record 12"
    " alone, without that coupling",
    "not carried by .fem: geometric stiffness, stresses, the surface, sections and families of modes",
)


def fem_text(body: ModalBody) -> tuple[str, tuple[str, ...]]:
    """Return the text of a body's MBDyn .fem file, and remarks on losses."""
    integrals, (nodes, numbers) = integrals_of(body), nodes_of(body)
    n, S = integrals.n_modes, integrals.S_bar_kl
    x, y, z = np.array([at.position for at in nodes.values()]).T[:, :, None]
    shapes = np.array([np.concatenate([at.translation, at.rotation]) for at in nodes.values()])
    inv9 = S.swapaxes(2, 3) - np.einsum("ab,jk->abjk", np.eye(3), np.trace(S))
    records: dict[int, Iterable[Iterable[float]]] = {
        2: [nodes],
        3: np.zeros((n, 1)),
        4: np.zeros((n, 1)),
        5: x,
        6: y,
        7: z,
        8: [],
        9: integrals.modal_mass,
        10: integrals.stiffness,
        12: [[integrals.mass], integrals.first_moment / integrals.mass, *integrals.about_center],
        13: integrals.damping,
        14: integrals.S_bar,
        15: integrals.spin,
        16: (integrals.gyroscopic / 2).transpose(0, 2, 1).reshape(3, 3 * n),
        17: np.einsum("abc,bcjk->ajk", LEVI_CIVITA, S).reshape(3, n * n),
        18: inv9.transpose(0, 2, 3, 1).reshape(3, 3 * n * n),
    }
    lines = [f"** {body.name}", f"** {note(body, numbers)}", "**", *HEADER, f"REV0 {len(nodes)} {n} 0 0 0", "**"]
    for number, rows in records.items():
        lines += [f"** RECORD GROUP {number}, {TITLES[number]}", *_lines(rows)]
        for k in range(n) if number == 8 else ():
            lines += [f"**    NORMAL MODE SHAPE # {k + 1}", *_lines(shapes[:, :, k])]
        lines.append("**")
    return "\n".join(lines) + "\n", REMARKS


def _lines(rows: Iterable[Iterable[float]]) -> Iterator[str]:
    for row in rows:
        yield " ".join(f"{value:d}" if isinstance(value, int) else f"{value:.16e}" for value in row)


def read_fem(text: str, name: str) -> tuple[ModalBody, tuple[str, ...]]:
    """Return the modal body `name` by the text of a .fem file, and remarks on losses. Raises `InputError`."""
    records = _records(text)
    labels = [int(value) for value in _numbers(records, 2)]
    count = len(labels)
    if len(set(labels)) < count:
        raise InputError(f"record 2: expected {count} different numbers of nodes", len(set(labels)))
    x = np.stack([_numbers(records, k, count) for k in (5, 6, 7)], axis=1)
    shapes = _numbers(records, 8)
    modes, rest = divmod(len(shapes), 6 * count)
    if rest or not modes:
        raise InputError(f"record 8: expected six numbers for each of {count} nodes and each mode", len(shapes))
    shapes = shapes.reshape(modes, count, 6)
    remarks = []
    matrices: dict[str, Any] = {"damping": np.zeros((modes, modes))}
    for name_of, k in (("modal_mass", 9), ("stiffness", 10), ("damping", 13)):
        if k in records:
            matrices[name_of] = _numbers(records, k, modes**2).reshape(modes, modes)
        else:
            remarks.append("no damping in the file: 0")
    if {12, 14, 15, 16, 17, 18} <= records.keys():
        integrals = ShapeIntegrals(**_of_invariants(records, modes), **matrices)
    elif 11 in records:
        masses = _numbers(records, 11, 6 * count).reshape(count, 6)
        integrals = ShapeIntegrals(**_of_lumped_masses(masses, x, shapes), **matrices)
        remarks.append("integrals are sums over the lumped masses of record 11")
    else:
        raise InputError(
            "expected records 12 and 14 to 18, or record 11 (lumped masses), which couple modes with rigid motion",
            f"records {', '.join(map(str, sorted(records)))}",
        )
    nodes = {
        label: Interface(place, phi[:3], phi[3:])
        for label, place, phi in zip(labels, x, shapes.transpose(1, 2, 0), strict=True)
    }
    comments = "\n".join(line for line in text.splitlines()[:5] if line.startswith("**"))
    body, of_body = modal_body(name, integrals, nodes, comments)
    return body, (*of_body, *remarks)


def _records(text: str) -> dict[int, list[str]]:
    records, current = dict[int, list[str]](), None
    for line in text.splitlines():
        if match := GROUP.match(line.strip()):
            current = records.setdefault(int(match[1]), [])
        elif current is not None and not line.lstrip().startswith("**"):
            current += line.split()
    if not {1, 2, 5, 6, 7, 8, 9, 10} <= records.keys():
        numbers = f"records {', '.join(map(str, sorted(records)))}" if records else "no records"
        raise InputError("expected a .fem file of MBDyn with records 1, 2 and 5 to 10", numbers)
    return records


def _numbers(records: dict[int, list[str]], number: int, count: int | None = None) -> Array:
    values = np.array([number_of(word, f"record {number}") for word in records[number]])
    if count is not None and len(values) != count:
        raise InputError(f"record {number}: expected {count} numbers", len(values))
    return values


def _of_invariants(records: dict[int, list[str]], n: int) -> dict[str, Any]:
    rigid = _numbers(records, 12, 13)
    mass, center = float(rigid[0]), rigid[1:4]
    inv3, inv4 = (_numbers(records, k, 3 * n).reshape(3, n) for k in (14, 15))
    inv8 = _numbers(records, 16, 9 * n).reshape(3, n, 3).transpose(0, 2, 1)
    inv5 = _numbers(records, 17, 3 * n * n).reshape(3, n, n)
    inv9 = _numbers(records, 18, 9 * n * n).reshape(3, n, n, 3).transpose(0, 3, 1, 2)
    S = (inv9 - np.einsum("ab,jk->abjk", np.eye(3), np.trace(inv9) / 2)).transpose(0, 1, 3, 2)
    return {
        "mass": mass,
        "first_moment": mass * center,
        "S_bar": inv3,
        "inertia": rigid[4:].reshape(3, 3) + point_inertia(mass, center),
        "inertia_slope": inv8 + inv8.transpose(1, 0, 2),
        "spin": inv4,
        "spin_slope": inv5.transpose(0, 2, 1),
        "centrifugal_slope": slopes(S)["centrifugal_slope"],
    }


def _of_lumped_masses(masses: Array, x: Array, shapes: Array) -> dict[str, Any]:
    """Sums over nodes: masses (count, 6), x (count, 3), shapes (n, count, 6)."""
    if np.any(np.ptp(masses[:, :3], axis=1) > 1e-9 * np.abs(masses[:, :3]).max()):
        raise InputError("record 11: expected the same mass along x, y and z at each node", "others")
    m, J = masses[:, 0], masses[:, 3:]
    if not m.sum() > 0:
        raise InputError("record 11: expected a mass greater than 0", f"{m.sum():g}")
    Phi, turn = shapes[..., :3], shapes[..., 3:]
    second = np.einsum("i,ia,ib->ab", m, x, x)
    I_bar = np.einsum("i,ia,nib->abn", m, x, Phi)
    S = np.einsum("i,jia,kib->abjk", m, Phi, Phi)
    return {
        "mass": float(m.sum()),
        "first_moment": m @ x,
        "S_bar": np.einsum("i,nia->an", m, Phi),
        "inertia": np.trace(second) * np.eye(3) - second + np.diag(J.sum(axis=0)),
        "inertia_slope": 2 * np.trace(I_bar) * np.eye(3)[:, :, None] - I_bar - I_bar.transpose(1, 0, 2),
        "spin": np.einsum("abc,bcn->an", LEVI_CIVITA, I_bar) + np.einsum("ia,nia->an", J, turn),
        **slopes(S),
    }
