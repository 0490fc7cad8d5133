"""Standard input data of flexible bodies, SID_FEM files (Wallrapp 1994), which SIMPACK, EMBSlib and pymbs read.

Files are written as by PY_SID: J as six rows xx yy zz xy xz yz, M1 as (row, mode, column), G_r by mode, G_e by axis.
Other dialects are read, too: J as (3, 3), M1 as (row, column, mode).
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.rotations import skew
from ...common.tables import shown
from ...fe_models.modal_body import Interface, ModalBody
from ...mesh.included import number_of
from .integrals import ShapeIntegrals, integrals_of, modal_body, nodes_of, note

ROWS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Entries of a symmetric matrix in the six rows of J."""
LARGEST_ASYMMETRY = 1e-6  # of C_r's M1: a symmetric part is geometric stiffness, or wrong
REMARKS = (
    "not carried by SID as written here: geometric stiffness, stresses, the surface, sections and families of modes",
)
SAME = 1e-3  # symmetric parts of G_e and C_r, of the largest; rad


def sid_text(body: ModalBody) -> tuple[str, tuple[str, ...]]:
    """Return the text of a body's SID_FEM file, and remarks on losses."""
    integrals, (nodes, numbers) = integrals_of(body), nodes_of(body)
    lines = [f"{len(nodes):5d}{integrals.n_modes:5d}    : nodes, modes : {body.name} : {note(body, numbers)}", " part"]
    lines += ["      new modal                        =", "           refmod"]
    lines.append(f"                mass                   = {_fortran(integrals.mass)}")
    lines.append(f"                nelastq                = {integrals.n_modes:5d}")
    lines += [
        f"                ielastq ({k + 1:4d})         = Eigen Mode {k + 1:4d} : {value:12.6g} Hz"
        for k, value in enumerate(body.frequency)
    ]
    lines += ["           end refmod", "           frame"]
    for number, at in nodes.items():
        lines += [
            f"                new node               = {number:5d}",
            "                     rframe            = body ref",
            *_lines_of("origin", at.position[:, None], at.translation[:, :, None], 21),
            *_lines_of("phi", at.translation, None, 21),
            *_lines_of("psi", at.rotation, None, 21),
            *_lines_of("AP", np.eye(3), skew(at.rotation.T).transpose(1, 0, 2), 21),  # (row, mode, column)
            "                end node",
        ]
    lines += ["           end frame", *_integral_lines(integrals), "      end modal", " end part"]
    return "\n".join(lines) + "\n", REMARKS


def _integral_lines(integrals: ShapeIntegrals) -> Iterator[str]:
    n = integrals.n_modes
    J, slope = integrals.inertia, integrals.inertia_slope
    by_axis = 2 * np.concatenate(list(integrals.spin_slope), axis=1)  # G_e = 2∫ρΦᵀe~Φ = twice the slope of C_r
    yield from _lines_of("mdCM", integrals.first_moment[:, None], integrals.S_bar[:, :, None])
    yield from _lines_of("J", np.array([[J[k]] for k in ROWS]), np.array([slope[k] for k in ROWS])[:, :, None])
    yield from _lines_of("Ct", integrals.S_bar.T)
    yield from _lines_of("Cr", integrals.spin.T, integrals.spin_slope.transpose(1, 2, 0))
    is_unit = np.array_equal(integrals.modal_mass, np.eye(n))
    yield from _lines_of("Me", integrals.modal_mass, structure=IDENTITY if is_unit else None)
    yield from _lines_of("Gr", integrals.gyroscopic.transpose(0, 2, 1).reshape(3, 3 * n))
    yield from _lines_of("Ge", by_axis)
    yield from _lines_of("Oe", integrals.centrifugal, integrals.centrifugal_slope.transpose(1, 2, 0))
    yield from _lines_of("ksigma", np.zeros((n, 1)))
    yield from _lines_of("Ke", integrals.stiffness)
    yield from _lines_of("De", integrals.damping)


