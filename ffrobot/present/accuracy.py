"""What is known of the errors of a solve, by where they come from."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ..mbs.quantities.attachment_error import JOLT
from ..run.solution import AnalysisResult, Solution
from .lines import deflection_in_words

NOT_ESTIMATED = "not estimated"
RESOLVED = 0.3  # an estimated error of modes beyond is none: they do not resolve the motion


def error_budget(solution: Solution) -> Iterator[str]:
    """A line each: time integration, modes, deflection, patches."""
    results = integrated(solution)
    if aims := [result.analysis.tolerance for result in results]:
        asked = " … ".join(f"{aim:.0e}" for aim in sorted({min(aims), max(aims)}))
        yield f"time integration: {asked} of peaks, requested tolerance"
    yield f"modes: {_modes(solution, results)}"
    yield f"deflection: {deflection_in_words(result.bending for result in solution.analyses.values())}"
    for name, result in solution.analyses.items():
        if result.check is not None:
            yield f"{name}, {result.check.in_words}"
    yield from (f"patches of {patches.stiffness_in_words}" for patches in solution.patch_arrays)


def integrated(solution: Solution) -> list[AnalysisResult]:
    """The analyses that went through time."""
    return [result for result in solution.analyses.values() if result.analysis.is_integrated]


def _modes(solution: Solution, results: Sequence[AnalysisResult]) -> str:
    if rigid := [f"{name} in {', '.join(body.rigid_in)}" for name, body in solution.bodies.items() if body.rigid_in]:
        return f"{NOT_ESTIMATED}: rigid without modes: {'; '.join(rigid)}"
    if not solution.links:
        return "links are rigid"
    if solution.mode_choice is not None:
        known = [error for of in solution.mode_choice.errors.values() for error in of.values()]
        return f"{max(known):.0e} of peaks, against all modes of the files" if any(known) else NOT_ESTIMATED
    errors = [result.mode_error for result in results]
    known = [error for error in errors if error is not None]
    if not known or len(known) < len(errors):
        without = [name for name, link in solution.links.items() if not link.residual.any()]
        return f"{NOT_ESTIMATED}: no attachment modes in {', '.join(without)}" if without else NOT_ESTIMATED
    estimate = f"{max(known):.0e} of peaks, estimated"
    if max(known) > RESOLVED:
        estimate = "too few: vibrations above the highest mode are excited"
    if any(result.start_jolt >= JOLT for result in results):
        estimate += "; a start in equilibrium, without a step in acceleration, lowers it"
    return estimate
