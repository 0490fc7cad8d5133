"""Solid links for the tests, and what is known of them without the program's own eigensolver."""

import numpy as np
import scipy.sparse as sp
import tomli_w
from beam_links import link_keys, rectangle
from scipy.linalg import eigh

from ffrobot.fe_models.link_file import read_link
from ffrobot.fe_models.solid.elasticity import material_map, solid_model, stiffness_matrix
from ffrobot.fe_models.solid.link import solid_modal_body
from ffrobot.mesh.solid_mesh import solid_mesh


def write_solid(
    folder,
    E=2.068427e11,
    rho=7850.0,
    length=1.0,
    height=0.015,
    width=0.025,
    cell="tetrahedron",
    order=3,
    divisions=(36, 1, 1),
    condition="simply-supported",
    coupling=None,
    more="",
    material=None,
    **modes,
):
    """Write a link file, the paper's link as a solid unless told otherwise, and return its path."""
    mesh = f'[mesh]\ncell = "{cell}"\norder = {order}\ndivisions = {list(divisions)}\n'
    modes = {"count": 10, "family": "in-plane-bending", "attachment_modes": False} | modes
    keys = {"E": E, "nu": 0.3, "rho": rho, "condition": condition, "name": "link1", "modes": modes}
    link = link_keys("solid", length, rectangle(height, width), {}, **keys)
    del link["mesh"]
    link["material"] |= material or {}
    link["reference"] |= {"coupling": coupling} if coupling else {}
    path = folder / "link1.toml"
    path.write_text(tomli_w.dumps(link) + mesh + more)
    return path


def body_of(path):
    return solid_modal_body(read_link(path), path, lambda _: None)


def model_of(path):
    """The free solid and its mesh."""
    link = read_link(path)
    solid = solid_mesh(link.part(path))
    return solid_model(solid.mesh, link.mesh.order, material_map(solid.mesh, link.material)), solid


def dense(model):
    """K and M of the free solid."""
    K = stiffness_matrix(model)
    K.setOption(K.Option.IGNORE_LOWER_TRIANGULAR, False)
    indptr, columns, values = K.convert("aij").getValuesCSR()
    upper = np.zeros((3 * model.owned, 3 * model.owned))
    np.add.at(upper, (np.repeat(np.arange(len(indptr) - 1), np.diff(indptr)), columns), values)
    return np.triu(upper) + np.triu(upper, 1).T, mass_matrix(model).toarray()


def mass_matrix(model):
    """M of the free solid, sparse."""
    indptr, columns, values = model.mass.matrix.getValuesCSR()
    return sp.kron(sp.csr_matrix((values, columns, indptr)), sp.eye(3), format="csr")


def elastic_frequencies(K, M):
    """ω of a free body but for its six rigid motions, ascending."""
    return np.sqrt(eigh(K, M, eigvals_only=True)[6:])


def frame_and_modes(body):
    """K and M in the coordinates (translation, rotation, p) of small motions, from the invariants alone."""
    n = body.mode_count
    eps = np.array([[[(a - b) * (b - c) * (c - a) / 2 for c in range(3)] for b in range(3)] for a in range(3)])
    M = np.zeros((6 + n, 6 + n))
    M[:3, :3] = body.mass * np.eye(3)
    M[:3, 3:6] = np.einsum("kal,l->ka", eps, body.first_moment)  # e_k · (e_a × s0)
    M[3:6, 3:6] = np.trace(body.second_moment) * np.eye(3) - body.second_moment
    M[:3, 6:] = body.S_bar
    M[3:6, 6:] = np.einsum("akl,kln->an", eps, body.I_bar)
    M[6:, 6:] = body.modal_mass
    M = np.triu(M) + np.triu(M, 1).T
    K = np.zeros_like(M)
    K[6:, 6:] = body.stiffness
    return K, M
