"""Unit loads of a link, by the names that geometric stiffness and static stresses have in its file. NumPy only.

| name | load |
|---|---|
| `t_x` … `t_z` | d'Alembert forces of a unit acceleration of the frame, −ρ e |
| `r_x` … `r_z` | of a unit angular acceleration, −ρ e × x |
| `omega_xx` … `omega_yz` | of a unit product of angular velocities, −ρ e × (e × x); of `xy` both orders |
| `force/NAME/x` … | unit force at an interface |
| `moment/NAME/x` … | unit moment there |
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ...common.arrays import Array
from .parts import Interface

PAIRS = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
MOTIONS = 12  # unit loads of inertia, which come before those at interfaces


def interface_load_names(interfaces: Iterable[str]) -> list[str]:
    """Names of the unit loads at interfaces, six at each: force/NAME/x … z, then moment/NAME/x … z."""
    return [f"{kind}/{name}/{axis}" for name in interfaces for kind in ("force", "moment") for axis in "xyz"]


def unit_load_names(interfaces: Iterable[str]) -> list[str]:
    """Names of the unit loads of a link: 12 of inertia, t_x … omega_yz, then those at the interfaces."""
    motions = [f"{kind}_{axis}" for kind in "tr" for axis in "xyz"] + [f"omega_{pair}" for pair in PAIRS]
    return motions + interface_load_names(interfaces)


def loads_at(names: Sequence[str], interface: str) -> slice:
    """Where `names`, all unit loads, have those at an interface: three forces, then three moments."""
    first = names.index(f"force/{interface}/x")
    return slice(first, first + 6)


def inertia_wrenches(x: Array, mass: Array, inertia: Array) -> Array:
    """D'Alembert force, N, and moment, N·m (q, 6, `MOTIONS`), of q small bodies for each unit motion of the frame.

    Frame acceleration a, angular acceleration α and angular velocity ω (Newton and Euler): force −m [a + α × x + ω × (ω
    × x)], moment −J α − ω × J ω about the center; x (q, 3) m, `mass` (q,) kg, `inertia` (q, 3) J_x, J_y, J_z in kg·m².
    """
    e, m = np.eye(3), mass[:, None]
    wrenches = np.zeros((len(x), 6, MOTIONS))
    for k, unit in enumerate(e):
        wrenches[:, :3, k] = -m * unit
        wrenches[:, :3, 3 + k] = -m * np.cross(unit, x)
        wrenches[:, 3:, 3 + k] = -inertia * unit
    for column, (k, j) in enumerate(PAIRS.values(), start=6):
        for a, b in [(k, j)] if k == j else [(k, j), (j, k)]:
            wrenches[:, :3, column] -= m * np.cross(e[a], np.cross(e[b], x))
            wrenches[:, 3:, column] -= np.cross(e[a], inertia * e[b])
    return wrenches


def work_on_modes(
    S_bar: Array, I_bar: Array, interfaces: Mapping[str, Interface], h_spin: Array | None = None
) -> dict[str, Array]:
    """Modal forces Φᵀb (n,), N/√kg, of each unit load b, from invariants of a link and modes at interfaces.

    `S_bar` (3, n), √kg, `I_bar` (3, 3, n), m·√kg: see `Integrals`. `h_spin` (n,), m·√kg: ∫ρI_p φ dx of a line of mass
    with twist φ, not in `I_bar`.
    """
    cross = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}
    work = dict[str, Array]()
    for k, axis in enumerate("xyz"):
        i, j = cross[axis]
        work[f"t_{axis}"] = -S_bar[k]
        work[f"r_{axis}"] = I_bar[j, i] - I_bar[i, j]  # −∫ρ (e × x)·Φ
    if h_spin is not None:
        work["r_x"] = work["r_x"] - h_spin
    trace = I_bar[0, 0] + I_bar[1, 1] + I_bar[2, 2]
    for name, (a, b) in PAIRS.items():  # −e_a × (e_b × x) = δ_ab x − x_a e_b
        work[f"omega_{name}"] = trace - I_bar[a, a] if a == b else -(I_bar[a, b] + I_bar[b, a])
    for name, at in interfaces.items():
        work |= dict(zip(interface_load_names([name]), at.motion, strict=True))
    return work
