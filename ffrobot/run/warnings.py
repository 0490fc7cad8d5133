"""Why the results of an analysis may be wrong, or not mean what they seem to: one text each for all who tell."""

from __future__ import annotations

from collections.abc import Iterator

from ..actuation.control.loop_record import LoopRecord
from ..mbs.analysis.elastic_joints import unresolved_gears
from ..mbs.analysis.motors_only import InvertedPath
from ..mbs.analysis.planar_outcome import PlanarOutcome
from ..mbs.quantities.path_seen import path_warnings
from ..mbs.quantities.validity import deflection_warning
from ..mbs.solve.reach import turned_guesses
from ..scene.scene import Scene
from .solution import AnalysisResult


def warnings_of(scene: Scene, result: AnalysisResult) -> Iterator[str]:
    """Of an analysis of the scene that is evaluated, the most serious first."""
    if text := deflection_warning(result.bending):
        yield text
    if result.feasibility is not None and result.feasibility.unsupplied is not None:
        yield result.feasibility.unsupplied.in_words
    if text := _free_to_swing(result.outcome):
        yield text
    if isinstance(result.outcome.details, LoopRecord):
        yield from result.outcome.details.warnings
    if result.outcome.analysis.name == scene.analysis[0].name:  # once
        yield from turned_guesses(scene)
    yield from unresolved_gears(result.outcome.gears)
    if any(result.outcome.assembly.is_trajectory) or isinstance(result.outcome.details, InvertedPath):
        yield from path_warnings(result.outcome.analysis, result.outcome.time, scene.trajectory)


def _free_to_swing(outcome: PlanarOutcome) -> str:
    """What to say where trajectories leave degrees of freedom of the robot open; else empty."""
    model, held = outcome.assembly.model, sum(constraint.is_trajectory for constraint in outcome.assembly.constraints)
    if not held or held >= model.degrees_of_freedom:
        return ""
    return (
        f"trajectories prescribe {held} of {model.degrees_of_freedom} degrees of freedom; the others are unactuated"
        " and move freely. Add trajectories of joints, or of angles of bodies, if this is not intended"
    )
