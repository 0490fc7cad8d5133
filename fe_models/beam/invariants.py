"""Inertia shape integrals and geometric stiffness of a beam, from its fields at the stations. SI units.

The stations are the Gauss–Lobatto points of cubic elements, so values at stations *are* the degrees of freedom of
the fields and every integral is a product with a mass matrix, without error.

Geometric stiffness is that of docs/theory.md, eq. 48, with rotations Th = (φ, θ_y, θ_z) and strains Γ.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import scipy.sparse as sp
from numpy.polynomial.legendre import leggauss

from ...common.arrays import Array
from ..link_records.link import BeamLink
from ..modal_body.lumped_masses import of_turning
from ..modal_body.parts import LEVI_CIVITA, Invariants
from ..modal_body.unit_loads import MOTIONS, inertia_wrenches
from .line import R_X, R_Y, R_Z, U_X, U_Y, U_Z, Functions, gram
from .sections import cellwise


def shape_integrals(link: BeamLink, stations: Functions, fields: Array) -> Invariants:
    """Inertia shape integrals (docs/theory.md) over the volume; `fields` (6, k, n): U_X … R_Z, m and rad, of n modes.

    With displacement (u, v, w) and rotation (φ, θ_y, θ_z) of the section, a point (x, y, z) moves by Φ0 + y Φy + z Φz,
    Φ0 = (u, v, w), Φy = (−θ_z, 0, φ), Φz = (θ_y, −φ, 0); principal axes leave ∫y = ∫z = ∫yz = 0.

    Euler–Bernoulli links are a line of mass on the axis, ∫y² = ∫z² = 0, with the inertia `J_spin` … about it.
    `S_bar_kl[2, 2]` includes `S_spin`: the sum of all [k, k] is then the modal mass.
    """
    line_mass = link.model.theory == "euler-bernoulli"
    zero = np.zeros_like(fields[U_X])
    Phi = [
        fields[[U_X, U_Y, U_Z]],
        np.stack([-fields[R_Z], zero, fields[R_X]]),
        np.stack([fields[R_Y], -fields[R_X], zero]),
    ]
    # Position likewise: x e1 + y e2 + z e3, per unit of (1, y, z).
    one = np.ones_like(stations.x)
    position = np.zeros((3, 3, stations.x.size))
    position[0, 0], position[1, 1], position[2, 2] = stations.x, one, one
    moments = ["area"] if line_mass else ["area", "I_yy", "I_zz"]
    weights = [weighted(link, stations, moment) for moment in moments]

    n = fields.shape[2]
    S_bar = np.einsum("i,lin->ln", weights[0] @ one, Phi[0])
    second_moment, I_bar, S_bar_kl = np.zeros((3, 3)), np.zeros((3, 3, n)), np.zeros((3, 3, n, n))
    for W, x, shape in zip(weights, position, Phi, strict=False):
        W_x, W_shape = np.stack([W @ row for row in x]), np.stack([W @ component for component in shape])
        second_moment += np.einsum("ki,li->kl", x, W_x)
        I_bar += np.einsum("ki,lin->kln", W_x, shape)
        S_bar_kl += np.einsum("kim,lin->klmn", shape, W_shape)
    J_spin, h_spin, S_spin = 0.0, np.zeros(n), np.zeros((n, n))
    if line_mass:
        spin, twist = weighted(link, stations, "I_p"), fields[R_X]
        J_spin, h_spin, S_spin = float(one @ (spin @ one)), (spin @ one) @ twist, twist.T @ spin @ twist
        S_bar_kl[2, 2] += S_spin
    first = float(stations.x @ (weights[0] @ one))
    symmetric = 0.5 * (S_bar_kl + S_bar_kl.transpose(1, 0, 3, 2))
    return Invariants(
        mass=float(one @ (weights[0] @ one)),
        first_moment=np.array([first, 0.0, 0.0]),
        second_moment=second_moment,
        S_bar=S_bar,
        I_bar=I_bar,
        S_bar_kl=symmetric,
        J_spin=J_spin,
        h_spin=h_spin,
        S_spin=0.5 * (S_spin + S_spin.T),
    )


def weighted(link: BeamLink, stations: Functions, moment: str) -> sp.csr_matrix:
    """Matrix (k, k), SI units, of ∫ρ·moment·a b dx for fields a, b at k stations; `moment`: a name in `Section`."""
    return gram(stations.root(link.material.density * cellwise(link, stations.nodes, moment)))


Rotary = Mapping[str, Sequence[float]]
ROTARY: Rotary = {"I_yy": (1.0, 0.0, 1.0), "I_zz": (1.0, 1.0, 0.0)}
"""Second moments of a section, and about which axes they make it inert."""

POINTS = 5  # Gauss points of an element: exact, since of cubics no product is of a degree above 8


def geometric_stiffness(link: BeamLink, stations: Functions, fields: Array, interfaces: dict[str, float]) -> Array:
    """Geometric stiffness (l, n, n), rad²/s² per unit of load, of the `unit_loads` under the reference condition.

    `fields` (6, k, n): U_X … R_Z, m and rad, of n modes at k stations; every interface, at its m from the root, is a
    vertex of their mesh. The spin inertia of Euler–Bernoulli links has no second-order motion.
    """
    x, weight, values, slopes = _at_gauss_points(stations, fields)
    forces = section_forces(link, x, interfaces, ROTARY if link.model.theory == "timoshenko" else {})
    pairs = zip(forces * weight, _products(values, slopes), strict=True)
    total = np.sum([np.tensordot(force, products, axes=1) for force, products in pairs], axis=0)
    matrices = 0.5 * (total + total.transpose(0, 2, 1))
    if link.model.theory == "timoshenko":
        for k, moment in enumerate(ROTARY, start=1):
            W = weighted(link, stations, moment)
            products = np.array([[a.T @ (W @ b) for b in fields[R_X:]] for a in fields[R_X:]])
            matrices[3:MOTIONS] += of_turning(np.diag(np.eye(3)[k]), products)
    return matrices


def _at_gauss_points(stations: Functions, fields: Array) -> tuple[Array, Array, Array, Array]:
    """Points x (g,) m with their weights (g,) m, and fields (6, g, n) there with their derivatives by x."""
    nodes, weights = leggauss(POINTS)
    lengths = stations.lengths[:, None]
    at = (stations.nodes[:-1, None] + lengths * 0.5 * (nodes + 1)).ravel()
    values, slopes = (np.array([stations.at(at, order) @ field for field in fields]) for order in (0, 1))
    return at, (0.5 * lengths * weights).ravel(), values, slopes


def _products(values: Array, slopes: Array) -> Array:
    """(6, g, n, n) what n_x … m_z do work on: see the module."""
    Th, rate, Gamma = values[R_X:], slopes[R_X:], slopes[:R_X].copy()
    turned = np.stack([np.zeros_like(Th[0]), Th[2], -Th[1]])  # Th × e1
    Gamma[1:] -= turned[1:]
    on_forces, on_moments = (
        -np.einsum("cab,agm,bgn->cgmn", LEVI_CIVITA, Th, other, optimize=True) for other in (turned + 2 * Gamma, rate)
    )
    return np.concatenate([on_forces, on_moments])


def section_forces(link: BeamLink, x: Array, interfaces: Mapping[str, float], rotary: Rotary) -> Array:
    """Force, N, and moment, N·m (6, l, g), at x (g,), m, by each of l unit loads on the straight link.

    The link is in its reference condition. `interfaces`: m from the root; loads at the tip act on the section there,
    too. `rotary`: `ROTARY`, {} without rotary inertia.
    """
    of_inertia, length, units = _of_inertia(link, np.append(x, 0.0), rotary), link.geometry.length, np.eye(6)[..., None]
    forces, at_root = [of_inertia[..., :-1]], [of_inertia[..., -1:]]
    for position in interfaces.values():
        beyond = np.where((x < position) | (position == length), 1.0, 0.0)
        forces.append(of_load(units, position - x) * beyond)
        at_root.append(of_load(units, np.array([position])))
    total = np.concatenate(forces, axis=1)
    return total if link.reference.holds_root else total + of_tip_support(link, x, np.concatenate(at_root, axis=1))


def of_load(load: Array, arm: Array) -> Array:
    """Force, N, and moment, N·m (6, …, g), of such a `load` (6, …, 1 or g) that acts `arm` (g,), m, further along x."""
    force, moment = load[:3] * np.ones_like(arm), load[3:]
    return np.concatenate([force, moment + _lever(force * arm)])


def _lever(force: Array) -> Array:
    """e1 × f of f (3, …)."""
    return np.stack([np.zeros_like(force[0]), -force[2], force[1]])


def of_tip_support(link: BeamLink, x: Array, at_root: Array) -> Array:
    """Force, N, and moment, N·m (6, …, g), at x (g,), m: a tip support cancels the moments `at_root` (6, …, 1 or g)."""
    L, none = link.geometry.length, np.zeros_like(at_root[0])
    return of_load(np.stack([none, -at_root[5] / L, at_root[4] / L, none, none, none]), L - x)


def _of_inertia(link: BeamLink, x: Array, rotary: Rotary) -> Array:
    """(6, `MOTIONS`, g) of d'Alembert's loads on the link fixed at its root.

    Sections at s bear forces ρA (a + b s), of small bodies at 0 and 1 m, and, with rotary inertia, moments.
    """
    e1, nothing = np.eye(3)[:1], np.zeros(1)
    M = [_beyond(link, x, "area", power) for power in range(3)]
    a, b = (inertia_wrenches(place, np.ones(1), np.zeros((1, 3)))[0, :3, :, None] for place in (0 * e1, e1))
    b = b - a
    n = a * M[0] + b * M[1]
    m = _lever(a * M[1] + b * M[2] - x * n)
    for moment, inertia in rotary.items():
        wrenches = inertia_wrenches(0 * e1, nothing, np.array([inertia]))
        m += wrenches[0, 3:, :, None] * _beyond(link, x, moment, 0)
    return np.concatenate([n, m])


def _beyond(link: BeamLink, x: Array, moment: str, power: int) -> Array:
    """∫_x^L ρ·moment·sᵖ ds for each x (g,)."""
    total = np.zeros_like(x)
    points = link.geometry.breakpoints
    for start, end, section in zip(points[:-1], points[1:], link.sections, strict=True):
        lower = np.clip(x, start, end)
        per_length = link.material.density * getattr(section, moment)
        total += per_length * (end ** (power + 1) - lower ** (power + 1)) / (power + 1)
    return total