def read_sid(text: str, name: str) -> tuple[ModalBody, tuple[str, ...]]:
    """Return the modal body `name` by the text of a SID_FEM file, and remarks on losses. Raises `InputError`."""
    head, top = _parse(text)
    part = top["part"]
    modal = Modal(next((one for one in part.inside if one.name == "modal"), None) or part["modal"])
    integrals = _integrals(modal)
    nodes = {int(node.number("number")): _interface(modal, node) for node in modal.nodes}
    if not 0 < len(nodes) == len(modal.nodes):
        raise InputError("frame: expected nodes with a number each", f"{len(nodes)} numbers of {len(modal.nodes)}")
    body, remarks = modal_body(name, integrals, nodes, head)
    return body, (*remarks, *_turned_nodes(modal), *_checks(modal, integrals))


def _interface(modal: "Modal", node: "SidObject") -> Interface:
    phi, psi = (modal.taylor(node[key], (3, modal.modes)).m0 for key in ("phi", "psi"))
    return Interface(modal.taylor(node["origin"], (3, 1)).m0[:, 0], phi, psi)


def _turned_nodes(modal: "Modal") -> Iterator[str]:
    """A line on nodes whose axes A_P are not those of the body, as interfaces need."""
    turned = [
        node.keys["number"]
        for node in modal.nodes
        for part in node.inside
        if part.name.lower() == "ap" and np.abs(modal.taylor(part, (3, 3)).m0 - np.eye(3)).max() > SAME
    ]
    if turned:
        yield f"AP: turned axes of nodes {', '.join(turned)} are omitted: joints there have the axes of the body"


def _integrals(modal: "Modal") -> ShapeIntegrals:
    n = modal.modes
    mdCM, J, Cr, Oe = modal["mdCM", (3, 1)], modal["J", (6, 1), (3, 3)], modal["Cr", (n, 3)], modal["Oe", (n, 6)]
    Me, Ke, De = (modal[key, (n, n)].m0 for key in ("Me", "Ke", "De"))
    J0, J1 = J.m0, J.m1.transpose(0, 2, 1)
    if len(J0) == len(ROWS):
        row_of = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])
        J0, J1 = J.m0[row_of, 0], J.m1[row_of, :, 0]
    slope = Cr.m1.transpose(2, 0, 1)
    if _symmetric_part(slope, Me) is not None and not _is_in_both(modal, slope):
        raise InputError(
            "Cr: expected m1 without a symmetric part",
            "one: the file has geometric stiffness among its integrals, which cannot be distinguished from them in Oe;"
            " write it without",
        )
    return ShapeIntegrals(
        mass=modal.root["refmod"].number("mass"),
        first_moment=mdCM.m0[:, 0],
        S_bar=mdCM.m1[:, :, 0],
        inertia=J0,
        inertia_slope=J1,
        spin=Cr.m0.T,
        spin_slope=0.5 * (slope - slope.transpose(0, 2, 1)),
        modal_mass=Me,
        centrifugal_slope=Oe.m1.transpose(2, 0, 1),
        stiffness=Ke,
        damping=De,
    )


def _symmetric_part(slope: Array, Me: Array) -> Array | None:
    """Of M1 of C_r (3, n, n); None where it has none."""
    symmetric: Array = 0.5 * (slope + slope.transpose(0, 2, 1))
    scale = max(np.abs(slope).max(initial=0.0), np.abs(Me).max())
    return symmetric if np.abs(symmetric).max(initial=0.0) > 0.5 * LARGEST_ASYMMETRY * scale else None


def _Ge_by_axis(modal: "Modal", expected: Array) -> Array:
    """G_e (3, n, n) in the order of columns that is nearer to `expected` (3, n, n)."""
    n = modal.modes
    Ge = modal["Ge", (n, 3 * n)].m0
    layouts = (Ge.reshape(n, 3, n).transpose(1, 0, 2), Ge.reshape(n, n, 3).transpose(2, 0, 1))
    return min(layouts, key=lambda each: float(np.abs(each - expected).max()))


def _is_in_both(modal: "Modal", slope: Array) -> bool:
    """Whether G_e has twice the symmetric part of C_r: geometric stiffness is in C_r alone."""
    Ge, twice = _Ge_by_axis(modal, 2 * slope), slope + slope.transpose(0, 2, 1)
    return bool(np.abs(0.5 * (Ge + Ge.transpose(0, 2, 1)) - twice).max() < SAME * np.abs(twice).max())


