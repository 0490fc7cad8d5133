"""Times of one evaluation: of ours, and of the two-link case written by hand (hand_written.cpp), compiled; ratios."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from statistics import median

import numpy as np

from ffrobot.common.arrays import Array
from ffrobot.common.errors import InputError, SolveError
from ffrobot.mbs.model.body import Body
from ffrobot.mbs.model.model import Model
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.posture.start import undeformed_posture

State = tuple[MultibodySystem, Array, Array]
"""Equations, q (n_q,) and v (n_v,)."""


def start_at_rest(model: Model) -> State:
    """Where a mechanism starts: on its path with undeformed links, at rest."""
    return MultibodySystem(model), undeformed_posture(model).q, np.zeros(model.tree.n_v)


def evaluation_seconds(state: State, t: float, evaluations: int) -> float:
    """Seconds of one of so many `evaluations` as integrators make them, without loads."""
    system, q, v = state
    core, _, rows = system.integrated
    return core.time_evaluations(q, v, targets(system, t)[rows], evaluations)


def targets(system: MultibodySystem, t: float) -> Array:
    """Second derivatives that the core's rows follow at time t (rows,)."""
    return system.model.row_signs * [0.0 if row.target is None else row.target(t)[2] for row in system.model.rows]


def ratios(seconds: Sequence[float], beside: Sequence[float]) -> tuple[float, float]:
    """Ratio of the minima, and median of the ratios of neighbours: when they disagree, the machine was busy."""
    return min(seconds) / min(beside), median(a / b for a, b in zip(seconds, beside, strict=True))


SOURCE = Path("tools/bench/hand_written.cpp")
FLAGS = ("-std=c++20", "-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math")
STEPS = 30_000  # of DOP853 over the second: λ within 5e-5 of its peak (tests/benchmarks/test_hand_written.py)
TIME = 0.3  # s, at which both evaluate


class HandWritten:
    """The compiled program, with the numbers of the links of `model`.

    Args:
        repository: the source tree.
        folder: for what is compiled.
        flags: of the compiler.

    Raises `InputError` where the source is not there, `SolveError` where it cannot be compiled.
    """

    def __init__(self, repository: Path, model: Model, folder: Path, flags: Sequence[str] = FLAGS) -> None:
        source = repository / SOURCE
        if not source.is_file():
            raise InputError(f"{repository}: source: expected ffrobot's source tree, found no {SOURCE} in it")
        if shutil.which("g++") is None:
            raise SolveError(f"{source}: needs the compiler g++, which is not installed")
        self._binary, self._links = folder / "two_link", folder / "links.txt"
        command: list[str | Path] = ["g++", *flags, f"-I{repository / 'mbs'}", "-o", self._binary, source]
        compiled = subprocess.run(command, capture_output=True, text=True, check=False)
        if compiled.returncode:
            raise SolveError(f"{source}: does not compile:\n{compiled.stderr}")
        self._links.write_text("\n".join(link_numbers(node.body) for node in model.tree.nodes), encoding="utf-8")

    def command(self, evaluations: int, steps: int) -> list[str]:
        """What runs it; its main function says what it does."""
        return [str(self._binary), str(self._links), str(evaluations), str(steps)]

    def __call__(self, evaluations: int, steps: int) -> list[list[float]]:
        """Lines of numbers that it prints."""
        done = subprocess.run(self.command(evaluations, steps), check=True, capture_output=True, text=True)
        return [[float(number) for number in line.split()] for line in done.stdout.splitlines()]

    def evaluation_seconds(self, evaluations: int) -> float:
        """Of one evaluation."""
        return self(evaluations, 0)[0][0]

    def pcid_seconds(self) -> float:
        """Of a second of inverse dynamics from the undeformed start."""
        return self(1, STEPS)[2][0]


def link_numbers(body: Body) -> str:
    """Mass, inertia about z, first moment, length, and the rows K, S̄_y, h = Ī_xy − Ī_yx, Φ_y of the tip."""
    h = body.I_bar[0, 1] - body.I_bar[1, 0]
    rows = [body.stiffness, body.S_bar[1], h, body.points["tip"].translation[1]]
    numbers = [body.mass, body.inertia[2, 2], body.first_moment[0], body.length, *np.concatenate(rows)]
    return " ".join(repr(float(number)) for number in numbers if number is not None)


def general_state(model: Model) -> State:
    """The state at which the program times itself, on the constraints."""
    q, v = undeformed_posture(model).q, np.zeros(model.tree.n_v)
    bend = iter(1e-4 / (1 + np.arange(model.tree.n_v)))
    for node in model.tree.nodes:
        q[node.p_q] = [next(bend) for _ in range(node.body.n_modes)]
    found = model.constraints.posture(q, TIME)
    assert found is not None

    def rates(v: Array) -> Array:
        """Ċ (rows,) there, linear in v."""
        return model.constraints.rates(found[None], v[None], np.array([TIME]))[0]

    joints = [k for node in model.tree.nodes for k in range(node.v.start, node.v.stop)]
    gradients = np.column_stack([rates(unit) - rates(v) for unit in np.eye(len(v))[joints]])
    v[joints] = np.linalg.lstsq(gradients, -rates(v), rcond=None)[0]
    return MultibodySystem(model), found, v
