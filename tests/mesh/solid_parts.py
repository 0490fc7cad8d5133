"""Sections, and what is integrated over parts to compare with the drawing."""

import basix
import numpy as np

from ffrobot.mesh.cells import jacobians, reference_nodes
from ffrobot.mesh.part_mesh import facet_geometry
from ffrobot.mesh.records import RectangleSection

VOLUME = 0.015 * 0.025  # m³, of `bar`


def bar(occ, begin=0, end=1000):
    """A bar of the paper's section, in millimetres."""
    occ.addBox(begin, -7.5, -12.5, end - begin, 15, 25)


def two_bars(occ):
    """The same bar in two parts that touch."""
    bar(occ, 0, 400)
    bar(occ, 400, 1000)


def rectangle(height=0.015, width=0.025, **more):
    return RectangleSection(shape="rectangle", height=height, width=width, **more)


def shape_functions(cell, degree, X):
    """(q, v) values at `X` (q, 3) of the polynomials that are 1 at one of the reference nodes and 0 at the others."""
    powers = np.array(list(np.ndindex((degree + 1,) * 3)))
    powers = powers if cell == "hexahedron" else powers[powers.sum(axis=1) <= degree]

    def monomials(points):
        return np.prod(points[:, None, :] ** powers, axis=2)

    return np.linalg.solve(monomials(reference_nodes(cell, degree)).T, monomials(X).T).T


def integrate(part, function=lambda x: 1.0):
    """∫ function dV over a part, function of points (c, q, 3), by basix's rule on curved cells."""
    X, weights = basix.make_quadrature(getattr(basix.CellType, part.cell), 6)
    nodes = part.points[part.cells]
    scale = np.abs(np.linalg.det(jacobians(nodes, part.cell, part.degree, X)))
    points = np.einsum("qv,cvi->cqi", shape_functions(part.cell, part.degree, X), nodes)
    return float(np.sum(function(points) * scale * weights))


def face_area(part, name):
    _, _, area = facet_geometry(part.points, part.facets[part.facet_tag == part.faces[name]])
    return float(area.sum())
