"""Modal elements of MBDyn: `.fem` files (MBDyn input manual, joint `modal`), a sequence of numbered records.

Written with the rigid body inertia of record 12 and the invariants of records 14 to 18 (Inv3, Inv4, Inv8, Inv5, Inv9),
which newer versions of MBDyn read. Read from these, else from the lumped masses of record 11.

    Inv3 = ∫ρ Φ   Inv4 = ∫ρ x×Φ   Inv8_j = −∫ρ x~ Φ~_j   Inv5_jk = ∫ρ Φ_j×Φ_k   Inv9_jk = ∫ρ Φ~_j Φ~_k
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...fe_models.modal_body import Interface, ModalBody
from ...fe_models.modal_body.parts import LEVI_CIVITA
from ...mesh.included import number_of
from .integrals import (
    NOT_IN_THE_FILE,
    Node,
    ShapeIntegrals,
    about_center,
    integrals_of,
    modal_body,
    nodes_of,
    note,
    noted,
    slopes,
    with_agreed_masses,
)  # fmt: skip

GROUP = re.compile(r"\*\*\s*RECORD GROUP\s+(\d+)")
TITLES = {
    2: "FINITE ELEMENT NODE LIST", 3: "INITIAL MODAL DISPLACEMENTS", 4: "INITIAL MODAL VELOCITIES",
    5: "NODAL X COORDINATES", 6: "NODAL Y COORDINATES", 7: "NODAL Z COORDINATES", 9: "MODAL MASS MATRIX",
    10: "MODAL STIFFNESS MATRIX", 12: "RIGID BODY INERTIA MATRIX", 13: "MODAL DAMPING MATRIX", 14: "INVARIANT 3",
    15: "INVARIANT 4", 16: "INVARIANT 8", 17: "INVARIANT 5", 18: "INVARIANT 9",
}  # fmt: skip
REMARKS = (
    "records 14 to 18 carry the coupling with rigid motion: a version of MBDyn that does not read them takes record 12"
    " alone, without that coupling",
    "not carried by .fem: geometric stiffness, stresses, the surface, sections and families of modes",
)


def fem_text(body: ModalBody) -> tuple[str, tuple[str, ...]]:
    """The .fem file of a body, and what to know of it."""
    found, (nodes, numbers) = integrals_of(body), nodes_of(body)
    n = found.n_modes
    lines = [f"** {body.name}", f"** {note(body, numbers)}", "**",
             "** RECORD GROUP 1, HEADER", "**   REVISION.  NODES.  NORMAL, ATTACHMENT, CONSTRAINT, REJECTED MODES.",
             f"REV0 {len(nodes)} {n} 0 0 0", "**"]  # fmt: skip
    lines += _record(2, np.array([[node.number for node in nodes]]))
    x = np.array([node.at.position for node in nodes])
    columns = {3: np.zeros((n, 1)), 4: np.zeros((n, 1)), 5: x[:, :1], 6: x[:, 1:2], 7: x[:, 2:]}
    lines += [line for number, rows in columns.items() for line in _record(number, rows)]
    lines.append("** RECORD GROUP 8, MODE SHAPES")
    for k in range(n):
        lines.append(f"**    NORMAL MODE SHAPE # {k + 1}")
        lines += _rows(np.array([[*node.at.translation[:, k], *node.at.rotation[:, k]] for node in nodes]))
    lines.append("**")
    return "\n".join([*lines, *_integral_lines(found)]) + "\n", REMARKS


def _integral_lines(found: ShapeIntegrals) -> Iterator[str]:
    n, S = found.n_modes, found.S_bar_kl
    inv9 = np.einsum("abkj->abjk", S) - np.einsum("ab,jk->abjk", np.eye(3), np.trace(S))
    yield from _record(9, found.modal_mass)
    yield from _record(10, found.stiffness)
    yield from _record(12, [[found.mass], found.first_moment / found.mass, *about_center(found)])
    yield from _record(13, found.damping)
    yield from _record(14, found.S_bar)
    yield from _record(15, found.spin)
    yield from _record(16, (found.gyroscopic / 2).transpose(0, 2, 1).reshape(3, 3 * n))
    yield from _record(17, np.einsum("abc,bcjk->ajk", LEVI_CIVITA, S).reshape(3, n * n))
    yield from _record(18, inv9.transpose(0, 2, 3, 1).reshape(3, 3 * n * n))


def _record(number: int, rows: object) -> Iterator[str]:
    yield f"** RECORD GROUP {number}, {TITLES[number]}"
    yield from _rows(rows)
    yield "**"


def _rows(rows: object) -> Iterator[str]:
    for row in rows:  # type: ignore[attr-defined]
        yield " ".join(f"{value:d}" if isinstance(value, np.integer) else f"{value:.16e}" for value in row)


def read_fem(text: str, name: str) -> tuple[ModalBody, tuple[str, ...]]:
    """The body in the text of a .fem file, and remarks.

    Raises:
        InputError: it is no such file, records are missing or have other sizes, or it cannot be a body.
    """
    records = _records(text)
    labels = [int(value) for value in _numbers(records, 2)]
    count = len(labels)
    x = np.stack([_numbers(records, k, count) for k in (5, 6, 7)], axis=1)
    shapes = _numbers(records, 8)
    modes, rest = divmod(len(shapes), 6 * count)
    if rest or not modes:
        raise InputError(f"record 8: expected six numbers for each of {count} nodes and each mode, found {len(shapes)}")
    shapes = shapes.reshape(modes, count, 6)
    M, K = (_numbers(records, k, modes**2).reshape(modes, modes) for k in (9, 10))
    remarks = [NOT_IN_THE_FILE]
    D = _numbers(records, 13, modes**2).reshape(modes, modes) if 13 in records else np.zeros((modes, modes))
    if 13 not in records:
        remarks.append("no damping in the file: 0")
    if {12, 14, 15, 16, 17, 18} <= records.keys():
        found = _of_invariants(records, modes, M, K, D)
    elif 11 in records:
        found = _of_lumped_masses(_numbers(records, 11, 6 * count).reshape(count, 6), x, shapes, M, K, D)
        remarks.append("integrals are sums over the lumped masses of record 11")
    else:
        raise InputError(
            "expected records 12 and 14 to 18, or record 11 (lumped masses), which couple modes with rigid motion,"
            f" found records {', '.join(map(str, sorted(records)))}"
        )
    nodes = [
        Node(label, Interface(place, phi[:3], phi[3:]))
        for label, place, phi in zip(labels, x, shapes.transpose(1, 2, 0), strict=True)
    ]
    condition, numbers = noted("\n".join(line for line in text.splitlines()[:5] if line.startswith("**")), nodes)
    found, texts = with_agreed_masses(found)
    return modal_body(name, found, nodes, numbers, condition), (*remarks, *texts)


def _records(text: str) -> dict[int, list[str]]:
    """The words of each record; comments and titles left out."""
    found, current = dict[int, list[str]](), None
    for line in text.splitlines():
        if match := GROUP.match(line.strip()):
            current = found.setdefault(int(match[1]), [])
        elif current is not None and not line.lstrip().startswith("**"):
            current += line.split()
    if not {1, 2, 5, 6, 7, 8, 9, 10} <= found.keys():
        raise InputError(
            "expected a .fem file of MBDyn with records 1, 2 and 5 to 10, found"
            f" {'records ' + ', '.join(map(str, sorted(found))) if found else 'no records'}"
        )
    return found


def _numbers(records: dict[int, list[str]], number: int, count: int | None = None) -> Array:
    found = np.array([number_of(word, f"record {number}") for word in records[number]])
    if count is not None and len(found) != count:
        raise InputError(f"record {number}: expected {count} numbers, found {len(found)}")
    return found


def _of_invariants(records: dict[int, list[str]], n: int, M: Array, K: Array, D: Array) -> ShapeIntegrals:
    mass, *rest = _numbers(records, 12, 13)
    center, about_center = np.array(rest[:3]), np.array(rest[3:]).reshape(3, 3)
    J = about_center + mass * (center @ center * np.eye(3) - np.outer(center, center))
    inv3, inv4 = (_numbers(records, k, 3 * n).reshape(3, n) for k in (14, 15))
    inv8 = _numbers(records, 16, 9 * n).reshape(3, n, 3).transpose(0, 2, 1)
    inv5 = _numbers(records, 17, 3 * n * n).reshape(3, n, n)
    inv9 = _numbers(records, 18, 9 * n * n).reshape(3, n, n, 3).transpose(0, 3, 1, 2)
    S = (inv9 - np.einsum("ab,jk->abjk", np.eye(3), np.trace(inv9) / 2)).transpose(0, 1, 3, 2)
    _, centrifugal = slopes(S)
    return ShapeIntegrals(
        mass, mass * center, inv3, J, inv8 + inv8.transpose(1, 0, 2), inv4, inv5.transpose(0, 2, 1), M, centrifugal,
        K, D,
    )  # fmt: skip


def _of_lumped_masses(masses: Array, x: Array, shapes: Array, M: Array, K: Array, D: Array) -> ShapeIntegrals:
    """Sums over nodes: masses (count, 6), places (count, 3), shapes (n, count, 6)."""
    if np.any(np.ptp(masses[:, :3], axis=1) > 1e-9 * np.abs(masses[:, :3]).max()):
        raise InputError("record 11: expected the same mass along x, y and z at each node, found others")
    m, J = masses[:, 0], masses[:, 3:]
    if not m.sum() > 0:
        raise InputError(f"record 11: expected a mass greater than 0, found {m.sum():g}")
    Phi, turn = shapes[..., :3], shapes[..., 3:]
    second = np.einsum("i,ia,ib->ab", m, x, x)
    I_bar = np.einsum("i,ia,nib->abn", m, x, Phi)
    S = np.einsum("i,jia,kib->abjk", m, Phi, Phi)
    spin = np.einsum("abc,bcn->an", LEVI_CIVITA, I_bar) + np.einsum("ia,nia->an", J, turn)
    slope = 2 * np.einsum("ccn,ab->abn", I_bar, np.eye(3)) - I_bar - I_bar.transpose(1, 0, 2)
    spin_slope, centrifugal = slopes(S)
    return ShapeIntegrals(
        float(m.sum()), m @ x, np.einsum("i,nia->an", m, Phi),
        np.trace(second) * np.eye(3) - second + np.diag(J.sum(axis=0)), slope, spin, spin_slope, M, centrifugal, K, D,
    )  # fmt: skip
