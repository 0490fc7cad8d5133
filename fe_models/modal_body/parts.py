"""What a modal body is made of: inertia, interfaces, stations, what pictures and stresses need. NumPy only."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Integers
from ...common.structs import struct

# ε_abc, (3, 3, 3): (u × v)_a = ε_abc u_b v_c.
LEVI_CIVITA = np.array([[[(a - b) * (b - c) * (c - a) / 2 for c in range(3)] for b in range(3)] for a in range(3)])


@dataclass(frozen=True, kw_only=True, eq=False)
class Integrals:
    """Inertia shape integrals of a link over its volume, in its axes (docs/theory.md; Shabana, ch. 5); n modes.

    Attributes:
        mass: m in kg.
        first_moment: (3,) ∫ρ x dV in kg·m.
        second_moment: (3, 3) ∫ρ x xᵀ dV in kg·m².
        S_bar: (3, n) ∫ρ Φ dV in √kg.
        I_bar: (3, 3, n) ∫ρ x_k Φ_l dV at [k, l] in m·√kg.
        S_bar_kl: (3, 3, n, n) ∫ρ Φ_kᵀ Φ_l dV at [k, l], no unit.
    """

    mass: float
    first_moment: Array
    second_moment: Array
    S_bar: Array
    I_bar: Array
    S_bar_kl: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Invariants(Integrals):
    """Integrals, SI units, with the inertia of a line of mass about its axis; φ (n,) is the twist of the modes."""

    J_spin: float  # J_s = ∫ρI_p dx in kg·m²
    h_spin: Array  # (n,) h_s = ∫ρI_p φ dx
    S_spin: Array  # (n, n) S_s = ∫ρI_p φᵀφ dx


class Frozen:
    """A dataclass that owns read-only copies of all its arrays, and read-only views of its mappings."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, Mapping):
                value = MappingProxyType({key: _frozen(entry) for key, entry in value.items()})
            object.__setattr__(self, name, _frozen(value))

    def __getstate__(self) -> dict[str, object]:
        """For copies and other processes, where views of mappings cannot go."""
        own = {field.name for field in fields(self)}  # type: ignore[arg-type]
        state = {name: value for name, value in vars(self).items() if name in own}
        return {name: dict(value) if isinstance(value, Mapping) else value for name, value in state.items()}

    def __setstate__(self, state: Mapping[str, object]) -> None:
        vars(self).update(state)
        Frozen.__post_init__(self)


def _frozen(value: object) -> object:
    if not isinstance(value, np.ndarray):
        return value
    if value.ndim == 0:
        return float(value)
    copy = np.array(value, dtype=np.int64 if np.issubdtype(value.dtype, np.integer) else np.float64)
    copy.setflags(write=False)
    return copy


@struct
class Interface(Frozen):
    """Modes at one point of the axis, in the link's frame; SI units."""

    position: Array  # (3,) in m, undeformed
    translation: Array  # (3, n) displacement of mode l in column l, in m per unit of its modal coordinate
    rotation: Array  # (3, n) small rotation of the cross section, in rad per unit of modal coordinate
    # of a solid's face, "mean" or "rigid": its mean moves so, or all of it; empty where nothing says so
    coupling: str = ""

    @property
    def motion(self) -> Array:
        """Translation, m, then rotation, rad (6, n), per unit of modal coordinate."""
        return np.concatenate([self.translation, self.rotation])


@struct
class Stations(Frozen):
    """Points along the axis, ascending in x, at which the modes are known; SI units."""

    position: Array  # (k, 3) in m
    translation: Array  # (k, 3, n), as in `Interface`
    rotation: Array  # (k, 3, n), as in `Interface`
    # (k,) extent of the cross section along y in m; height[i] holds from station i up to station i + 1 (of a taper, the
    # height in the middle between the two)
    height: Array
    # (e, 4) the stations on which each element's shapes are cubics, ascending; None where not known
    element: Integers | None = None
    # (k, q, 2) corners (y, z) of a beam's section in m, for pictures; holds as `height` does; None where not known
    outline: Array | None = None
    # (k, 2) EA in N and EI in N·m² of in-plane bending; holds as `height` does; None where not known
    rigidity: Array | None = None
    width: Array | None = None  # (k,) extent along z in m, likewise
    out_of_plane_rigidity: Array | None = None  # (k,) EI in N·m² of bending along z, likewise
    torsional_rigidity: Array | None = None  # (k,) GJ in N·m², likewise
    # (k, 2) middle of the extents along y and z, from the axis, in m, likewise; None where it is on the axis
    middle: Array | None = None


@struct
class PictureMesh(Frozen):
    """Mesh of the link for pictures, with its mode shapes; SI units."""

    points: Array  # (p, 3) in m
    cells: Integers  # (c, v) points of each cell
    mode_shapes: Array  # (p, 3, n) displacement in m per unit of modal coordinate
    # (e, 2) points of the edges of finite elements, where `cells` divide these for a smooth picture
    edges: Integers | None = None


