"""What a solve prints with `--verbose`: everything that its summary leaves out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from ..actuation.patches.patches import PatchArray, Voltages
from ..common.arrays import Array
from ..mbs.analysis.motors_only import AroundPath, describe_zeros, is_minimum_phase
from ..mbs.analysis.outcome import Details, Outcome
from ..mbs.model.body import Body
from ..mbs.model.model import path_errors
from ..mbs.model.truncation import modes_kept
from ..mbs.quantities.stress import BodyStress
from ..results.verdict import Verdict
from ..run.mode_search import ModeChoice
from ..run.solution import AnalysisResult, Solution
from ..scene.pieces import BodyInPieces
from .control import control_lines, control_tables
from .lines import alike, error_budget, integrated, integrator_lines, plain_table, warning_lines


def print_details(
    solution: Solution, verdict: Verdict, path: Path, seconds: Mapping[str, float], console: Console
) -> None:
    """Tables of the analyses and what they found, wall time per stage, what was skipped, where the results are."""
    console.print(_analyses(solution, verdict))
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
    error = max(float(np.abs(off).max(initial=0.0)) for off in path_errors(around.held, run.time, run.q).values())
    left = f"largest error of the path {error:.2g}"
    if is_minimum_phase(linear):
        output = "the path's own points" if factor == 1 else f"the output with {factor:.2g} times the vibration"
        return f"{output}: minimum phase, integrated forward; {left}"
    return (
        f"not minimum phase, zeros at {describe_zeros(linear)} 1/s; stable inversion with"
        f" {around.pre_actuation:.3g} s of pre- and {around.post_actuation:.3g} s of post-actuation"
        f" (start off rest by {inversion.off_rest:.1g}); {left}"
    )


def _analyses(solution: Solution, verdict: Verdict) -> Table:
    table = plain_table(
        "analysis",
        "kind",
        "integrator",
        "end (s)",
        "steps",
        "evaluations",
        "tolerance",
        "constraint\nviolation",
        "wall (s)",
    )
    for name, result in solution.analyses.items():
        analysis, run, is_integrated = result.analysis, result.run.statistics, result.analysis.is_integrated
        table.add_row(
            name,
            analysis.kind,
            run.integrator.in_words if is_integrated else "",
            verdict[name].reached_in_words,
            f"{run.steps}" if is_integrated else "",
            f"{run.evaluations}" if is_integrated else "",
            f"{analysis.tolerance:.0e}" if is_integrated else "",
            f"{result.motion.violation.max(initial=0.0):.0e}",
            f"{run.wall_seconds:.3f}",
        )
    return table


def voltage_table(found: Iterable[tuple[str, str, PatchArray, Voltages]]) -> Table:
    """Of analyses and layouts, by name, with their patches."""
    table = plain_table("voltages of", "on", "largest (V)", "limit (V)", "required /\nlimit", "condition\nnumber")
    for analysis, layout, patches, values in found:
        limit = patches.limit.min()
        table.add_row(
            analysis,
            layout,
            f"{values.largest:.0f}" if values.largest >= 1e3 else f"{values.largest:.3g}",
            "none" if limit == np.inf else f"{limit:g}",
            "" if limit == np.inf else f"{np.abs(values.required / patches.limit).max():.3g}",
            f"{patches.condition_number:.3g}",
        )
    return table


def stress_table(analyses: Iterable[tuple[str, Array, Mapping[str, BodyStress]]]) -> Table:
    """Of each analysis its name, times (T,) in s, and stresses by body."""
    table = plain_table("stress in", "of", "largest von Mises (MPa)", "at", "t (s)", "by")
    for name, time, stresses in analyses:
        for body, stress in stresses.items():
            value, k, place = stress.largest()
            table.add_row(name, body, f"{value / 1e6:.4g}", place, f"{time[k]:g}", stress.recovery.method)
    return table


def chosen_modes(bodies: Sequence[Body], choice: ModeChoice) -> str:
    """How many modes were enough, and what leaving out the others costs and saves."""
    kept = [f"{body.name}: {modes_kept(body)}" for body in bodies if body.n_modes]
    lines = ["; ".join(kept)]
    for name, errors in choice.errors.items():
        if any(errors.values()):
            found = ", ".join(f"{kind} {error:.0e}" for kind, error in errors.items() if error)
            lines.append(f"{name}: error of leaving out the others, estimated: {found}")
        else:
            lines.append(
                f"{name}: with fewer ({choice.tried[-2]}) results differ by {max(choice.before[name].values()):.0e}"
            )
    tried = ", ".join(map(str, choice.tried))
    fewer = {body.name: body.reduction.lowest for body in bodies if body.reduction is not None}
    if fewer:
        keys = ", ".join(f"modes = {lowest} for {name}" for name, lowest in fewer.items())
        lines.append(f"the same without search: {keys}")
    lines.append(
        f"solved with {tried} modal coordinates, {choice.seconds:.2f} s before the last; the highest frequency is"
        f" {choice.highest[0]:.3g} of {choice.highest[1]:.3g} rad/s"
    )
    return "\n".join(lines)


def pieces_in_words(divided: Mapping[str, BodyInPieces]) -> str:
    """How many of each link."""
    return ", ".join(f"{name}: {len(body.names)}" for name, body in divided.items())
