"""The modal body: all that the dynamics knows of a flexible link. NumPy only; no finite element library is needed."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import Any

import numpy as np

from ...common.arrays import Array, Integers
from ...common.errors import InputError
from ...common.rotations import skew
from .parts import (
    LEVI_CIVITA,
    AlongAxis,
    Frozen,
    Integrals,
    Interface,
    MeasuredValues,
    OutlinedPatches,
    PictureMesh,
    Stations,
    StressPoint,
    interpolate,
)
from .unit_loads import unit_load_names

# m_ff = I and the identities between invariants must hold to this.
IDENTITY_TOLERANCE = 1e-8
POSITIVE_TOLERANCE = 1e-6  # of matrices that round-off, or a mesh, may leave indefinite
INTERFACE_TOLERANCE = 1e-6

# Axes of arrays: n modes, k stations, p points of the picture, l loads of static stresses, j patches, ? any number.
OF_BODY = {
    "length": "", "mass": "", "first_moment": "3", "second_moment": "33", "frequency": "n", "stiffness": "nn",
    "modal_mass": "nn", "damping_ratio": "n", "residual": "n", "S_bar": "3n", "I_bar": "33n", "S_bar_kl": "33nn",
    "J_spin": "", "h_spin": "n", "S_spin": "nn",
}  # fmt: skip
OF_SURFACE = {"surface_stress": "p6n", "surface_static": "p6l"}
OF_PART: dict[type, dict[str, str]] = {
    Stations: {
        "position": "k3", "translation": "k3n", "rotation": "k3n", "height": "k", "outline": "k?2", "rigidity": "k2",
        "width": "k", "out_of_plane_rigidity": "k", "torsional_rigidity": "k", "middle": "k2",
    },
    PictureMesh: {"points": "p3", "mode_shapes": "p3n", "edges": "?2"},
    Interface: {"position": "3", "translation": "3n", "rotation": "3n"},
    StressPoint: {"position": "3", "stress": "6n", "strain": "6n", "static": "6l"},
    MeasuredValues: {"frequency": "n", "damping_ratio": "n", "computed_frequency": "n"},
    OutlinedPatches: {"edges": "j2", **dict.fromkeys(("top", "bottom", "top_across", "bottom_across"), "jn")},
}  # fmt: skip


@dataclass(frozen=True, eq=False, kw_only=True)
class ModalBody(Integrals, Frozen):
    """Flexible link in mass-orthonormal modal coordinates, SI units, axes of the link; immutable and validated.

    Attributes:
        name: of the link.
        kind: "beam" or "solid".
        reference_condition: "cantilever", "simply-supported" or "craig-bampton".
        length: in m.
        frequency: (n,) in Hz.
        stiffness: (n, n) K_ff = diag(ω²) in rad²/s².
        modal_mass: (n, n) m_ff = I to 1e-8, no unit.
        damping_ratio: (n,) ζ, no unit.
        damping_of: "link", or "robot" if ζ refers to the vibrations of the assembled robot.
        family: n names; of a residual attachment mode, that of the loads behind it.
        residual: (n,) 0 of eigenmodes, 1 of residual attachment modes, which come after them; all 0 where not given.
        J_spin: J_s = ∫ρI_p dx in kg·m² of lines of mass about their axis, not in `second_moment`; None: unknown.
        h_spin: (n,) h_s = ∫ρI_p φ dx in m·√kg, with φ the twist of the modes.
        S_spin: (n, n) S_s = ∫ρI_p φᵀφ dx, no unit; `S_bar_kl` holds it once more at [2, 2], where the plane needs it.
        geometric_stiffness: (n, n), rad²/s² per unit of load, by the load's name.
        interfaces: by name; `root` and `tip` always.
        stations: along the axis.
        mesh: for pictures.
        stress: modal stresses by the name of their point, if the link file has any.
        surface_stress: (p, 6, n) Pa per mode, at the points of `mesh`, as in `StressPoint`; None unless requested.
        stress_loads: names of the l unit loads (`unit_loads`) whose static stresses are known; none in old files.
        surface_static: (p, 6, l) Pa per unit of load, likewise, as `static` in `StressPoint`.
        surface_patches: modal forces of patches outlined in the mesh; None where there are none.
        measured: marks of measured frequencies and damping ratios; None: all computed.
        input_hash: of the link file's content.
        modes_hash: of that part of it on which the modes depend; empty where not known.
        ffrobot_version: that made it.
        assembly: program that assembled the matrices, with versions; empty where not known.
        eigensolver: program that found the modes, likewise.
        remarks: omitted content of the part's file, one sentence each.

    Raises:
        InputError: shapes do not fit together, something is not finite, or an identity does not hold.
    """

    name: str
    kind: str
    reference_condition: str
    length: float
    frequency: Array
    stiffness: Array
    modal_mass: Array
    damping_ratio: Array
    family: tuple[str, ...]
    interfaces: Mapping[str, Interface]
    stations: Stations
    mesh: PictureMesh
    geometric_stiffness: Mapping[str, Array] = field(default_factory=dict)
    stress: Mapping[str, StressPoint] = field(default_factory=dict)
    surface_stress: Array | None = None
    stress_loads: tuple[str, ...] = ()
    surface_static: Array | None = None
    surface_patches: OutlinedPatches | None = None
    residual: Integers = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    damping_of: str = "link"
    J_spin: float | None = None
    h_spin: Array | None = None
    S_spin: Array | None = None
    measured: MeasuredValues | None = None
    input_hash: str = ""
    modes_hash: str = ""
    ffrobot_version: str = ""
    assembly: str = ""
    eigensolver: str = ""
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not np.size(self.residual):
            object.__setattr__(self, "residual", np.zeros(len(self.family), dtype=np.int64))
        super().__post_init__()
        with np.errstate(all="ignore"):  # what is not finite is refused
            for problem in _problems(self):
                raise InputError(f"modal body {self.name}: {problem}")

    def __repr__(self) -> str:
        modes = f"{self.modes_in_words} of {self.frequency[0]:.5g} … {self.frequency[self.eigenmode_count - 1]:.5g} Hz"
        link = f"{self.kind}, {self.reference_condition}, {self.length:.5g} m, {self.mass:.5g} kg"
        return f"ModalBody({self.name!r}): {link}, {modes}, interfaces {', '.join(self.interfaces)}"

    @property
    def mode_count(self) -> int:
        """Number of modes, n, attachment modes included."""
        return len(self.family)

    @property
    def eigenmode_count(self) -> int:
        """Number of eigenmodes, which come before attachment modes."""
        return self.mode_count - int(self.residual.sum())

    @property
    def modes_in_words(self) -> str:
        """Numbers of eigenmodes and attachment modes, as text."""
        static = self.mode_count - self.eigenmode_count
        kind = "constraint" if self.reference_condition == "craig-bampton" else "attachment"
        return f"{self.eigenmode_count} modes" + (f" and {static} {kind} modes" if static else "")

    @property
    def begin(self) -> float:
        """Place x, m, where the length begins: the first station, or the root if stations go beyond."""
        first, last = self.stations.position[[0, -1], 0]
        is_first = abs(self.length - last + first) <= INTERFACE_TOLERANCE * self.length
        return float(first if is_first else self.interfaces["root"].position[0])

    def interpolate(self, x: float) -> Interface:
        """Mode shapes at the place `x`, m, on the axis of the link.

        With `stations.element` all six components are the cubic through the four stations of the element: exactly the
        finite element functions of a beam, of either theory. Otherwise motion along y and z is the cubic Hermite
        polynomial of (translation, rotation) between two stations, exact for Euler–Bernoulli; axial motion and twist
        are the cubic through the four nearest stations.

        Raises:
            InputError: x is outside the body.
        """
        position, translation, rotation = self.along_axis(np.array([x]))
        return Interface(position[0], translation[0], rotation[0])

    def along_axis(self, x: Array) -> AlongAxis:
        """Mode shapes at places `x` (q,), m, on the axis; interpolation and errors as in `interpolate`."""
        positions = self.stations.position[:, 0]
        slack = 1e-9 * self.length
        outside = x[~((positions[0] - slack <= x) & (x <= positions[-1] + slack))]
        if outside.size:
            raise InputError(
                f"modal body {self.name}: x: expected {positions[0]:g} … {positions[-1]:g} m, the body's",
                f"{outside[0]:g} m",
            )
        return interpolate(self.stations, x.clip(positions[0], positions[-1]))


def _problems(body: ModalBody) -> Iterator[str]:
    """Return what does not hold of a modal body; the first one counts."""
    k = body.stations.position.shape[0]
    if body.kind not in ("beam", "solid"):
        yield f'kind: expected "beam" or "solid", found {body.kind}'
    for name, array, shape in _expected_shapes(body):
        if np.shape(array) != shape:
            yield f"{name}: expected shape {shape}, found {np.shape(array)}"
        if not np.all(np.isfinite(array)):
            yield f"{name}: expected finite numbers, found NaN or infinity"
    for name in ("root", "tip"):
        if name not in body.interfaces:
            yield f"interfaces: expected one named {name}, found {', '.join(body.interfaces) or 'none'}"
    for name, value in (("length", body.length), ("mass", body.mass)):
        if not value > 0:
            yield f"{name}: expected a positive number, found {value}"
    if k < 2 or np.any(np.diff(body.stations.position[:, 0]) <= 0):
        yield "stations.position: expected at least two, ascending in x"
    (first, last), end = body.stations.position[[0, -1], 0], body.begin + body.length
    error = min(abs(end - last), abs(end - body.interfaces["tip"].position[0]))
    if not error <= INTERFACE_TOLERANCE * body.length or not first <= end - body.length / 2 <= last:
        yield f"length: expected {last - first:g} m, from first to last station, found {body.length} m"
    element = body.stations.element
    if element is not None and not _is_chain(element, k):
        yield "stations.element: expected four ascending stations for each element, from the first to the last"
    if np.any((body.residual != 0) & (body.residual != 1)) or np.any(np.diff(body.residual) < 0):
        yield "residual: expected 0 of each eigenmode, then 1 of each residual attachment mode"
    unknown = [load for load in body.stress_loads if load not in unit_load_names(body.interfaces)]
    if unknown:
        yield f"stress/loads: expected unit loads of the link and its interfaces, found {', '.join(unknown)}"
    if np.any(body.frequency <= 0):
        yield "frequency: expected positive numbers"
    if np.any(body.damping_ratio < 0):
        yield "damping_ratio: expected numbers not below 0"
    yield from _identities(body)
    yield from _inertia(body)
    yield from _spin(body)
    yield from _interfaces(body)


def _inertia(body: ModalBody) -> Iterator[str]:
    """Kinetic energy is positive in every motion: about the center of mass, and with what the modes carry along."""
    center, S = body.first_moment / body.mass, body.S_bar
    second = body.second_moment - np.outer(body.first_moment, center)
    about_center = np.trace(second) * np.eye(3) - second  # inertia of a mass on an interface may be about z alone
    spin = np.einsum("abc,bcn->an", LEVI_CIVITA, body.I_bar) - skew(center) @ S
    turning = spin.T @ np.linalg.pinv(about_center, POSITIVE_TOLERANCE, hermitian=True) @ spin
    yield from _positive("second_moment, as inertia about the center of mass", about_center, np.abs(about_center).max())
    yield from _positive("modal_mass, less S_bar and I_bar", body.modal_mass - S.T @ S / body.mass - turning)
    yield from _positive("S_bar_kl[k, k], less S_bar and S_spin", moving_along(body, body.S_spin))


def moving_along(body: Integrals, S_spin: Array | None) -> Array:
    """∫ρ φ_kᵀφ_k dV (3, n, n), no unit, along each axis k, less the mean φ_k: positive where mass exists.

    `S_spin` (n, n), no unit, which z has besides, is left out.
    """
    S = body.S_bar
    each = np.einsum("kkab->kab", body.S_bar_kl) - np.einsum("ka,kb->kab", S, S) / body.mass
    each[2] -= 0.0 if S_spin is None else S_spin
    return each


def _positive(name: str, matrix: Array, scale: float = 1.0) -> Iterator[str]:
    lowest = np.linalg.eigvalsh((matrix + matrix.swapaxes(-1, -2)) / 2).min(initial=0.0)
    if not lowest >= -POSITIVE_TOLERANCE * scale:  # nor NaN
        yield f"{name}: expected no negative eigenvalue, found {lowest:.3g}"


def _spin(body: ModalBody) -> Iterator[str]:
    """Spin inertia is known whole or not at all; its energy is positive."""
    parts = {name: getattr(body, name) for name in ("J_spin", "h_spin", "S_spin")}
    missing = [name for name, value in parts.items() if value is None]
    if missing:
        if len(missing) < len(parts):
            known = ", ".join(name for name in parts if name not in missing)
            yield f"{missing[0]}: expected together with {known}, found none"
        return
    J, h, S = parts.values()
    if not J >= 0:
        yield f"J_spin: expected a number not below 0, found {J}"
    of_modes = S - (np.outer(h, h) / J if J else np.abs(S) + np.outer(h, h))
    yield from _positive("S_spin, less h_spinᵀ h_spin / J_spin", of_modes)


def _interfaces(body: ModalBody) -> Iterator[str]:
    """Interfaces of a beam are points of its axis: they move as its stations do."""
    if body.kind != "beam" or body.stations.element is None:
        return
    for name, interface in body.interfaces.items():
        axis = body.interpolate(float(interface.position[0]))
        for key in ("position", "translation", "rotation"):
            given, stated, of_all = (getattr(of, key) for of in (interface, axis, body.stations))
            error = np.max(np.abs(given - stated), initial=0.0)
            if not error <= INTERFACE_TOLERANCE * np.max(np.abs(of_all), initial=0.0):
                yield f"interfaces/{name}/{key}: expected what stations say there, found a difference of {error:.2g}"


def _identities(body: ModalBody) -> Iterator[str]:
    squares = (2 * np.pi * body.frequency) ** 2
    total = np.trace(body.S_bar_kl)
    identities = [
        ("second_moment", "symmetric", body.second_moment, body.second_moment.T),
        ("stiffness", "diag((2π frequency)²)", body.stiffness, np.diag(squares)),
        ("modal_mass", "the identity", body.modal_mass, np.eye(body.mode_count)),
        ("S_bar_kl", "S_bar_kl[l, k] = S_bar_kl[k, l]ᵀ", body.S_bar_kl, body.S_bar_kl.transpose(1, 0, 3, 2)),
        ("S_bar_kl", "a sum S_bar_11 + S_bar_22 + S_bar_33 equal to modal_mass", total, body.modal_mass),
        *((f"geometric_stiffness/{k}", "symmetric", v, v.T) for k, v in body.geometric_stiffness.items()),
    ]
    if body.S_spin is not None:
        identities.append(("S_spin", "symmetric", body.S_spin, body.S_spin.T))
    for name, expected, left, right in identities:
        error = np.max(np.abs(left - right), initial=0.0)
        if not error <= IDENTITY_TOLERANCE * np.max(np.abs(right), initial=0.0):
            yield f"{name}: expected {expected} to {IDENTITY_TOLERANCE:g}, found a difference of {error:.2g}"


def _expected_shapes(body: ModalBody) -> Iterator[tuple[str, Any, tuple[int, ...]]]:
    """Name, value and wanted shape of all that the body has; static stresses of loads are demanded with their names."""
    loads, patches = len(body.stress_loads), body.surface_patches
    sizes = {"n": body.mode_count, "k": len(body.stations.position), "p": len(body.mesh.points), "l": loads}
    sizes["j"] = 0 if patches is None else len(patches.edges)
    records: list[tuple[str, object, Mapping[str, str]]] = [("", body, OF_BODY)]
    if body.surface_stress is not None:
        records.append(("stress/", body, OF_SURFACE))
    parts = [("stations.", body.stations), ("mesh.", body.mesh), ("measured.", body.measured)]
    parts += [(f"interfaces/{name}/", interface) for name, interface in body.interfaces.items()]
    parts += [(f"stress/points/{name}/", point) for name, point in body.stress.items()]
    parts.append(("surface_patches/", patches))
    records += [(prefix, part, OF_PART[type(part)]) for prefix, part in parts if part is not None]
    for prefix, record, axes_of in records:
        for name, axes in axes_of.items():
            value = getattr(record, name)
            if value is not None or (axes.endswith("l") and loads):
                of = zip_longest(axes, np.shape(value)[: len(axes)])
                shape = tuple(sizes[axis] if axis in sizes else size if axis == "?" else int(axis) for axis, size in of)
                yield prefix + name.removesuffix("_stress"), value, shape
    for load, matrix in body.geometric_stiffness.items():
        yield f"geometric_stiffness/{load}", matrix, (sizes["n"], sizes["n"])


def _is_chain(element: Integers, stations: int) -> bool:
    """Whether the elements (e, 4) cover all intervals between stations, one after the other."""
    if element.ndim != 2 or element.shape[1] != 4 or np.any(np.diff(element) <= 0):
        return False
    return np.array_equal(np.append(element[:, 0], stations - 1), np.append(0, element[:, 3]))
