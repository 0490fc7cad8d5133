"""What a solve prints with `--verbose`: everything that its summary leaves out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from ..mbs.analysis.inverted_path import AroundPath, describe_zeros, is_minimum_phase
from ..mbs.analysis.motors_only import path_errors
from ..mbs.analysis.outcome import Details, Outcome
from ..results.verdict import Verdict
from ..run.solution import AnalysisResult, Solution
from .accuracy import error_budget, integrated
from .control import control_lines, control_tables
from .lines import alike, integrator_lines, warning_lines
from .modes import chosen_modes, pieces_in_words
from .stresses import stress_table
from .tables import plain_table
from .voltages import voltage_table


def print_details(
    solution: Solution, verdict: Verdict, path: Path, seconds: Mapping[str, float], console: Console
) -> None:
    """Tables of the analyses and what they found, wall time per stage, what was skipped, where the results are."""
    console.print(_analyses(solution))
    bending = {name: result.bending for name, result in solution.analyses.items()}
    texts = {name: result.warnings for name, result in solution.analyses.items()}
    for line in warning_lines(bending, texts):
        console.print(f"warning    {line}")
    for line in alike((name, text) for name, result in solution.analyses.items() for text in result.notes):
        console.print(f"note       {line}")
    for table in _tables(solution):
        console.print()
        console.print(table)
    console.print()
    for line in verdict.lines():
        console.print(line)
    for line in control_lines(_details(solution)):
        console.print(line)
    notes = Table.grid(padding=(0, 2))
    for title, text in _notes(solution, seconds):
        notes.add_row(title, text)
    console.print()
    console.print(notes)
    console.print(f"results    {path}", soft_wrap=True)


def _closest(solution: Solution) -> Iterator[tuple[str, AnalysisResult]]:
    """The analyses by name, at outputs and between."""
    yield from ((name, one.closer or one) for name, one in solution.analyses.items())


def _details(solution: Solution) -> dict[str, Details]:
    """What only kinds of analyses find, by analysis."""
    return {name: result.run.details for name, result in solution.analyses.items()}


def _tables(solution: Solution) -> Iterator[Table]:
    """What was found of each kind, where there is any."""
    voltages = voltage_table(
        (name, layout, array, result.actuation.voltages[layout])
        for name, result in _closest(solution)
        if result.actuation is not None
        for of_link in solution.patches.values()
        for layout, array in of_link.arrays.items()
    )
    stresses = stress_table((name, one.run.time, one.stresses) for name, one in _closest(solution))
    yield from (table for table in (voltages, stresses) if table.row_count)
    yield from control_tables(_details(solution))


def _notes(solution: Solution, seconds: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    runs = {result.analysis.name: result.run for result in integrated(solution)}
    yield from (("path", note) for note in solution.path_notes)
    chosen = {name: run.statistics.integrator for name, run in runs.items()}
    yield from (("integrator", line) for line in integrator_lines(chosen))
    for name, run in runs.items():
        if isinstance(run.details, AroundPath) and run.details.inversion is not None:
            yield "motors only", f"{name}: {_inversion(run, run.details)}"
    if solution.mode_choice is not None:
        yield "modes", chosen_modes([body.spatial for body in solution.bodies.values()], solution.mode_choice)
    if solution.divided:
        yield "pieces", pieces_in_words(solution.divided)
    yield from (("links", note) for note in solution.notes)
    yield "accuracy", "\n".join(error_budget(solution))
    yield "wall time", ", ".join(f"{stage} {value:.2f} s" for stage, value in seconds.items())
    if solution.omissions:
        yield "omitted", "; ".join(solution.omissions)


def _inversion(run: Outcome, around: AroundPath) -> str:
    """What the zeros are, how the path was inverted, and what that leaves of it."""
    inversion = around.inversion
    assert inversion is not None
    linear, factor = inversion.linearisation, inversion.servo.factor
    held = inversion.servo.model
    error = max(float(np.abs(off).max(initial=0.0)) for off in path_errors(held, run.time, run.q).values())
    left = f"largest error of the path {error:.2g}"
    if is_minimum_phase(linear):
        output = "the path's own points" if factor == 1 else f"the output with {factor:.2g} times the vibration"
        return f"{output}: minimum phase, integrated forward; {left}"
    return (
        f"not minimum phase, zeros at {describe_zeros(linear)} 1/s; stable inversion with"
        f" {around.pre_actuation:.3g} s of pre- and {around.post_actuation:.3g} s of post-actuation"
        f" (start off rest by {inversion.off_rest:.1g}); {left}"
    )


def _analyses(solution: Solution) -> Table:
    table = plain_table(
        "analysis", "kind", "integrator", "end (s)", "steps", "tolerance", "constraint\nviolation", "wall (s)"
    )
    for name, result in solution.analyses.items():
        analysis, run, is_integrated = result.analysis, result.run.statistics, result.analysis.is_integrated
        table.add_row(
            name,
            analysis.kind,
            run.integrator.in_words if is_integrated else "",
            _end(result),
            f"{run.steps}" if is_integrated else "",
            f"{analysis.tolerance:.0e}" if is_integrated else "",
            f"{result.motion.violation.max(initial=0.0):.0e}",
            f"{run.wall_seconds:.3f}",
        )
    return table


def _end(result: AnalysisResult) -> str:
    """The last output, s, or how far a run came that ended early."""
    run = result.run
    ended_early = run.status != "completed"
    return f"{run.time_reached:g} of {run.analysis.last_time:g}" if ended_early else f"{run.time[-1]:g}"
