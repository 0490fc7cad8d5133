"""Flexible links from polynomials (Ritz), without stage 1: bending in the plane, as soft as one likes."""

from types import MappingProxyType

import numpy as np
from mechanisms import make_model, revolute
from numpy.polynomial import Legendre, Polynomial

from ffrobot.mbs.model.body import Body, BodyPoint, Stiffening

CLAMPED = Polynomial([0, 0, 1])  # ξ²: deflection and slope vanish at the root
SUPPORTED = Polynomial([0, 1, -1])  # ξ (1 − ξ): deflection vanishes at both ends


def ritz_link(name, condition, length=1.0, mass=1.0, EI=30.0, modes=3, damping_ratio=0.0, extra=3, stiffening=False):
    """An Euler–Bernoulli beam in `modes` + `extra` polynomials; bending rigidity EI in N·m²."""
    factor = {"cantilever": CLAMPED, "simply-supported": SUPPORTED}[condition]
    basis = [factor * Legendre.basis(k, [0, 1]).convert(kind=Polynomial) for k in range(modes + extra)]
    xi, weight = np.polynomial.legendre.leggauss(modes + extra + 4)
    xi, weight = (xi + 1) / 2, weight / 2 * mass
    w = np.array([f(xi) for f in basis])
    w_2 = np.array([f.deriv(2)(xi) for f in basis]) / length**2
    M = (w * weight) @ w.T
    K = (w_2 * weight) @ w_2.T * EI * length / mass
    L_inverse = np.linalg.inv(np.linalg.cholesky(M))
    stiffness, vectors = np.linalg.eigh(L_inverse @ K @ L_inverse.T)
    T = (L_inverse.T @ vectors)[:, :modes]
    stiffness, n = stiffness[:modes], modes

    def across(values, row):  # (3, n) of one nonzero row
        found = np.zeros((3, n))
        found[row] = values
        return found

    def point(at):
        bend = np.array([f(at) for f in basis]) @ T
        slope = np.array([f.deriv()(at) for f in basis]) @ T / length
        return BodyPoint(np.array([at * length, 0.0, 0.0]), across(bend, 1), across(slope, 2))

    def stiffness_below(force, end=1.0):  # ∫N w'w' dx up to ξ = end, for N by ξ
        nodes, weights = np.polynomial.legendre.leggauss(modes + extra + 4)
        at = (nodes + 1) / 2 * end
        slopes = np.array([f.deriv()(at) for f in basis]).T @ T / length
        return length * end / 2 * slopes.T @ ((weights * force(at))[:, None] * slopes)

    K_s, K_x = np.zeros((3, n, n)), np.zeros((3, 3, n, n))
    K_s[0] = stiffness_below(lambda x: mass * (1 - x))
    K_x[0, 0] = stiffness_below(lambda x: mass * length * (1 - x**2) / 2)
    ends = {"root": 0.0, "mid": 0.5, "tip": 1.0}
    pulled = {label: np.array([stiffness_below(np.ones_like, at), *np.zeros((5, n, n))]) for label, at in ends.items()}
    zero, second = np.zeros((3, 3, n, n)), np.diag([mass * length**2 / 3, 0.0, 0.0])
    sums, moments, products = across((w * weight).sum(axis=1) @ T, 1), np.zeros((3, 3, n)), zero.copy()
    moments[0, 1] = (w * weight * xi).sum(axis=1) @ T * length
    products[1, 1] = np.eye(n)
    return Body(
        name=name, mass=mass, first_moment=np.array([mass * length / 2, 0.0, 0.0]), second_moment=second,
        S_bar=sums, I_bar=moments, S_bar_kl=products, J_spin=0.0, h_spin=np.zeros(n), S_spin=np.zeros((n, n)),
        stiffness=stiffness, damping=np.diag(2 * damping_ratio * np.sqrt(stiffness)),
        points=MappingProxyType({label: point(at) for label, at in ends.items()}), modal_transform=np.eye(n),
        length=length, stiffening=Stiffening(K_s, K_x, MappingProxyType(pulled), zero) if stiffening else None,
    )  # fmt: skip


ANGLES = {"link1": 0.4, "link2": 1.3}
TIP = float(np.cos(list(ANGLES.values())).sum()), float(np.sin(list(ANGLES.values())).sum())


def quintic(start, end, duration=1.0):
    """From rest to rest with zero acceleration at both ends, as an expression in t."""
    s = f"(t/{duration})"
    return f"{float(start)!r}+{float(end - start)!r}*(10*{s}**3-15*{s}**4+6*{s}**5)"


def arm_links(EI=30.0, **keys):
    return [ritz_link("link1", "simply-supported", EI=4 * EI, **keys), ritz_link("link2", "cantilever", EI=EI, **keys)]


def arm(links=None, **keys):
    """Two links, revolute joints O and A, the tip moving from rest to rest in a second."""
    path = {"name": "tip", "point": "link2.tip", "x": quintic(TIP[0], 0.4), "y": quintic(TIP[1], 1.5)}
    tables = {
        "joint": [revolute("O", "ground", "link1.root"), revolute("A", "link1.tip", "link2.root")],
        "trajectory": [path],
        "initial": {"angles": ANGLES},
    }
    return make_model(links or arm_links(), **(tables | keys))
