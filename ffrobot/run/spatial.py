"""The analyses of a scene in space, run one after the other."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from ..common.errors import of_file
from ..mbs.analysis.spatial_kinds import IN_SPACE
from ..mbs.analysis.spatial_run import SpatialContext, SpatialRun
from ..mbs.model.spatial_model import SpatialModel, build_spatial_model
from ..mbs.model.spatial_wrench import Wrench
from ..mbs.quantities.spatial_energy import Energies, Momentum, energies, momentum
from ..mbs.quantities.spatial_motion import SpatialMotion
from ..mbs.quantities.spatial_reactions import reactions
from ..mbs.scene.analysis import Analysis
from ..scene.spatial import SpatialScene, load_spatial_scene
from .spatial_bodies import LoadedSpatialBody, load_spatial_bodies
from .watcher import Interruption, Watcher

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class SpatialResult:
    """What was computed of one analysis: the run, its motion, and forces in joints by name."""

    run: SpatialRun
    motion: SpatialMotion
    reactions: Mapping[str, Wrench]
    energies: Energies
    momentum: Momentum


@dataclass(frozen=True)
class SpatialSolution:
    """Everything a solve of a scene in space computed.

    Attributes:
        scene, model: what was solved.
        bodies: by name.
        analyses: by name, in the order of the scene.
        seconds: wall time by stage.
        failure: what ended the run after these analyses; None where all ran, or the last of them did not complete.
    """

    scene: SpatialScene
    model: SpatialModel
    bodies: Mapping[str, LoadedSpatialBody]
    analyses: Mapping[str, SpatialResult]
    seconds: Mapping[str, float]
    failure: Exception | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """What links cannot do, one line each."""
        return tuple(
            f"{name}: rigid in {', '.join(body.rigid_in)}, of which its file has no modes"
            for name, body in self.bodies.items()
            if body.rigid_in
        )


Keep = Callable[[SpatialSolution], None]


def solve_spatial(scene: SpatialScene | Path, watcher: Watcher, keep: Keep | None = None) -> SpatialSolution:
    """Run every analysis of a scene, or of a scene file, in space; stage 1 runs first for links that are out of date.

    An analysis that does not reach its end is kept as far as it got, and ends the run (`SpatialRun.check_completed`).
    So does Ctrl-C during an analysis. `keep` is given what there is before an error is raised.
    Raises `InputError` for anything wrong with the scene or the files it names, `SolveError` where no state is found.
    """
    if isinstance(scene, Path):
        scene = load_spatial_scene(scene)
    began = time.perf_counter()
    loaded = load_spatial_bodies(scene, watcher.stage)
    seconds = {"bodies": time.perf_counter() - began}
    model = build_spatial_model(scene, [body.spatial for body in loaded])
    bodies = {body.name: part for body, part in zip(scene.body, loaded, strict=True)}
    solution = SpatialSolution(scene, model, bodies, {}, seconds)
    with Interruption(watcher.stopping) as interruption:
        solution = _run_all(solution, watcher, interruption)
        if keep is not None and solution.analyses:
            keep(solution)
    if solution.failure is not None:
        raise solution.failure
    return solution


def _run_all(solution: SpatialSolution, watcher: Watcher, interruption: Interruption) -> SpatialSolution:
    """The analyses up to the first that fails."""
    results: dict[str, SpatialResult] = {}
    seconds = dict(solution.seconds)
    for analysis in solution.scene.analysis:
        if interruption.requested and results:
            break
        watcher.stage(f'analysis "{analysis.name}"')
        began = time.perf_counter()
        try:
            with of_file(solution.scene.path):
                run = IN_SPACE[analysis.kind](_context(solution, analysis, results, watcher, interruption), analysis)
                results[analysis.name] = _evaluated(run)
        except Exception as error:  # raised once the analyses before it are kept
            if not results:
                raise
            return replace(solution, analyses=results, seconds=seconds, failure=error)
        seconds[analysis.name] = time.perf_counter() - began
        _log(run)
        if run.failed:
            break
    return replace(solution, analyses=results, seconds=seconds)


def _context(
    solution: SpatialSolution,
    analysis: Analysis,
    results: Mapping[str, SpatialResult],
    watcher: Watcher,
    interruption: Interruption,
) -> SpatialContext:
    end = analysis.last_time

    def progress(t: float) -> bool:
        return watcher.advance(t, end) and not interruption.requested

    return SpatialContext(solution.model, {name: result.run for name, result in results.items()}, progress)


def _evaluated(run: SpatialRun) -> SpatialResult:
    """What is read off a run."""
    motion = SpatialMotion(
        run.model, run.time, run.q, run.v, run.a, run.multipliers, run.required, run.is_at_rest, run.applied
    )  # fmt: skip
    return SpatialResult(run, motion, reactions(motion), energies(motion), momentum(motion))


def _log(run: SpatialRun) -> None:
    logger.info(
        'analysis "%s": %s at t = %g s, %d steps, %d evaluations, %.3f s; integrator %s',
        run.analysis.name, run.status, run.time[-1] if len(run.time) else 0.0, run.steps, run.evaluations,
        run.wall_seconds, run.integrator,
    )  # fmt: skip
