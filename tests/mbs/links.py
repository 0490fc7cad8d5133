"""Flexible links from polynomials (Ritz), without stage 1: bending in the plane, as soft as one likes."""

from types import MappingProxyType

import mpmath
import numpy as np
from bodies_by_invariants import GeometricStiffening, PlanarBody, PlanarPoint
from mechanisms import make_model, revolute
from numpy.polynomial import Legendre, Polynomial

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

    def point(at):
        bend = np.array([f(at) for f in basis]) @ T
        slope = np.array([f.deriv()(at) for f in basis]) @ T / length
        return PlanarPoint(np.array([at * length, 0.0]), np.array([np.zeros(n), bend]), slope)

    w_1 = np.array([f.deriv()(xi) for f in basis]).T @ T / length

    def stiffness_of(force):  # ∫N w'w' dx for N by ξ
        return length / mass * w_1.T @ ((weight * force)[:, None] * w_1)

    def point_stiffness(at):  # of a force at ξ = at
        nodes, weights = np.polynomial.legendre.leggauss(modes + extra + 4)
        slopes = np.array([f.deriv()((nodes + 1) / 2 * at) for f in basis]).T @ T / length
        return length * at / 2 * slopes.T @ (weights[:, None] * slopes)

    zero = np.zeros((n, n))
    axial = GeometricStiffening(
        K_omega=stiffness_of(mass * length * (1 - xi**2) / 2),
        K_s=np.array([stiffness_of(mass * (1 - xi)), zero]),
        K_h=zero,
        K_points={
            "root": np.zeros((3, n, n)),
            "mid": np.array([point_stiffness(0.5), zero, zero]),
            "tip": np.array([stiffness_of(np.ones_like(xi)), zero, zero]),
        },
        rotary=zero,
    )
    return PlanarBody(
        name=name,
        mass=mass,
        inertia=mass * length**2 / 3,
        first_moment=np.array([mass * length / 2, 0.0]),
        stiffness=stiffness,
        damping=np.diag(2 * damping_ratio * np.sqrt(stiffness)),
        S_bar=np.array([np.zeros(n), (w * weight).sum(axis=1) @ T]),
        h=(w * weight * xi).sum(axis=1) @ T * length,
        j=np.zeros(n),
        S_tilde=zero,
        m_xy=np.eye(n),
        points=MappingProxyType({"root": point(0.0), "mid": point(0.5), "tip": point(1.0)}),
        modal_transform=np.eye(n),
        length=length,
        stiffening=axial if stiffening else None,
    )


def eigenmode_link(name, condition, modes, length=1.0, mass=1.0, EI=30.0):
    """The same beam in its exact modes, any number of them.

    Integrals and slopes of the shapes: Blevins, Formulas for Natural Frequency and Mode Shape, table 8-1.
    """
    k = np.arange(1, modes + 1)
    sign, one = (-1.0) ** (k + 1), np.ones(modes)
    if condition == "simply-supported":
        beta = k * np.pi
        ends, slopes = (0 * one, 0 * one), (np.sqrt(2) * beta, -np.sqrt(2) * beta * sign)
        mean, moment = np.sqrt(2) * (1 + sign) / beta, np.sqrt(2) * sign / beta
    else:
        beta = np.array(
            [float(mpmath.findroot(lambda x: mpmath.cos(x) + mpmath.sech(x), (n - 0.5) * np.pi)) for n in k]
        )
        sigma = np.array([float((mpmath.cosh(x) + mpmath.cos(x)) / (mpmath.sinh(x) + mpmath.sin(x))) for x in beta])
        ends, slopes = (0 * one, 2 * sign), (0 * one, 2 * sign * sigma * beta)
        mean, moment = 2 * sigma / beta, 2 / beta**2
    zero, root = np.zeros((modes, modes)), np.sqrt(mass)
    points = {
        label: PlanarPoint(np.array([at * length, 0.0]), np.array([0 * one, end / root]), slope / (length * root))
        for label, at, end, slope in zip(("root", "tip"), (0.0, 1.0), ends, slopes, strict=True)
    }
    return PlanarBody(
        name=name, mass=mass, inertia=mass * length**2 / 3, first_moment=np.array([mass * length / 2, 0.0]),
        stiffness=EI / (mass * length**3) * beta**4, damping=zero, S_bar=root * np.array([0 * one, mean]),
        h=root * length * moment, j=0 * one, S_tilde=zero, m_xy=np.eye(modes), points=MappingProxyType(points),
        modal_transform=np.eye(modes), length=length, stiffening=None,
    )  # fmt: skip


ANGLES = {"link1": 0.4, "link2": 1.3}
TIP = float(np.cos(list(ANGLES.values())).sum()), float(np.sin(list(ANGLES.values())).sum())


def quintic(start, end, duration=1.0):
    """From rest to rest with zero acceleration at both ends, as an expression in t."""
    s = f"(t/{duration})"
    return f"{float(start)!r}+{float(end - start)!r}*(10*{s}**3-15*{s}**4+6*{s}**5)"


def arm_links(EI=30.0, **keys):
    return [
        ritz_link("link1", "simply-supported", EI=4 * EI, **keys),
        ritz_link("link2", "cantilever", EI=EI, **keys),
    ]


def arm(links=None, **keys):
    """Two links, revolute joints O and A, the tip moving from rest to rest in a second."""
    path = {"name": "tip", "point": "link2.tip", "x": quintic(TIP[0], 0.4), "y": quintic(TIP[1], 1.5)}
    tables = {
        "joint": [revolute("O", "ground", "link1.root"), revolute("A", "link1.tip", "link2.root")],
        "trajectory": [path],
        "initial": {"angles": ANGLES},
    }
    return make_model(links or arm_links(), **(tables | keys))