def _checks(modal: "Modal", integrals: ShapeIntegrals) -> Iterator[str]:
    """A line for each quantity that the file has twice, where the two differ."""
    n = modal.modes
    Gr = modal["Gr", (3, 3 * n)].m0
    slope, of_Cr = integrals.inertia_slope, modal["Cr"].m1.transpose(2, 0, 1)
    layouts = (Gr.reshape(3, n, 3).transpose(0, 2, 1), Gr.reshape(3, 3, n))
    parts = [(each + each.transpose(1, 0, 2)) / 2 for each in layouts]
    symmetric = _symmetric_part(of_Cr, integrals.modal_mass)
    if symmetric is not None:
        yield (
            f"Cr, Ge: both have a symmetric part, {np.abs(symmetric).max():.2g} in m1 of Cr, which ∫ρΦᵀe~Φ cannot have"
            " and geometric stiffness would have in Cr alone: left out"
        )
    identities = (
        ("Gr: symmetric part", min(parts, key=lambda part: np.abs(part - slope).max()), slope, "the slope of J"),
        ("Ct:", modal["Ct", (n, 3)].m0, integrals.S_bar.T, "the slope of mdCM"),
        ("Ge:", _Ge_by_axis(modal, 2 * of_Cr), 2 * of_Cr, "twice m1 of Cr"),
        ("Oe:", modal["Oe"].m0, integrals.centrifugal, "−½ and −1 times the slope of J"),
    )
    for name, given, expected, what in identities:
        error, scale = (np.abs(part).max() for part in (given - expected, expected))
        if error > 1e-6 * scale:
            yield f"{name} off {what} by {error:.2g}, of {scale:.2g} at most"


MOST = 10**7  # entries of a matrix: a file that asks for more is damaged
SYMMETRIC, IDENTITY = 2, 4  # values of `structure`


class Taylor(NamedTuple):
    """A matrix M0 (rows, columns) + Σ_l M1[:, l] q_l of modal coordinates q; M1 (rows, modes, columns); file units."""

    m0: Array
    m1: Array


@dataclass
class SidObject:
    """An object of a SID_FEM file: its keys with their values as text, and the objects inside it."""

    name: str
    keys: dict[str, str] = field(default_factory=dict)
    inside: "list[SidObject]" = field(default_factory=list)

    def __getitem__(self, name: str) -> "SidObject":
        for one in self.inside:
            if one.name.lower() == name.lower():
                return one
        raise InputError(f"expected the object {name} in {self.name}", "none")

    def number(self, key: str) -> float:
        """Return the number that a key has. Raises `InputError` where there is none."""
        if key not in self.keys:
            raise InputError(f"{self.name}: expected the key {key}", "none")
        return number_of(self.keys[key], f"{self.name}: {key}")


def _parse(text: str) -> tuple[str, SidObject]:
    head, *lines = text.splitlines() or [""]
    top = SidObject("file")
    stack = [top]
    for number, line in enumerate(lines, 2):
        words, _, value = (part.strip() for part in line.partition("="))
        if words == "end" or words.startswith("end "):
            if len(stack) == 1:
                raise InputError(f"line {number}: expected an object to end", f'"{shown(words)}" outside of all')
            stack.pop()
        elif not words:
            continue
        elif value and not words.startswith("new "):
            stack[-1].keys[words] = value
        else:
            inner = SidObject(words.removeprefix("new ").strip(), {"number": value} if value else {})
            stack[-1].inside.append(inner)
            stack.append(inner)
    if len(stack) > 1:
        raise InputError(f"expected `end {stack[-1].name}`", "the end of the file")
    return head, top


