"""Which of many keys matter at all: `ffrobot uncertainty --by screening`, by elementary effects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..common.arrays import as_floats
from ..common.errors import InputError, SolveError
from ..common.files import AnyPath
from ..run.watcher import Watcher
from .designs import runs_of
from .elementary_effects import draw_trajectories, elementary_effects
from .goals import parse_goal
from .screening_record import Screening
from .spread_designs import SpreadDesigns, read_spreads
from .uncertainty import is_history

FEWEST = 2  # trajectories: of one there is no σ


def screening(
    scene: AnyPath,
    of: Sequence[str],
    spread: Sequence[str],
    output: AnyPath | None = None,
    *,
    trajectories: int = 10,
    seed: int = 0,
    processes: int = 1,
    retry: bool = False,
    allow_python: Sequence[AnyPath] = (),
    watcher: Watcher | None = None,
) -> Screening:
    """Elementary effects of many uncertain keys (Morris): `ffrobot uncertainty --by screening`.

    Args:
        scene: the scene file.
        of: responses.
        spread: keys with their distributions, as in `uncertainty`.
        output: folder of the runs, which a later call reuses; None: they are not kept.
        trajectories: number R of trajectories; each has one run per key and one more.
        seed: of the trajectories.
        processes: runs in parallel.
        retry: whether to repeat designs that failed before.
        allow_python: as in `solve`.
        watcher: an object that observes progress and can stop the study.

    Returns:
        μ*, σ and μ of each key and response.

    Raises:
        InputError: responses, keys or distributions are wrong; a whole history.
        SolveError: the scene with nominal values, or all others, cannot be solved.

    Example:
        found = ffrobot.screening("scene.toml", ["peak joints.elbow.moment"], ["payload.0.mass=±5%"], trajectories=10)
    """
    if trajectories < FEWEST:
        raise InputError(f"uncertainty: --trajectories: expected at least {FEWEST}, found {trajectories}")
    names = list(dict.fromkeys(of))
    if histories := [text for text in names if is_history(text)]:
        raise InputError(
            f'--of: expected responses for --by screening, such as "peak {histories[0]}", found the history'
            f' "{histories[0]}", whose band --by samples or --by gradients computes'
        )
    with runs_of("uncertainty", scene, output, allow_python, processes, retry, watcher) as runs:
        goals, spreads = tuple(map(parse_goal, names)), read_spreads(runs.path, spread)
        if not goals or not spreads:
            raise InputError("uncertainty: expected at least one response (--of) and one key (--spread)")
        designs = SpreadDesigns(runs, spreads, goals)
        taken = draw_trajectories(len(spreads), trajectories, seed)
        low, high = np.array([one.ends for one in spreads]).T
        points = (low + (high - low) * taken.points).reshape(-1, len(spreads))
        found = designs.run([tuple(map(float, point)) for point in points])
        values = np.array([designs.read(design) for design in found]).reshape(trajectories, -1, len(goals))
    effects = elementary_effects(taken, as_floats(values))
    if not effects.count.any():
        raise SolveError(f"{runs.path}: no two runs of a trajectory side by side completed: {designs.failures[0]}")
    return Screening(
        runs.path, spreads, tuple(goal.text for goal in goals), designs.readings, effects, as_floats(values),
        tuple(dict.fromkeys(designs.failures)), 1 + len({design.folder for design in found}), designs.table,
    )  # fmt: skip
