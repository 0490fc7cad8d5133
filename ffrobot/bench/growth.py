"""How time grows: an evaluation with modes per link and links in a chain, a run with outputs.

Links are simply supported beams with sine modes, in closed form, so that any number of them is at hand.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from statistics import median
from types import MappingProxyType

import numpy as np

from ..mbs.analysis.pcid import Pcid, run_pcid
from ..mbs.model.model import build_model
from ..mbs.model.planar_body import PlanarBody, PlanarPoint
from ..mbs.model.system import MechanismSystem
from ..run.watcher import Watcher
from ..scene.scene import Scene
from .evaluation import State, tree_evaluation_seconds
from .precision import Row

MASS, LENGTH, STIFFNESS = 1.0, 1.0, 100.0  # kg, m, EI in N·m²
MODES, LINKS, OUTPUTS = (2, 5, 10, 20, 50, 100, 200), (2, 5, 10, 20, 50), (100, 1000, 10_000, 100_000)
MODES_IN_CHAINS, RUN_LENGTH = 5, 0.1  # s
EVALUATIONS, ROUNDS = 50_000, 25  # over the number of coordinates, in one timing; a millisecond is often undisturbed


def sine_link(name: str, modes: int) -> PlanarBody:
    """A simply supported beam: φ_k = √(2/m) sin(kπx/L)."""
    k = np.arange(1, modes + 1)
    amplitude, sign = np.sqrt(2 / MASS), (-1.0) ** k
    rows = np.zeros((2, modes))
    slope = amplitude * k * np.pi / LENGTH
    none = np.zeros((modes, modes))
    return PlanarBody(
        name=name,
        mass=MASS,
        inertia=MASS * LENGTH**2 / 3,
        first_moment=np.array([MASS * LENGTH / 2, 0.0]),
        stiffness=STIFFNESS * LENGTH / MASS * (k * np.pi / LENGTH) ** 4,
        damping=none,
        S_bar=np.array([np.zeros(modes), MASS * amplitude * (1 - sign) / (k * np.pi)]),
        h=-MASS * amplitude * LENGTH * sign / (k * np.pi),
        j=np.zeros(modes),
        S_tilde=none,
        m_xy=np.eye(modes),
        points=MappingProxyType(
            {
                "root": PlanarPoint(np.zeros(2), rows, slope),
                "tip": PlanarPoint(np.array([LENGTH, 0.0]), rows, slope * sign),
            }
        ),
        modal_transform=np.eye(modes),
        length=LENGTH,
    )


def chain(links: int, modes: int, closed: bool) -> State:
    """A half circle of links, straight and at rest: equations, q and v.

    Its last tip is on a path, or, where closed, pinned to the ground while the first link is driven.
    """
    bodies = [sine_link(f"b{i}", modes) for i in range(links)]
    angles = {body.name: np.pi * (i + 0.5) / links for i, body in enumerate(bodies)}
    model = build_model(_scene(bodies, angles, closed), bodies)
    assembly = MechanismSystem(model, [*model.joints, *model.trajectories], (), list(model.motors.values()))
    q, at = np.zeros(assembly.system.coordinates), np.zeros(2)
    for first, angle in zip(assembly.first, angles.values(), strict=True):
        q[first : first + 3] = *at, angle
        at += LENGTH * np.array([np.cos(angle), np.sin(angle)])
    return assembly, q, np.zeros_like(q)


def _scene(bodies: Sequence[PlanarBody], angles: dict[str, float], closed: bool) -> Scene:
    a = np.array(list(angles.values()))
    tip = LENGTH * float(np.cos(a).sum()), LENGTH * float(np.sin(a).sum())
    last = f"{bodies[-1].name}.tip"
    before = ["ground", *(f"{body.name}.tip" for body in bodies[:-1])]
    joints: list[dict[str, object]] = [
        {"name": f"j{i}", "type": "revolute", "between": (side, f"{body.name}.root")}
        for i, (side, body) in enumerate(zip(before, bodies, strict=True))
    ]
    if closed:
        joints.append({"name": "end", "type": "revolute", "between": ("ground", last), "at": tip})
        first = bodies[0].name
        path = {"name": "crank", "angle": first, "value": f"{angles[first]!r}+0.1*t"}
    else:
        path = {"name": "tip", "point": last, "x": f"{tip[0]!r}+0.1*t", "y": f"{tip[1]!r}"}
    rigid = {"mass": 1.0, "inertia": 1.0, "center": (0.0, 0.0)}  # build_model takes `bodies` in its place
    return Scene.model_validate(
        {
            "name": "growth",
            "gravity": (0.0, -9.81),
            "body": tuple({"name": body.name, "rigid": rigid} for body in bodies),
            "joint": tuple(joints),
            "trajectory": (path,),
            "initial": {"angles": angles},
            "analysis": ({"name": "inverse", "kind": "pcid", "end": RUN_LENGTH, "output_step": RUN_LENGTH},),
            "path": Path("scene.toml"),
            "text": "",
        }
    )


def evaluation_timer(state: State, evaluations: int = EVALUATIONS) -> Callable[[], float]:
    """Measures the seconds of one of so many `evaluations` (over the number of coordinates, at least one)."""
    return partial(tree_evaluation_seconds, state, 0.0, max(1, evaluations // len(state[1])))


def output_timer(outputs: int) -> Callable[[], float]:
    """Measures the seconds of a short run with so many outputs; the integration in it is always the same."""
    model = chain(2, MODES_IN_CHAINS, False)[0].model
    keys = {"name": "inverse", "kind": "pcid", "end": RUN_LENGTH, "output_step": RUN_LENGTH / outputs}
    analysis = Pcid.model_validate({**keys, "tolerance": 1e-6, "integrator": "dop853"})
    return lambda: run_pcid(model, analysis, False, lambda t: True).statistics.wall_seconds


def measure_growth(repeat: int, display: Watcher) -> list[Row]:
    """A row for each size; sizes of one kind are measured in turn, evaluations in at least `ROUNDS` rounds.

    Seconds are of one evaluation, or of a whole run for "outputs". `order` is the slope against the size before, in
    logarithms: 1 is linear growth.
    """
    kinds: dict[str, dict[int, Callable[[], float]]] = {
        "modes per link": {n: evaluation_timer(chain(2, n, False)) for n in MODES},
        "links, open": {n: evaluation_timer(chain(n, MODES_IN_CHAINS, False)) for n in LINKS},
        "links, closed": {n: evaluation_timer(chain(n, MODES_IN_CHAINS, True)) for n in LINKS},
        "outputs": {n: output_timer(n) for n in OUTPUTS},
    }
    rows: list[Row] = []
    for kind, timers in kinds.items():
        seconds: dict[int, list[float]] = {size: [] for size in timers}
        rounds = repeat if kind == "outputs" else max(repeat, ROUNDS)
        for repetition in range(rounds):
            display.stage(f"growth with {kind}: repetition {repetition + 1} of {rounds}")
            for size, timer in timers.items():
                seconds[size].append(timer())
        rows += _rows(kind, seconds)
    return rows


def _rows(kind: str, seconds: dict[int, list[float]]) -> list[Row]:
    rows: list[Row] = []
    before: tuple[int, float] | None = None
    for size, values in seconds.items():
        best = min(values)
        order = None if before is None else float(np.log(best / before[1]) / np.log(size / before[0]))
        before = size, best
        rows.append(
            {"with": kind, "size": size, "seconds": median(values), "seconds_min": best, "repetitions": len(values)}
            | {"order": order}
        )
    return rows