class Modal:
    """Object `modal` of a SID_FEM file: its content `root`, number of `modes`, `nodes`; `modal[NAME]` is a matrix."""

    def __init__(self, root: SidObject) -> None:
        self.root, self.modes = root, int(root["refmod"].number("nelastq"))
        if self.modes < 1:
            raise InputError("refmod: nelastq: expected at least one mode", self.modes)
        thirds = (index[2] for order, index, _ in _entries(root["mdCM"]) if order and len(index) == 3)
        self.nodes = [node for node in root["frame"].inside if node.name == "node"]
        # M1 is (row, column, mode), not (row, mode, column): mdCM has one column, so that a third index is of a mode.
        self.mode_is_last = any(third > 0 for third in thirds)

    def __getitem__(self, key: str | tuple[Any, ...]) -> Taylor:
        name, *sizes = [key] if isinstance(key, str) else key
        return self.taylor(self.root[name], *sizes)

    def taylor(self, matrix: SidObject, *sizes: tuple[int, int]) -> Taylor:
        """Return the matrix in an object. Raises `InputError` unless it has one of `sizes` (rows, columns), if any."""
        nrow, ncol = (int(matrix.number(key)) for key in ("nrow", "ncol"))
        is_possible = nrow > 0 and ncol > 0 and nrow * ncol * (self.modes + 1) <= MOST
        if not is_possible or (sizes and (nrow, ncol) not in sizes):
            wanted = " or ".join(f"{rows} × {columns}" for rows, columns in sizes) or "rows × columns"
            raise InputError(f"{matrix.name}: expected a matrix of {wanted}", f"nrow = {nrow}, ncol = {ncol}")
        terms = Taylor(np.zeros((nrow, ncol)), np.zeros((nrow, self.modes, ncol)))
        structure = int(matrix.number("structure"))
        if structure == SYMMETRIC and nrow != ncol:
            raise InputError(f"{matrix.name}: expected a square matrix of structure {SYMMETRIC}", f"{nrow} × {ncol}")
        if structure == IDENTITY:
            terms.m0[:] = np.eye(nrow, ncol)
        for order, index, value in _entries(matrix):
            if order and self.mode_is_last and len(index) == 3:
                index = (index[0], index[2], index[1])
            target = terms[order]
            if len(index) != target.ndim or any(not 0 <= k < size for k, size in zip(index, target.shape, strict=True)):
                at = ", ".join(str(k + 1) for k in index)
                raise InputError(f"{matrix.name}: expected m{order} within {target.shape}", f"m{order}({at})")
            target[index] = value
            if structure == SYMMETRIC:
                target[index[::-1]] = value
        return terms


def _entries(matrix: SidObject) -> Iterator[tuple[int, tuple[int, ...], float]]:
    """Order, indices from 0, value."""
    for key, value in matrix.keys.items():
        if match := re.fullmatch(r"m([01])\s*\(([\s\d,]+)\)", key):
            try:
                index = tuple(int(part) - 1 for part in match[2].split(","))
            except ValueError:
                raise InputError(f"{matrix.name}: expected whole numbers in indices", f'"{shown(key)}"') from None
            yield int(match[1]), index, number_of(value, f"{matrix.name}: {key}")


def _lines_of(
    name: str, m0: Array, m1: Array | None = None, indent: int = 11, structure: int | None = None
) -> Iterator[str]:
    """The object `name` with M0 (rows, columns), and M1 (rows, modes, columns) where it is of first order."""
    terms = [m0] if m1 is None else [m0, m1]
    if structure is None:
        structure = 3 if any(np.any(term) for term in terms) else 0
    sizes = {"nrow": m0.shape[0], "ncol": m0.shape[1], "nq": 0 if m1 is None else m1.shape[1], "nqn": 0}
    blank = " " * indent
    yield f"{blank}{name}"
    for key, value in {"order": len(terms) - 1, **sizes, "structure": structure}.items():
        yield f"{blank}     {key:<22}= {value:5d}"
    for order, term in enumerate(terms) if structure != IDENTITY else ():
        for index in zip(*np.nonzero(term), strict=True):
            at = ",".join(f"{k + 1:2d}" for k in index)
            yield f"{blank}     {f'm{order}({at})':<22}= {_fortran(term[index])}"
    yield f"{blank}end {name}"


def _fortran(value: float) -> str:
    return f"{value: .16E}".replace("E", "D")
