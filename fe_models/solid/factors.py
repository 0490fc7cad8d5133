"""Cholesky factors of a solid's supported stiffness matrix by MUMPS, in memory or, of a large one, in files."""

from __future__ import annotations

import os
import shutil
import tempfile
import weakref
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
from petsc4py import PETSc

from ...common.arrays import Array
from ...common.cache import cache_folder
from ...common.errors import SolveError
from ...common.locks import is_running, this_process

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
    """K = L Lᵀ, ordered by MUMPS' own PORD. Vectors hold this rank's own degrees of freedom.

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
        """K⁻¹ f of loads (own, k), as many columns at once as MUMPS takes well; collective."""
        result = np.empty_like(loads)
        for start in range(0, loads.shape[1], COLUMNS):
            part = slice(start, start + COLUMNS)
            f = np.asfortranarray(loads[:, part])
            u = np.empty_like(f)
            F, U = (self._dense(block) for block in (f, u))
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

    def _dense(self, block: Array) -> PETSc.Mat:
        matrix = PETSc.Mat().createDense((self._sizes, (None, block.shape[1])), array=block, comm=self.matrix.comm)
        matrix.assemble()
        return matrix


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
