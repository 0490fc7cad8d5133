"""Piecewise polynomials along the axis of a beam, and their exact integrals. NumPy and SciPy only. SI units."""

from math import perm

import numpy as np
import scipy.sparse as sp
from numpy.polynomial.legendre import leggauss

from ...common.arrays import Array, Integers
from ...common.structs import struct

# Rows of a station: displacement and rotation of the cross section about x, y, z.
U_X, U_Y, U_Z, R_X, R_Y, R_Z = range(6)

# Points of an element: exact for products of two cubics.
GAUSS = 4


@struct
class Functions:
    """Continuous piecewise polynomials on e elements between neighboring nodes, d degrees of freedom on each."""

    nodes: Array  # (e + 1,) ascending, in m
    x: Array  # (size,) where the degrees of freedom are, ascending, in m
    element: Integers  # (e, d) degrees of freedom of each element, numbered along the axis
    powers: Array  # (p, d) coefficients, no unit, of the powers of X ∈ [0, 1] in each shape function
    slopes: Integers  # (d,) 1 of degrees of freedom that are derivatives by x, else 0

    @property
    def degree(self) -> int:
        """Degree of the polynomials."""
        return len(self.powers) - 1

    @property
    def lengths(self) -> Array:
        """Lengths (e,) of the elements, m."""
        return np.diff(self.nodes)

    def at(self, x: Array, derivative: int = 0) -> sp.csr_matrix:
        """The matrix (k, size), SI units, of values, or of the given `derivative` by x, at points x (k,), m."""
        cell = np.clip(np.searchsorted(self.nodes, x, side="right") - 1, 0, len(self.element) - 1)
        return self._within(cell, (x - self.nodes[cell]) / self.lengths[cell], derivative)

    def _within(self, cell: Integers, X: Array, derivative: int) -> sp.csr_matrix:
        """The same at X (k,) ∈ [0, 1] of the elements `cell` (k,)."""
        order = np.arange(derivative, len(self.powers))
        factor = np.array([perm(power, derivative) for power in order])
        shapes = (factor * X[:, None] ** (order - derivative)) @ self.powers[derivative:]
        shapes = shapes * self.lengths[cell, None] ** (self.slopes - derivative)
        row = np.repeat(np.arange(X.size), self.element.shape[1])
        return sp.csr_matrix((shapes.ravel(), (row, self.element[cell].ravel())), shape=(X.size, self.x.size))

    def root(self, weight: Array, derivative: int = 0) -> sp.csr_matrix:
        """B (4e, size) with BᵀB = ∫ weight f⁽ᵈ⁾ g⁽ᵈ⁾ dx of shape functions, d = `derivative`.

        x is in m, weight (e,) in any unit.
        """
        points, weights = leggauss(GAUSS)
        elements = len(self.element)
        values = self._within(np.repeat(np.arange(elements), GAUSS), np.tile(0.5 * (points + 1), elements), derivative)
        scale = np.sqrt((weight * self.lengths)[:, None] * (0.5 * weights))
        return sp.diags(scale.ravel()) @ values


def gram(B: sp.csr_matrix) -> sp.csr_matrix:
    """BᵀB (m, m) of B (4e, m), any unit, made of `Functions.root`.

    The sum goes Gauss point by Gauss point: contributions of neighboring elements are then rounded alike and cancel in
    rigid motions.
    """
    return sum(B[g::GAUSS].T @ B[g::GAUSS] for g in range(GAUSS)).tocsr()


def lagrange(nodes: Array, degree: int) -> Functions:
    """Polynomials of degree 2 or 3 by values at Gauss–Lobatto points of elements between `nodes` (e + 1,), m."""
    inner = {2: [0.0], 3: [-np.sqrt(0.2), np.sqrt(0.2)]}[degree]
    X = 0.5 * (1.0 + np.array([-1.0, *inner, 1.0]))
    element = degree * np.arange(nodes.size - 1)[:, None] + np.arange(degree + 1)
    x = np.append(nodes[:-1, None] + np.diff(nodes)[:, None] * X[:-1], nodes[-1])
    return Functions(nodes, x, element, np.linalg.inv(X[:, None] ** np.arange(degree + 1)), 0 * element[0])


def hermite(nodes: Array) -> Functions:
    """Cubic Hermite polynomials, by value and slope at each of `nodes` (e + 1,), m."""
    powers = np.array([[1, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1]], dtype=np.float64).T
    element = 2 * np.arange(nodes.size - 1)[:, None] + np.arange(4)
    return Functions(nodes, np.repeat(nodes, 2), element, powers, np.array([0, 1, 0, 1]))
