"""What a solve prints at its end."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from ..mbs.analysis.inverted_path import describe_zeros, is_minimum_phase
from ..mbs.analysis.motors_only import InvertedPath, path_error
from ..mbs.analysis.outcome import Details
from ..mbs.analysis.planar_outcome import PlanarOutcome
from ..mbs.model.raised_mass import raised_in_words
from ..results.verdict import Verdict
from ..run.loaded_body import remarks_on_parts, rigid_in_words
from ..run.solution import AnalysisResult, Solution
from .accuracy import error_budget
from .control import control_lines, control_tables
from .lines import integrator_lines, warning_lines
from .modes import chosen_modes, pieces_in_words
from .stresses import stress_table
from .tables import plain_table
from .voltages import voltage_table

PLAIN_WIDTH = 120  # columns where the output is no terminal


def summary_console() -> Console:
    """The standard output; names in a scene are no markup, and what goes to a file is not squeezed into 80 columns."""
    width = None if sys.stdout.isatty() else PLAIN_WIDTH
    return Console(width=width, markup=False, highlight=False, emoji=False)


def print_summary(
    solution: Solution, verdict: Verdict, path: Path, seconds: Mapping[str, float], console: Console
) -> None:
    """Tables of the analyses and what they found, wall time per stage, what was skipped, where the results are."""
    console.print(_analyses(solution))
    bending = {name: result.bending for name, result in solution.analyses.items()}
    told = {name: result.warnings for name, result in solution.analyses.items()}
    for line in warning_lines(bending, told):
        console.print(f"warning    {line}")
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
    return {name: outcome.details for name, outcome in solution.outcomes.items()}


def _tables(solution: Solution) -> Iterator[Table]:
    """What was found of each kind, where there is any."""
    if any(result.voltages for result in solution.analyses.values()):
        yield _voltages(solution)
    if any(result.stresses for result in solution.analyses.values()):
        yield stress_table((name, one.outcome.time, one.stresses) for name, one in _closest(solution))
    yield from control_tables(_details(solution))


def _notes(solution: Solution, seconds: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    outcomes = solution.outcomes
    yield from (("path", note) for note in solution.path_notes)
    chosen = {
        name: outcome.statistics.integrator for name, outcome in outcomes.items() if outcome.analysis.is_integrated
    }
    yield from (("integrator", line) for line in integrator_lines(chosen))
    for name, outcome in outcomes.items():
        if isinstance(outcome.details, InvertedPath):
            yield "motors only", f"{name}: {_inversion(outcome, outcome.details)}"
    if solution.mode_choice is not None:
        yield "modes", chosen_modes(solution.model.bodies, solution.mode_choice)
    if solution.divided:
        yield "pieces", pieces_in_words(solution.divided)
    elif (raised := raised_in_words(solution.model)) and any(one.analysis.is_integrated for one in outcomes.values()):
        yield "modes", raised
    yield from (("links", remark) for remark in remarks_on_parts(solution.bodies) + rigid_in_words(solution.bodies))
    yield "accuracy", "\n".join(error_budget(solution))
    yield "wall time", ", ".join(f"{stage} {value:.2f} s" for stage, value in seconds.items())
    if solution.omissions:
        yield "omitted", "; ".join(solution.omissions)


def _inversion(outcome: PlanarOutcome, found: InvertedPath) -> str:
    """What the zeros are, how the path was inverted, and what that leaves of it."""
    inversion = found.inversion
    linear, factor = inversion.linearisation, inversion.servo.factor
    error = np.abs(path_error(inversion, outcome.time, outcome.q)).max()
    left = f"largest error of the path {error:.2g}"
    if is_minimum_phase(linear):
        output = "the path's own points" if factor == 1 else f"the output with {factor:.2g} times the vibration"
        return f"{output}: minimum phase, integrated forward; {left}"
    return (
        f"not minimum phase, zeros at {describe_zeros(linear)} 1/s; stable inversion with"
        f" {found.pre_actuation:.3g} s of pre- and {found.post_actuation:.3g} s of post-actuation"
        f" (start off rest by {inversion.off_rest:.1g}); {left}"
    )


def _analyses(solution: Solution) -> Table:
    table = plain_table(
        "analysis", "kind", "integrator", "end (s)", "steps", "tolerance", "constraint\nviolation", "wall (s)"
    )
    for name, outcome in solution.outcomes.items():
        analysis, run, reached = outcome.analysis, outcome.statistics, outcome.time[-1]
        integrated = analysis.is_integrated
        table.add_row(
            name,
            analysis.kind,
            run.integrator.in_words if integrated else "",
            f"{reached:g}" if run.status == "completed" else f"{reached:g} of {analysis.last_time:g}",
            f"{run.steps}" if integrated else "",
            f"{analysis.tolerance:.0e}" if integrated else "",
            _violation(outcome),
            f"{run.wall_seconds:.3f}",
        )
    return table


def _voltages(solution: Solution) -> Table:
    return voltage_table(
        (name, body, solution.patches[body], values)
        for name, result in solution.analyses.items()
        for body, values in (result.closer or result).voltages.items()
    )


def _violation(outcome: PlanarOutcome) -> str:
    """The largest of position, velocity and acceleration level."""
    return f"{outcome.residual.max():.0e}" if outcome.residual.size else ""
