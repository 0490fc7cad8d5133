"""Supports of a solid, and its flexibility F under these: displacements u = F f by loads f (docs/theory.md, eq. 8).

Only sparse symmetric positive definite matrices are factorized, and B never fills one. Factors are MUMPS' Cholesky
factors of an upper triangle, in memory or, of large ones, in files.
"""

import os
import shutil
import tempfile
import weakref
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from ...common.arrays import Array, Integers, in_parts
from ...common.cache import cache_folder
from ...common.errors import SolveError
from ...common.locks import is_running, this_process
from ...common.structs import struct
from .elasticity import SolidModel, stiffness_matrix
from .stress import internal_forces

# Share of the free memory that factors may take: larger ones are kept in files, which takes a quarter of it. Reading
# those for each vector that SLEPc solves for took a third of the time of 377 000 unknowns.
SHARE = 0.5
# Bytes of the factors of n unknowns by n^(4/3), as nested dissection has: 0.88, 4.5 and 16.6 GB at 112, 377 and 1026
# thousand.
BYTES = 170.0
_ICNTL_OUT_OF_CORE = 22
# Columns solved for at once, as many as MUMPS takes: it reads the factors once for them.
COLUMNS = 32


class Factors:
    """Cholesky factors of K by MUMPS. Vectors hold this rank's own degrees of freedom.

    K is an upper triangle, which is destroyed. Raises `SolveError` where it is not positive definite in double
    precision, or memory or disk does not suffice.
    """

    _remove: Callable[[], object] | None = None

    def __init__(self, K: PETSc.Mat) -> None:
        solver = PETSc.KSP().create(K.comm)
        solver.setOperators(K)
        solver.setType(PETSc.KSP.Type.PREONLY)
        pc = solver.getPC()
        pc.setType(PETSc.PC.Type.CHOLESKY)
        pc.setFactorSolverType("mumps")
        pc.setFactorSetUpSolverType()
        self.matrix, self._sizes = pc.getFactorMatrix(), K.getSizes()[0]
        folder = None if _fits(K) else _new_folder()
        if folder:
            os.environ["MUMPS_OOC_TMPDIR"] = str(folder)
            self.matrix.setMumpsIcntl(_ICNTL_OUT_OF_CORE, 1)
            self._remove = weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        try:
            solver.setUp()
        except PETSc.Error:
            raise SolveError(
                f"stiffness matrix of size {K.getSize()[0]}: it is not positive definite in double precision, or"
                f" memory{f' or space in {folder}' if folder else ''} does not suffice for its factors;"
                " check material and mesh, or use larger elements"
            ) from None
        for used in (solver, pc, K):  # only the factors stay; PETSc would keep what Python alone lets go
            used.destroy()

    def solve(self, loads: Array) -> Array:
        """K⁻¹ f (own, k), m, for `loads` f (own, k), N; collective."""
        result = np.empty_like(loads)
        for part in in_parts(loads.shape[1], COLUMNS):
            f = np.asfortranarray(loads[:, part])
            u = np.empty_like(f)
            size = self._sizes, (None, f.shape[1])
            F, U = (PETSc.Mat().createDense(size, array=block, comm=self.matrix.comm) for block in (f, u))
            F.assemble()
            U.assemble()
            self.matrix.matSolve(F, U)
            F.destroy()
            U.destroy()
            result[:, part] = u
        return result

    def release(self) -> None:
        """Free memory and files; collective."""
        self.matrix.destroy()
        if self._remove:
            self._remove()


def _fits(K: PETSc.Mat) -> bool:
    """Whether memory has room for the factors, by the first process; collective."""
    free = 8e9  # where nothing tells
    with suppress(OSError, StopIteration):
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        free = 1024.0 * int(next(line for line in lines if line.startswith("MemAvailable")).split()[1])
    fits: bool = K.comm.tompi4py().bcast(BYTES * K.getSize()[0] ** (4 / 3) < SHARE * free)
    return fits


def _new_folder() -> Path | None:
    """For this process alone, in the user's cache, which is on a disk; None where nothing can be written there.

    Those of processes that were killed are removed.
    """
    with suppress(OSError):
        shared = cache_folder("factors")
        for folder in shared.iterdir():
            if not is_running(folder.name.rpartition(".")[0]):
                shutil.rmtree(folder, ignore_errors=True)
        return Path(tempfile.mkdtemp(prefix=f"{this_process()}.", dir=shared))
    return None


@struct
class RigidFace:
    """A face that moves as a plate; SI units."""

    name: str  # of the interface
    nodes: Integers  # (f,) its nodes among this rank's own
    centroid: Array  # (3,) in m
    free: Sequence[int]  # which of its translations (0 … 2) and rotations (3 … 5) no support fixes


