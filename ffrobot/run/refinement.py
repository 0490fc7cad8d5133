"""Scenes solved again and again, with more modes or in more pieces, until there are enough."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from ..mbs.analysis.drive import Progress
from ..mbs.analysis.outcome import Outcome
from ..mbs.model.body import Body
from ..mbs.scene.analysis import Analysis
from .mode_search import ModeSearch, Reported
from .solution import AnalysisResult, Solution
from .watcher import Interruption, Watcher

logger = logging.getLogger(__name__)


def with_enough_modes(
    solution: Solution,
    search: ModeSearch,
    solved: Callable[[Solution, Mapping[str, Body]], Solution],
    reported: Callable[[AnalysisResult], Reported],
    interruption: Interruption,
) -> Solution:
    """The scene `solved` with the bodies that `search` asks for, until that has enough."""
    while True:
        solution = solved(solution, search.bodies)
        if solution.failure is not None:
            return solution
        search.add(_reported(solution, reported), last=interruption.requested)
        if search.is_over:
            return replace(solution, mode_choice=search.choice())


def _reported(solution: Solution, reported: Callable[[AnalysisResult], Reported]) -> dict[str, Reported] | None:
    """What counts, by analysis; None where not all of them completed."""
    results = solution.analyses
    if len(results) < len(solution.scene.analysis) or any(of.status != "completed" for of in results.values()):
        return None
    return {name: reported(result) for name, result in results.items()}


def with_enough_pieces(
    solution: Solution,
    solved: Callable[[Solution], Solution],
    divided: Callable[[Solution, Mapping[str, int]], Solution],
    wanted: Callable[[Solution], Mapping[str, int]],
    interruption: Interruption,
) -> Solution:
    """The scene `solved` with links `divided` in as many pieces as they bend far, which is what solutions want more."""
    solution = solved(solution)
    given = {body.name: body.pieces for body in solution.scene.body if isinstance(body.pieces, int)}
    while solution.failure is None and not interruption.requested and (more := wanted(solution)):
        solution = solved(divided(solution, {**given, **more}))
    return solution


def goes_on(solution: Solution, outcome: Outcome) -> bool:
    """Whether `outcome` is of use to `resume`; a search for modes or pieces has its own bodies and starts again."""
    searched = any("auto" in (body.modes, body.pieces) for body in solution.scene.body)
    return not searched and outcome.analysis.is_resumable


def completed(
    solution: Solution,
    run_all: Callable[[Solution], Solution | None],
    stiffened: Callable[[Solution], Solution],
) -> Solution:
    """All analyses run, all of them stiffened where `geometric_stiffening = "auto"` asks for that."""
    found = run_all(solution) or run_all(stiffened(solution))
    assert found is not None
    return found


def progress_of(analysis: Analysis, watcher: Watcher, interruption: Interruption) -> Progress:
    """What tells `watcher` how far an analysis is, and stops it on request."""
    return lambda t: watcher.advance(t, analysis.last_time) and not interruption.requested


def is_replayed(analysis: Analysis, among: Sequence[Analysis]) -> bool:
    """Whether a check, or another analysis of the scene, takes its actuation."""
    return analysis.is_checked or any(other.takes_actuation and other.source == analysis.name for other in among)


def log_outcome(outcome: Outcome) -> None:
    """One line on how an analysis went."""
    run = outcome.statistics
    logger.info(
        'analysis "%s": %s at t = %g s, %d steps, %d rejected, %d evaluations, %.3f s; integrator %s: %s',
        outcome.analysis.name, run.status, outcome.time[-1] if len(outcome.time) else 0.0, run.steps, run.rejected,
        run.evaluations, run.wall_seconds, run.integrator.name, run.integrator.reason,
    )  # fmt: skip
