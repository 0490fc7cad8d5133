"""Which of many keys matter at all: `ffrobot uncertainty --by screening`, by elementary effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..common.arrays import Array, as_floats
from ..common.errors import InputError, SolveError
from ..run.watcher import Watcher
from .elementary_effects import Effects, draw_trajectories, elementary_effects
from .goals import parse_goal
from .readings import Reading
from .spread_designs import Runs, SpreadDesigns, read_spreads
from .spreads import Spread
from .uncertainty import is_history

FEWEST = 2  # trajectories: of one there is no σ


@dataclass(frozen=True)
class Screening:
    """What each of k keys does to g goals over its whole spread.

    Attributes:
        scene: its file.
        spreads: (k,) of the keys; a normal one is taken two standard deviations to both sides.
        goals, readings: (g,) what was asked for, and with all keys at the middle of their spreads.
        effects: (g, k) μ*, σ and μ, in units of the goals.
        values: (r, k + 1, g) the goals along the trajectories, NaN where a run failed.
        failures: runs that failed, in words; `runs` in all, of which `table` is the file.
    """

    scene: Path
    spreads: tuple[Spread, ...]
    goals: tuple[str, ...]
    readings: tuple[Reading, ...]
    effects: Effects
    values: Array
    failures: tuple[str, ...]
    runs: int
    table: Path | None


def screening(
    path: Path,
    of: Sequence[str],
    spread: Sequence[str],
    folder: Path,
    *,
    trajectories: int = 10,
    seed: int = 0,
    processes: int = 1,
    retry: bool = False,
    watcher: Watcher | None = None,
) -> Screening:
    """Elementary effects of keys `spread` on goals `of` the scene file at `path`; runs stay in `folder`.

    Raises:
        InputError: goals, keys or spreads that mean nothing, or that make scenes impossible; histories as a whole.
        SolveError: the scene all parameters at nominal values, or all others, cannot be solved.
    """
    if trajectories < FEWEST:
        raise InputError(f"uncertainty: --trajectories: expected at least {FEWEST}, found {trajectories}")
    names = list(dict.fromkeys(of))
    if histories := [text for text in names if is_history(text)]:
        raise InputError(
            f'--of: expected responses for --by screening, such as "peak {histories[0]}", found the history'
            f' "{histories[0]}", whose band --by samples or --by gradients computes'
        )
    goals, spreads = tuple(map(parse_goal, names)), read_spreads(path, spread)
    if not goals or not spreads:
        raise InputError("uncertainty: expected at least one response (--of) and one key (--spread)")
    designs = SpreadDesigns(path, spreads, goals, Runs(folder, processes, retry, watcher))
    taken = draw_trajectories(len(spreads), trajectories, seed)
    low, high = np.array([one.ends for one in spreads]).T
    points = (low + (high - low) * taken.points).reshape(-1, len(spreads))
    found = designs.run([tuple(map(float, point)) for point in points])
    values = np.array([designs.read(design) for design in found]).reshape(trajectories, -1, len(goals))
    effects = elementary_effects(taken, as_floats(values))
    if not effects.count.any():
        raise SolveError(f"{path}: no two runs of a trajectory side by side completed: {designs.failures[0]}")
    return Screening(
        path, spreads, tuple(goal.text for goal in goals), designs.readings, effects, as_floats(values),
        tuple(dict.fromkeys(designs.failures)), 1 + len({design.folder for design in found}), designs.table,
    )  # fmt: skip