class Flexibility:
    """Flexibility F of the supported solid, `F @ loads`. Vectors hold this rank's own degrees of freedom.

    `faces` are the rigid ones; B (6, 3 owned) rows of the mean supports, SI, None where rigid faces support the body.
    Raises `SolveError` where the supported stiffness is not positive definite.
    """

    def __init__(self, model: SolidModel, faces: Sequence[RigidFace], B: Array | None) -> None:
        self.model, self.faces = model, faces
        # Rigid motions of all nodes, about the origin.
        self.R = _plate(model.x, np.zeros(3)).reshape(-1, 6)
        self.B = B
        clamped = np.zeros((model.owned, 3), dtype=bool)
        columns = [np.empty((3 * model.owned, 0))]  # of each face's nodes under its free unit motions, all else at rest
        for face in faces:
            clamped[face.nodes] = True
            motion = np.zeros((model.owned, 3, len(face.free)))
            motion[face.nodes] = _plate(model.x[face.nodes], face.centroid)[:, :, list(face.free)]
            columns.append(motion.reshape(3 * model.owned, -1))
        self.clamped, T = clamped.reshape(-1), np.concatenate(columns, axis=1)
        KT = internal_forces(model, T) if T.shape[1] else T
        if faces:
            fixed = np.flatnonzero(model.with_ghosts(self.clamped[:, None].astype(np.float64))[::3, 0])
            K = stiffness_matrix(model, [fem.dirichletbc(np.zeros(3), fixed.astype(np.int32), model.V)])
        else:
            K = stiffness_matrix(model)
            _add_springs(model, K, self.R)
        self._factor = Factors(K)
        self._condense(T, KT)
        if B is not None:
            self._BR_inverse = np.linalg.inv(model.total(B @ self.R))

    def _condense(self, T: Array, KT: Array) -> None:
        """W and S⁻¹; where only mean supports hold the body, springs on the first face make S positive definite."""
        self.W = T
        self._S_inverse: Array = np.empty((0, 0))
        if not T.shape[1]:
            return
        inside = np.where(self.clamped[:, None], 0.0, KT)
        self.W = T - self._factor.solve(inside)
        S = self.model.total(KT.T @ self.W)
        S = 0.5 * (S + S.T)
        if self.B is not None:
            S[:6, :6] += np.diag(np.diag(S)[:6])
        self._S_inverse = np.linalg.inv(S)

    def __matmul__(self, loads: Array) -> Array:
        """F f (3 owned, k), m, of loads f (3 owned, k), N; collective."""
        f = self.supported(loads)
        U = self._factor.solve(np.where(self.clamped[:, None], 0.0, f))
        if self.W.shape[1]:
            U += self.W @ (self._S_inverse @ self.model.total(self.W.T @ f))
        return U if self.B is None else U - self.R @ (self._BR_inverse @ self.model.total(self.B @ U))

    @property
    def rank(self) -> int:
        """Number of independent displacements that the supports allow."""
        total = 3 * self.model.V.dofmap.index_map.size_global - self.model.comm.allreduce(int(self.clamped.sum()))
        return int(total + self.W.shape[1] - (0 if self.B is None else len(self.B)))

    def release(self) -> None:
        """Free the factors, after which nothing can be solved; collective."""
        self._factor.release()

    def reactions(self, loads: Array) -> Array:
        """Reactions (6, k), N and N·m, along rows of B under `loads` (3 owned, k), N; none of rigid faces."""
        if self.B is None:
            return np.empty((0, loads.shape[1]))
        return -self._BR_inverse.T @ self.model.total(self.R.T @ loads)

    def supported(self, loads: Array) -> Array:
        """`loads` (3 owned, k), N, with the reactions of mean supports added."""
        return loads if self.B is None else loads + self.B.T @ self.reactions(loads)


def _plate(x: Array, center: Array) -> Array:
    """(p, 3, 6) displacement of points x (p, 3) under unit translations, and rotations about `center`."""
    unit = np.eye(3)
    turns = [np.cross(axis, x - center) for axis in unit]
    return np.stack([*(np.broadcast_to(axis, x.shape) for axis in unit), *turns], axis=2)


def _add_springs(model: SolidModel, K: PETSc.Mat, R: Array) -> None:
    """Springs on six degrees of freedom that hold the body: pivots of its rigid motions, the largest left each time."""
    diagonal = K.getDiagonal().array_r
    stiffness = float(model.comm.allreduce(diagonal.sum())) / K.getSize()[0]
    scale = np.sqrt(model.total((R**2).sum(axis=0)))
    left = R / scale
    first = K.getOwnershipRange()[0]
    for _ in range(6):
        size = np.einsum("ik,ik->i", left, left)
        here = int(np.argmax(size)) if size.size else -1
        best = model.comm.allgather(float(size[here]) if size.size else 0.0)
        rank = int(np.argmax(best))
        row = model.comm.bcast(left[here] if model.comm.rank == rank else None, root=rank)
        if model.comm.rank == rank:
            block = np.zeros((3, 3))
            block[here % 3, here % 3] = stiffness
            K.setValuesBlocked([(first + here) // 3], [(first + here) // 3], block, addv=True)
        row = row / np.linalg.norm(row)
        left = left - np.outer(left @ row, row)
    K.assemble()
