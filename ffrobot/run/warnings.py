"""Why the results of an analysis may be wrong, or not mean what they seem to: one text each for all who tell."""

from __future__ import annotations

from collections.abc import Iterator

from ..actuation.control.closed_loop import LoopRecord
from ..mbs.analysis.elastic_joints import unresolved_gears
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
    if isinstance(result.outcome.details, LoopRecord):
        yield from result.outcome.details.warnings
    if result.outcome.analysis.name == scene.analysis[0].name:  # once
        yield from turned_guesses(scene)
    yield from unresolved_gears(result.outcome.gears)
