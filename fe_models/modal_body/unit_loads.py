"""Unit loads of a link, by the names that geometric stiffness and static stresses have in its file. NumPy only.

| name | load |
|---|---|
| `t_x` … `t_z` | d'Alembert forces of a unit acceleration of the frame, −ρ e |
| `r_x` … `r_z` | of a unit angular acceleration, −ρ e × x |
| `omega_xx` … `omega_yz` | of a unit product of angular velocities, −ρ e × (e × x); of `xy` both orders |
| `force/NAME/x` … | unit force at an interface |
| `moment/NAME/x` … | unit moment there |
"""

from collections.abc import Iterable, Mapping

import numpy as np

from ...common.arrays import Array
from .parts import Interface

PAIRS = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}


def interface_load_names(interfaces: Iterable[str]) -> list[str]:
    """Names of the loads at interfaces, six of each: forces, then moments."""
    return [f"{kind}/{name}/{axis}" for name in interfaces for kind in ("force", "moment") for axis in "xyz"]


def unit_load_names(interfaces: Iterable[str]) -> list[str]:
    """Names of the unit loads of a link with these interfaces."""
    motions = [f"{kind}_{axis}" for kind in "tr" for axis in "xyz"] + [f"omega_{pair}" for pair in PAIRS]
    return motions + interface_load_names(interfaces)


def inertia_wrenches(x: Array, mass: Array, inertia: Array) -> dict[str, Array]:
    """D'Alembert force and moment (q, 6) of small bodies for each unit motion of the frame.

    Frame acceleration a, angular acceleration α and angular velocity ω (Newton and Euler): force −m [a + α × x + ω × (ω
    × x)], moment −J α − ω × J ω about the center; x (q, 3) m, `mass` (q,) kg, `inertia` (q, 3) J_x, J_y, J_z in kg·m².
    """
    e = np.eye(3)
    m = mass[:, None]
    wrenches = dict[str, Array]()
    for axis, unit in zip("xyz", e, strict=True):
        wrenches[f"t_{axis}"] = np.hstack([-m * unit, np.zeros_like(x)])
    for axis, unit in zip("xyz", e, strict=True):
        wrenches[f"r_{axis}"] = np.hstack([-m * np.cross(unit, x), -inertia * unit])
    for name, (k, j) in PAIRS.items():
        wrench = np.zeros((len(x), 6))
        for a, b in [(k, j)] if k == j else [(k, j), (j, k)]:
            wrench[:, :3] -= m * np.cross(e[a], np.cross(e[b], x))
            wrench[:, 3:] -= np.cross(e[a], inertia * e[b])
        wrenches[f"omega_{name}"] = wrench
    return wrenches


def work_on_modes(
    S_bar: Array, I_bar: Array, interfaces: Mapping[str, Interface], h_spin: Array | None = None
) -> dict[str, Array]:
    """Return modal forces Φᵀb (n,), N/√kg, of each unit load b, from invariants of a link and modes at interfaces.

    `h_spin` (n,) = ∫ρI_p φ dx of a line of mass, which Ī does not have.
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
        rows = np.concatenate([at.translation, at.rotation])
        work |= dict(zip(interface_load_names([name]), rows, strict=True))
    return work
