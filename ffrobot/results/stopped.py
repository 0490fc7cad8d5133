"""What of a run that was stopped can be gone on with, and what messages say of it."""

from __future__ import annotations

from ..common.arrays import Array
from ..common.errors import InputError
from ..mbs.analysis.outcome import Outcome
from ..run.refinement import goes_on
from ..run.solution import Solution
from .file import Results

GROUP = "resume"  # in the group of an analysis
STOPPED = ("interrupted", "too many steps", "not evaluated")


def how_to_go_on(solution: Solution, command: str) -> str:
    """What a message about a run that was stopped adds; empty where it cannot be gone on with."""
    outcome = stopped(solution)
    if outcome is None:
        return "".join(f'; {command} resumes with "{name}"' for name in left_out(solution)[:1])
    if goes_on(solution, outcome):
        return f"; {command} resumes from t = {outcome.time_reached:.9g} s"
    return f'; {command} runs "{outcome.analysis.name}" again from its start'


def left_out(solution: Solution) -> list[str]:
    """Analyses that were not begun when the run was stopped, or ended by an error."""
    if any(outcome.failed and outcome.status not in STOPPED for outcome in solution.outcomes.values()):
        return []
    return [name for name in analyses(solution) if name not in solution.outcomes]


def is_kept(solution: Solution) -> bool:
    """Whether there is something to go on with."""
    return stopped(solution) is not None or bool(left_out(solution))


def stopped(solution: Solution) -> Outcome | None:
    """The analysis that was stopped."""
    return next((outcome for outcome in solution.outcomes.values() if outcome.status in STOPPED), None)


def analyses(solution: Solution) -> list[str]:
    """Names of all that the scene asks for."""
    return [analysis.name for analysis in solution.scene.analysis]


def row_of_numbers(file: Results, name: str) -> Array:
    """A dataset (k,) of what was kept. Raises `InputError` where it is something else."""
    values = file[name]
    if values.ndim != 1:
        raise InputError(f"{file.path}: {name}: expected a row of numbers, found an array of shape {values.shape}")
    return values
