"""The eigensolver of links: against closed forms, and against LAPACK for all modes of a small solid."""

import os
import weakref

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.linalg import eigh
from solids import body_of, mass_matrix, model_of, write_solid

from ffrobot.common.errors import SolveError
from ffrobot.common.locks import this_process
from ffrobot.fe_models.modal_body.krylov_schur import KrylovSchur
from ffrobot.fe_models.solid import supports
from ffrobot.fe_models.solid.elasticity import stiffness_matrix
from ffrobot.fe_models.solid.supports import Factors


class Diagonal:
    """A matrix whose modes are known: F of ω², or M."""

    def __init__(self, entries):
        self.entries = entries[:, None]

    def __matmul__(self, U):
        return self.entries * U


def search(flexibility, mass, solver="slepc"):
    rank = np.count_nonzero(flexibility)
    return KrylovSchur(Diagonal(flexibility), Diagonal(mass), mass.size, rank, solver=solver)


both = pytest.mark.parametrize("solver", ["slepc", "block-lanczos"])


def others(count, above):
    return np.random.default_rng(1).uniform(above, 1e6, count)


@both
@pytest.mark.parametrize(
    ("omega2", "count"),
    [
        pytest.param(others(300, 1.0), 20, id="simple"),
        pytest.param(others(300, 1.0), 1, id="one"),
        pytest.param(np.r_[np.ones(3), np.full(2, 2.0), others(295, 3.0)], 5, id="multiple"),
        pytest.param(np.r_[np.full(30, 5.0), np.full(3, 7.0), others(267, 8.0)], 35, id="many alike"),
        pytest.param(np.repeat([1.0, 2.0, 3.0], [30, 30, 240]), 60, id="hardly any different"),
        pytest.param(np.r_[1 + 1e-7 * np.arange(12), others(288, 2.0)], 12, id="cluster"),
        pytest.param(np.logspace(0, 9, 240), 240, id="all"),
        pytest.param(np.ones(30), 30, id="all alike"),
        pytest.param(np.r_[1.0, 2.0, 3.0], 2, id="few"),
    ],
)
def test_lowest_of_a_diagonal_matrix(omega2, count, solver):
    mass = np.linspace(1.0, 7.0, omega2.size)
    X = search(1 / (mass * omega2), mass, solver).lowest(count)
    np.testing.assert_allclose(X.T @ (mass[:, None] * X), np.eye(count), rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.sum((mass * omega2)[:, None] * X**2, axis=0), np.sort(omega2)[:count], rtol=1e-12)


@both
def test_a_search_goes_on_where_it_ended(solver):
    omega2 = others(300, 1.0)
    found = search(1 / omega2, np.ones(300), solver)
    assert found.lowest(4).shape == (300, 4)
    again = np.sum(omega2[:, None] * found.lowest(25) ** 2, axis=0)
    np.testing.assert_allclose(again, np.sort(omega2)[:25], rtol=1e-12)
    found, at = None, weakref.ref(found._flexibility)
    assert at() is None  # PETSc keeps what Python alone lets go


@both
def test_more_modes_than_there_are(solver):
    omega2 = others(60, 1.0)
    held = np.where(np.arange(60) < 6, 0.0, 1 / omega2)  # as supports do: motions that no load brings about
    assert search(held, np.ones(60), solver).lowest(54).shape == (60, 54)
    with pytest.raises(SolveError, match="54 of 55 modes"):
        search(held, np.ones(60), solver).lowest(55)


# A square section bends in both planes alike, and has double local modes.
SQUARE = {"height": 0.1, "width": 0.1, "condition": "cantilever", "coupling": "rigid", "family": "all", "count": 20}


@pytest.mark.parametrize(
    "part",
    [
        pytest.param({"cell": "hexahedron", "order": 2, "divisions": (12, 2, 2)}, id="hexahedra"),
        pytest.param(
            {"cell": "tetrahedron", "order": 2, "divisions": (12, 2, 2)}, id="tetrahedra", marks=pytest.mark.nightly
        ),
    ],
)
def test_modes_are_those_of_lapack_and_none_is_missed(tmp_path, part):
    path = write_solid(tmp_path, **SQUARE, **part)
    body = body_of(path)
    K, M = clamped_at_root(path)
    theta = eigh(M.toarray(), K.toarray(), eigvals_only=True)[:-21:-1]
    np.testing.assert_allclose((2 * np.pi * body.frequency) ** 2, 1 / theta, rtol=1e-9)


def test_residuals(tmp_path, monkeypatch):
    """‖F M x − x/ω²‖ of what the search finds, by the factors of the clamped part itself."""
    path = write_solid(tmp_path, **SQUARE, cell="hexahedron", order=2, divisions=(12, 2, 2))
    K, M = clamped_at_root(path)
    found, lowest = [], KrylovSchur.candidates
    monkeypatch.setattr(KrylovSchur, "candidates", lambda self, n: found.append(lowest(self, n)) or found[-1])
    body_of(path)
    free = np.flatnonzero(np.any(found[-1] != 0, axis=1))
    X = found[-1][free]
    omega2 = np.sum(X * (K @ X), axis=0)
    residual = (sp.linalg.splu(K.tocsc()).solve(M @ X) * omega2 - X)[:, :20]
    size = np.sqrt(np.sum(residual * (M @ residual), axis=0))
    # K is assembled: its rounding alone moves shapes by its condition number times 1e-16.
    assert size.max() < 1e-10


def clamped_at_root(path):
    """K and M of the displacements of all nodes but those at the root."""
    model, _ = model_of(path)
    free = np.flatnonzero(np.repeat(model.x[:, 0] > 1e-9, 3))
    indptr, columns, values = stiffness_matrix(model).convert("aij").getValuesCSR()
    upper = sp.triu(sp.csr_matrix((values, columns, indptr)))
    K = (upper + sp.triu(upper, 1).T).tocsr()
    return (A[free][:, free] for A in (K, mass_matrix(model)))


def test_factors_in_files(tmp_path, monkeypatch, cache):
    """Large parts keep them there: MUMPS takes the setting, modes stay, and no file does, not even of a killed run."""
    path = write_solid(tmp_path, divisions=(8, 1, 1), count=3)
    in_memory = body_of(path)
    monkeypatch.setattr(supports, "SHARE", 0)
    killed = cache / "ffrobot" / "factors" / f"{this_process().replace(str(os.getpid()), str(2**22 + 1))}.x"  # no pid
    killed.mkdir(parents=True)
    (killed / "mumps").write_bytes(b"left")
    seen, solve = [], Factors.solve

    def watched(self, loads):
        size = sum(file.stat().st_size for file in killed.parent.glob(f"{this_process()}.*/*"))
        seen.append((self.matrix.getMumpsIcntl(22), size))
        return solve(self, loads)

    monkeypatch.setattr(Factors, "solve", watched)
    np.testing.assert_allclose(body_of(path).frequency, in_memory.frequency, rtol=1e-11)
    assert all(setting == 1 and size > 0 for setting, size in seen)
    assert list(killed.parent.iterdir()) == []
