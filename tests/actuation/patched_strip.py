"""A cantilever strip of aluminium with patches on one face or on both, and its tip under their voltage."""

import numpy as np
from beam_links import beam_link, rectangle
from one_link import one_link

import ffrobot

E, L, B = 70e9, 0.3, 0.02
E_P, D31, T_P = 63e9, 110e-12, 0.5e-3
START, END, VOLT = 0.045, 0.105, 100.0


def tip(height, face, modes, pieces=1, **keys):
    """Deflection of the tip, m; of a link divided into `pieces`."""
    return solved(height, face, modes, pieces, **keys)["bent/points/strip.tip/deflection"][0, 1]


def solved(height, face, modes, pieces=1, places=(), **keys):
    """Results; stress points p0 … on the upper side at `places`."""
    stress = {"points": {f"p{k}": [x, height / 2, 0.0] for k, x in enumerate(places)}}
    modes = {"family": "in-plane-bending"} | modes
    link = beam_link(L, rectangle(height, B), 40, E=E, nu=0.3, name="strip", modes=modes, stress=stress)
    centers, on = [(START + END) / 2], {"face": face} if face else {}
    pzt = {"body": "strip", "centers": centers, "length": END - START, "width": B, "thickness": T_P, **on, **keys}
    keys = {"body": [{"name": "strip", "link": link, "pieces": pieces}], "pzt": [pzt | {"modulus": E_P, "d31": D31}]}
    load = [{"pzt": "strip", "voltage": [f"{VOLT}"]}]
    return ffrobot.solve(one_link("strip", link, {"name": "bent", "kind": "static"}, load=load, **keys))


def exact(height, faces):
    """Deflection of the tip of the Euler–Bernoulli beam, m."""
    return strain(height, faces)[0] * (END - START) * (L - (START + END) / 2)


def strain(height, faces):
    """(2,) curvature (1/m) and stretch of the axis under the patches: section loads of the free strain Λ in the layers
    over the composite section's 2 × 2 stiffness.
    """
    A, S, I = (B * np.diff([(height / 2) ** k, (height / 2 + T_P) ** k])[0] / k for k in (1, 2, 3))  # noqa: E741
    if faces == 2:
        A, S, I, moment = 2 * A, 0.0, 2 * I, 2 * S  # noqa: E741
    else:
        moment = S
    stiffness = np.diag([E * B * height**3 / 12, E * B * height]) + E_P * np.array([[I, -S], [-S, A]])
    free = E_P * D31 * VOLT / T_P * np.array([moment, -A if faces == 1 else 0.0])
    return np.linalg.solve(stiffness, free)
