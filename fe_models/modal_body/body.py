"""The modal body: all that the dynamics knows of a flexible link. NumPy only; no finite element library is needed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ...common.arrays import Array, Integers
from ...common.errors import InputError
from .checks import check
from .parts import Interface, MeasuredValues, OutlinedPatches, PictureMesh, Stations, StressPoint, freeze


@dataclass(frozen=True, eq=False)
class ModalBody:
    """A flexible link in mass-orthonormal modal coordinates; immutable, checked when made. SI units, the link's frame.

    Symbols: docs/theory.md, Inertia shape integrals (Shabana, Dynamics of Multibody Systems, ch. 5); n modes.

    Attributes:
        name: of the link.
        kind: "beam" or "solid".
        reference_condition: "cantilever", "simply-supported" or "craig-bampton".
        length: in m.
        mass: m in kg.
        first_moment: (3,) ∫ρ x dV in kg·m.
        second_moment: (3, 3) ∫ρ x xᵀ dV in kg·m².
        frequency: (n,) in Hz.
        stiffness: (n, n) K_ff = diag(ω²).
        modal_mass: (n, n) m_ff = I to 1e-8.
        damping_ratio: (n,) ζ.
        damping_of: "link", or "robot" where ζ is wanted of the vibrations of the assembled robot.
        family: n names; of a residual attachment mode, that of the loads behind it.
        residual: (n,) 0 of eigenmodes, 1 of residual attachment modes, which come after them; all 0 where not given.
        S_bar: (3, n) ∫ρ Φ dV.
        I_bar: (3, 3, n) ∫ρ x_k Φ_l dV at [k, l].
        S_bar_kl: (3, 3, n, n) ∫ρ Φ_kᵀ Φ_l dV at [k, l].
        J_spin: J_s = ∫ρI_p dx in kg·m² of lines of mass about their axis, not in `second_moment`; None: unknown.
        h_spin: (n,) h_s = ∫ρI_p φ dx, with φ the twist of the modes.
        S_spin: (n, n) S_s = ∫ρI_p φᵀφ dx; `S_bar_kl` holds it once more at [2, 2], where the plane needs it.
        geometric_stiffness: (n, n) for each unit load, by its name.
        interfaces: by name; `root` and `tip` always.
        stations: along the axis.
        mesh: for pictures.
        stress: modal stresses by the name of their point, where the link file asks for them.
        surface_stress: (p, 6, n) stress at the points of `mesh`, as in `StressPoint`; None where not asked for.
        stress_loads: names of the l unit loads (`unit_loads`) whose static stresses are known; none in old files.
        surface_static: (p, 6, l) likewise, as `static` in `StressPoint`.
        surface_patches: modal forces of patches outlined in the mesh; None where there are none.
        measured: which frequencies and damping ratios were measured; None where all are computed.
        input_hash: of the link file's content.
        modes_hash: of that part of it on which the modes depend; empty where not known.
        ffrobot_version: that made it.

    Raises:
        InputError: shapes do not fit together, something is not finite, or an identity does not hold.
    """

    name: str
    kind: str
    reference_condition: str
    length: float
    mass: float
    first_moment: Array
    second_moment: Array
    frequency: Array
    stiffness: Array
    modal_mass: Array
    damping_ratio: Array
    family: tuple[str, ...]
    S_bar: Array
    I_bar: Array
    S_bar_kl: Array
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

    def __post_init__(self) -> None:
        if not np.size(self.residual):
            object.__setattr__(self, "residual", np.zeros(len(self.family), dtype=np.int64))
        freeze(self)
        check(self)

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
        """Number of eigenmodes."""
        return self.mode_count - int(self.residual.sum())

    @property
    def modes_in_words(self) -> str:
        """How many modes there are."""
        static = self.mode_count - self.eigenmode_count
        kind = "constraint" if self.reference_condition == "craig-bampton" else "attachment"
        return f"{self.eigenmode_count} modes" + (f" and {static} {kind} modes" if static else "")

    def interpolate(self, x: float) -> Interface:
        """What the modes do at `x` (m from the root) on the axis.

        Where the stations of each element are known (files made here) all six components are the cubic through the
        four stations of the element: exactly the finite element functions of a beam, of either theory. Where they are
        not, y and z motion is the cubic Hermite polynomial of (translation, rotation) between two stations, exact for
        Euler–Bernoulli, and axial motion and twist are the cubic through the four nearest stations.

        Raises:
            InputError: x is outside the body.
        """
        positions = self.stations.position[:, 0]
        slack = 1e-9 * self.length
        if not positions[0] - slack <= x <= positions[-1] + slack:
            raise InputError(
                f"modal body {self.name}: x: expected {positions[0]:g} … {positions[-1]:g} m, the body's, found {x:g} m"
            )
        x = float(np.clip(x, positions[0], positions[-1]))
        element = self.stations.element
        if element is None:
            return _hermite(self.stations, x)
        index = np.clip(np.searchsorted(positions[element[:, 0]], x, side="right") - 1, 0, len(element) - 1)
        return _through(self.stations, element[index], x)


def _through(stations: Stations, members: Integers, x: float) -> Interface:
    """The polynomial through the stations `members`, at x (Lagrange)."""
    nodes = stations.position[members, 0]
    others = ~np.eye(len(nodes), dtype=bool)
    weights = np.prod((x - nodes) / (nodes[:, None] - nodes + ~others), axis=1, where=others)
    return Interface(
        weights @ stations.position[members],
        np.einsum("i,ikn->kn", weights, stations.translation[members]),
        np.einsum("i,ikn->kn", weights, stations.rotation[members]),
    )


def _hermite(stations: Stations, x: float) -> Interface:
    """Cubic Hermite on v with v' = rotation_z and on w with w' = −rotation_y; the rest through four stations."""
    positions = stations.position[:, 0]
    k = positions.size
    i = int(np.clip(np.searchsorted(positions, x, side="right") - 1, 0, k - 2))
    first = min(max(i - 1, 0), max(k - 4, 0))
    near = _through(stations, np.arange(first, min(first + 4, k)), x)
    h = positions[i + 1] - positions[i]
    s = (x - positions[i]) / h
    translation, rotation = near.translation.copy(), near.rotation.copy()
    for axis, turn, sign in ((1, 2, 1.0), (2, 1, -1.0)):
        values = stations.translation[i : i + 2, axis]
        slopes = sign * h * stations.rotation[i : i + 2, turn]
        rise = values[1] - values[0]
        translation[axis] = values[0] + rise * s**2 * (3 - 2 * s) + s * (1 - s) * ((1 - s) * slopes[0] - s * slopes[1])
        derivative = 6 * s * (1 - s) * rise + (1 - s) * (1 - 3 * s) * slopes[0] + s * (3 * s - 2) * slopes[1]
        rotation[turn] = sign * derivative / h
    return Interface(near.position, translation, rotation)
