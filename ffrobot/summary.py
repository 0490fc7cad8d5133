"""What a solve prints at its end, and what `ffrobot info` says of a file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from rich.console import Console
from rich.table import Table

from .mbs.analyses import Outcome
from .solve import Solution


def print_summary(solution: Solution, path: Path, seconds: Mapping[str, float], console: Console) -> None:
    """Tables of the analyses and voltages, wall time per stage, what was skipped, and where the results are."""
    analyses = Table("analysis", "kind", "t (s)", "steps", "evaluations", "constraint violation", "status", "wall (s)")
    for name, outcome in solution.outcomes.items():
        analyses.add_row(
            name,
            outcome.analysis.kind,
            f"{outcome.time[-1]:g}",
            f"{outcome.steps}",
            f"{outcome.evaluations}",
            _violation(outcome),
            outcome.status,
            f"{outcome.wall_seconds:.3f}",
        )
    console.print(analyses)
    voltages = Table("analysis", "patches on", "required at most (V)", "limit (V)", "times the limit", "cond Φ_V")
    for name, by_body in solution.voltages.items():
        for body, values in by_body.items():
            patches = solution.patches[body]
            limit = patches.limit
            voltages.add_row(
                name,
                body,
                f"{values.largest:.4g}",
                "none" if limit is None else f"{limit:g}",
                "" if limit is None else f"{values.largest / limit:.3g}",
                f"{patches.condition_number:.3g}",
            )
    if voltages.row_count:
        console.print(voltages)
    tolerance = ", ".join(
        f"{name} {outcome.analysis.tolerance:g}"
        for name, outcome in solution.outcomes.items()
        if outcome.analysis.kind != "static"
    )
    if tolerance:
        console.print(f"error aimed at, relative to the peak of each reported quantity: {tolerance}", highlight=False)
    console.print("wall time: " + ", ".join(f"{k} {v:.2f} s" for k, v in seconds.items()), highlight=False)
    if solution.skipped:
        console.print("skipped: " + "; ".join(solution.skipped), highlight=False)
    console.print(f"results: {path}", highlight=False, soft_wrap=True)


def _violation(outcome: Outcome) -> str:
    if outcome.residual.size == 0:
        return "–"
    return " / ".join(f"{value:.0e}" for value in outcome.residual.max(axis=0))