@struct
class StressPoint(Frozen):
    """Stress and strain at one point of the link, in the link's frame; rows xx, yy, zz, yz, xz, xy."""

    position: Array  # (3,) in m, undeformed
    stress: Array  # (6, n) in Pa per unit of modal coordinate
    # (6, n), no unit, per unit of modal coordinate; shear strains are 2ε_yz, 2ε_xz, 2ε_xy, so that stress = C strain
    strain: Array
    # (6, l) in Pa per unit of each load in `ModalBody.stress_loads`, of the link under its reference condition; None
    # where not known
    static: Array | None = None


@struct
class MeasuredValues(Frozen):
    """Measured values of the modes, and the frequencies, Hz, of the finite element model."""

    frequency: Integers  # (n,) 1 of modes whose `ModalBody.frequency` was measured, else 0
    damping_ratio: Integers  # (n,) likewise, of `ModalBody.damping_ratio`
    computed_frequency: Array  # (n,)

    def in_words(self) -> str:
        """Return which modes are measured as text, counted from 1."""
        flagged = {"frequencies": self.frequency, "damping ratios": self.damping_ratio}
        numbers = {what: np.flatnonzero(flags) + 1 for what, flags in flagged.items()}
        parts = [f"{what} of modes {', '.join(map(str, of))}" for what, of in numbers.items() if len(of)]
        return " and ".join(parts)


@struct
class OutlinedPatches(Frozen):
    """Piezoelectric patches whose outlines, m, are edges of the mesh, on the faces at largest (top) and smallest y."""

    edges: Array  # (k, 2) begin and end of each patch, m from the root
    width: float  # along z, in m
    # (k, n) ∫ t·ε(Φ)t ds over each patch, with t the link's direction: modal forces per unit of membrane force (N/m,
    # positive in tension), in m² per unit of modal coordinate; None where no patches are on that face
    top: Array | None = None
    bottom: Array | None = None  # (k, n) likewise
    # (k, n) the same of the strain across, ∫ ε_zz(Φ) ds; None in earlier files, too
    top_across: Array | None = None
    bottom_across: Array | None = None


class AlongAxis(NamedTuple):
    """Modes at q points of the axis: `position` (q, 3), m; `translation`, m, `rotation`, rad per mode (q, 3, n)."""

    position: Array
    translation: Array
    rotation: Array


def interpolate(stations: Stations, x: Array) -> AlongAxis:
    """The modes at `x` (q,), m, within the stations; see `ModalBody.interpolate`."""
    element = stations.element
    if element is None:
        return _hermite(stations, x)
    beginnings = stations.position[element[:, 0], 0]
    index = np.clip(np.searchsorted(beginnings, x, side="right") - 1, 0, len(element) - 1)
    return through(stations, element[index], x)


def through(stations: Stations, members: Integers, x: Array) -> AlongAxis:
    """Modes at x (q,), m, by Lagrange polynomials through the stations of these numbers, `members` (q, i)."""
    nodes = stations.position[members, 0]
    others = ~np.eye(nodes.shape[1], dtype=bool)
    ratios = (x[:, None, None] - nodes[:, None, :]) / (nodes[:, :, None] - nodes[:, None, :] + ~others)
    weights = np.prod(ratios, axis=2, where=others)
    return AlongAxis(
        np.einsum("mi,mik->mk", weights, stations.position[members]),
        np.einsum("mi,mikn->mkn", weights, stations.translation[members]),
        np.einsum("mi,mikn->mkn", weights, stations.rotation[members]),
    )


def _hermite(stations: Stations, x: Array) -> AlongAxis:
    """Cubic Hermite on v with v' = rotation_z and on w with w' = −rotation_y; the rest through four stations."""
    positions = stations.position[:, 0]
    k = positions.size
    i = np.clip(np.searchsorted(positions, x, side="right") - 1, 0, k - 2)
    first = np.minimum(np.maximum(i - 1, 0), max(k - 4, 0))
    near = through(stations, first[:, None] + np.arange(min(4, k)), x)
    h = (positions[i + 1] - positions[i])[:, None]
    s = (x[:, None] - positions[i][:, None]) / h
    for axis, turn, sign in ((1, 2, 1.0), (2, 1, -1.0)):
        before, after = stations.translation[i, axis], stations.translation[i + 1, axis]
        slopes = [sign * h * stations.rotation[at, turn] for at in (i, i + 1)]
        rise = after - before
        near.translation[:, axis] = (
            before + rise * s**2 * (3 - 2 * s) + s * (1 - s) * ((1 - s) * slopes[0] - s * slopes[1])
        )
        derivative = 6 * s * (1 - s) * rise + (1 - s) * (1 - 3 * s) * slopes[0] + s * (3 * s - 2) * slopes[1]
        near.rotation[:, turn] = sign * derivative / h
    return near
