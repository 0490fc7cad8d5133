"""How time grows: an evaluation with modes per link and links in a chain, a run with outputs.

Links are simply supported beams with sine modes, in closed form, so that any number of them is at hand.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from statistics import median
from types import MappingProxyType

import numpy as np

from ffrobot.bench.precision import Row
from ffrobot.mbs.model.body import Body, BodyPoint
from ffrobot.mbs.model.build import build_model
from ffrobot.mbs.model.model import Model
from ffrobot.mbs.model.projection import projected
from ffrobot.mbs.posture.path_start import path_start
from ffrobot.mbs.run.context import Context
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import make_scene
from ffrobot.scene.scene import Scene

from .hand_written import State, evaluation_seconds, start_at_rest

MASS, LENGTH, STIFFNESS = 1.0, 1.0, 100.0  # kg, m, EI in N·m²
MODES, LINKS, OUTPUTS = (2, 5, 10, 20, 50, 100, 200), (2, 5, 10, 20, 50), (100, 1000, 10_000, 100_000)
MODES_IN_CHAINS, RUN_LENGTH = 5, 0.1  # s
EVALUATIONS, ROUNDS = 50_000, 25  # over the number of coordinates, in one timing; a millisecond is often undisturbed


def sine_link(name: str, modes: int) -> Body:
    """A simply supported beam: φ_k = √(2/m) sin(kπx/L) along y."""
    k = np.arange(1, modes + 1)
    amplitude, sign = np.sqrt(2 / MASS), (-1.0) ** k
    slope = amplitude * k * np.pi / LENGTH
    none, y = np.zeros((3, modes)), np.array([0.0, 1.0, 0.0])
    x_y = np.outer([1.0, 0.0, 0.0], y)
    along, across = np.multiply.outer(y, np.ones(modes)), np.multiply.outer(np.outer(y, y), np.eye(modes))
    turned = np.multiply.outer([0.0, 0.0, 1.0], slope)
    whole = Body(
        name=name,
        mass=MASS,
        first_moment=np.array([MASS * LENGTH / 2, 0.0, 0.0]),
        second_moment=np.diag([MASS * LENGTH**2 / 3, 0.0, 0.0]),
        S_bar=along * (MASS * amplitude * (1 - sign) / (k * np.pi)),
        I_bar=np.multiply.outer(x_y, -MASS * amplitude * LENGTH * sign / (k * np.pi)),
        S_bar_kl=across,
        J_spin=0.0,
        h_spin=np.zeros(modes),
        S_spin=np.zeros((modes, modes)),
        stiffness=STIFFNESS * LENGTH / MASS * (k * np.pi / LENGTH) ** 4,
        damping=np.zeros((modes, modes)),
        points=MappingProxyType(
            {
                "root": BodyPoint(np.zeros(3), none, turned),
                "tip": BodyPoint(np.array([LENGTH, 0.0, 0.0]), none, turned * sign),
            }
        ),
        modal_transform=np.eye(modes),
        length=LENGTH,
    )
    return projected(whole)


def chain(links: int, modes: int, *, closed: bool = False, outputs: int = 1) -> Model:
    """A half circle of links, straight and at rest, with a short inverse analysis of so many outputs.

    Its last tip is on a path, or, where closed, pinned to the ground while the first link is driven.
    """
    names = [f"b{i}" for i in range(links)]
    angles = {name: np.pi * (i + 0.5) / links for i, name in enumerate(names)}
    return build_model(_scene(angles, closed, outputs), [sine_link(name, modes) for name in names])


def _scene(angles: Mapping[str, float], closed: bool, outputs: int) -> Scene:
    a = np.array(list(angles.values()))
    tip = [LENGTH * float(np.cos(a).sum()), LENGTH * float(np.sin(a).sum())]
    names = list(angles)
    last, before = f"{names[-1]}.tip", ["ground", *(f"{name}.tip" for name in names[:-1])]
    joints: list[dict[str, object]] = [
        {"name": f"j{i}", "type": "revolute", "between": [side, f"{name}.root"]}
        for i, (side, name) in enumerate(zip(before, names, strict=True))
    ]
    if closed:
        joints.append({"name": "end", "type": "revolute", "between": ["ground", last], "at": tip})
        path = {"name": "crank", "angle": names[0], "value": f"{angles[names[0]]!r}+0.1*t"}
    else:
        path = {"name": "tip", "point": last, "x": f"{tip[0]!r}+0.1*t", "y": f"{tip[1]!r}"}
    points = {"root": [0.0, 0.0], "tip": [LENGTH, 0.0]}
    rigid = {"mass": 1.0, "inertia": 1.0, "center": [0.0, 0.0], "points": points}  # sine links come in its place
    return make_scene(
        name="growth",
        gravity=[0.0, -9.81],
        body=[{"name": name, "rigid": rigid} for name in names],
        joint=joints,
        trajectory=[path],
        initial={"angles": angles},
        analysis=[
            {"name": "inverse", "kind": "pcid", "end": RUN_LENGTH, "output_step": RUN_LENGTH / outputs}
            | {"tolerance": 1e-6, "integrator": "dop853"}
        ],
    )


def _timer(model: Model) -> Callable[[], float]:
    return evaluation_timer(start_at_rest(model))


def evaluation_timer(state: State, evaluations: int = EVALUATIONS) -> Callable[[], float]:
    """Measures the seconds of one of so many `evaluations` (over the number of coordinates, at least one)."""
    return partial(evaluation_seconds, state, 0.0, max(1, evaluations // len(state[1])))


def output_timer(outputs: int) -> Callable[[], float]:
    """Measures the seconds of a short run with so many outputs; the integration in it is always the same."""
    model = chain(2, MODES_IN_CHAINS, outputs=outputs)
    assert isinstance(model.scene, Scene)
    analysis = model.scene.analysis[0]
    path = path_start(model, analysis.last_time) if analysis.starts_on_path else None
    context = Context(model=model, outcomes={}, progress=lambda t: True, path=path)
    return lambda: analysis.run(context).statistics.wall_seconds


def measure_growth(repeat: int, display: Watcher) -> list[Row]:
    """A row for each size; sizes of one kind are measured in turn, evaluations in at least `ROUNDS` rounds.

    Seconds are of one evaluation, or of a whole run for "outputs". `order` is the slope against the size before, in
    logarithms: 1 is linear growth.
    """
    kinds: dict[str, dict[int, Callable[[], float]]] = {
        "modes per link": {n: _timer(chain(2, n)) for n in MODES},
        "links, open": {n: _timer(chain(n, MODES_IN_CHAINS)) for n in LINKS},
        "links, closed": {n: _timer(chain(n, MODES_IN_CHAINS, closed=True)) for n in LINKS},
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
