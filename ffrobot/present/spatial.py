"""What a solve of a scene in space prints at its end."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from rich.console import Console
from rich.table import Table

from ..common.peaks import largest
from ..results.verdict import Verdict
from ..run.spatial_solution import SpatialSolution
from .accuracy import error_budget
from .control import control_lines, control_tables
from .lines import alike, integrator_lines, warning_lines
from .modes import chosen_modes, pieces_in_words
from .stresses import stress_table
from .tables import plain_table
from .voltages import voltage_table


def print_spatial_summary(
    solution: SpatialSolution, verdict: Verdict, path: Path, seconds: Mapping[str, float], console: Console
) -> None:
    """Tables of analyses, motors and patches, warnings and notes, whether it can be done, wall times, the file."""
    table = plain_table("analysis", "kind", "status", "integrator", "steps", "evaluations", "constraint\nviolation")
    motors = plain_table("analysis", "motor", "largest", "unit")
    units = {joint.name: joint.units for joint in solution.scene.joint}
    for name, result in solution.analyses.items():
        run, how = result.run, result.run.statistics
        off = f"{result.motion.violation.max(initial=0.0):.1e}"
        counts = f"{how.steps}", f"{how.evaluations}"
        table.add_row(name, run.analysis.kind, run.status, how.integrator.in_words, *counts, off)
        motion = (result.closer or result).motion
        found = motion.motor_forces
        for joint, moments in {} if found is None else found.moments.items():
            for unit, values in zip(units[joint], moments.T, strict=True):
                motors.add_row(name, joint, f"{largest(motion.time, values)[0]:.5g}", "N·m" if unit == "rad" else "N")
    console.print(table)
    if motors.row_count:
        console.print()
        console.print(motors)
    details = {name: result.run.details for name, result in solution.analyses.items()}
    for table in control_tables(details):
        console.print()
        console.print(table)
    closest = {name: one.closer or one for name, one in solution.analyses.items()}
    voltages = voltage_table(
        (name, layout, array, result.actuation.voltages[layout])
        for name, result in closest.items()
        if result.actuation is not None
        for of_link in solution.patches.values()
        for layout, array in of_link.arrays.items()
    )
    stresses = stress_table((name, one.run.time, one.stresses) for name, one in closest.items())
    for table in (voltages, stresses):
        if table.row_count:
            console.print()
            console.print(table)
    bending = {name: result.bending for name, result in solution.analyses.items()}
    for line in warning_lines(bending, {name: result.warnings for name, result in solution.analyses.items()}):
        console.print(f"warning    {line}")
    for line in alike((name, text) for name, result in solution.analyses.items() for text in result.notes):
        console.print(f"note       {line}")
    notes = Table.grid(padding=(0, 2))
    for one in verdict.analyses:
        if one.answer:
            notes.add_row("verdict", f"{one.name}: {one.answer}")
        for text in (*([one.margins] if one.margins else []), *(f"to try: {text}" for text in one.advice)):
            notes.add_row("", f"{one.name}: {text}")
    runs = {name: one.run for name, one in solution.analyses.items() if one.analysis.is_integrated}
    for line in integrator_lines({name: run.statistics.integrator for name, run in runs.items()}):
        notes.add_row("integrator", line)
    notes.add_row("accuracy", "\n".join(error_budget(solution)))
    for line in control_lines(details):
        notes.add_row("linear", line)
    for note in solution.path_notes:
        notes.add_row("path", note)
    if solution.mode_choice is not None:
        bodies = [body.spatial for body in solution.bodies.values()]
        notes.add_row("modes", chosen_modes(bodies, solution.mode_choice))
    if solution.divided:
        notes.add_row("pieces", pieces_in_words(solution.divided))
    for note in solution.notes:
        notes.add_row("links", note)
    if solution.omissions:
        notes.add_row("omitted", "; ".join(solution.omissions))
    notes.add_row("time", ", ".join(f"{stage} {value:.2f} s" for stage, value in seconds.items()))
    console.print()
    console.print(notes)
    console.print(f"results    {path}", soft_wrap=True)
