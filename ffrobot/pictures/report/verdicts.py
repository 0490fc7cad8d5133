"""What every run says, as the summary of a solve has it, and tables of closed loops and zeros."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...results.verdict import AnalysisVerdict
from .runs import Run
from .tables import Table

LOOP_KEYS = (
    ("verdict", "verdict", 0.0),
    ("tip error, RMS (mm)", "tip_error_rms", 1e3),
    ("largest (mm)", "tip_error_max", 1e3),
    ("settled (s)", "settling_time", 1.0),
    ("vibration (mm)", "vibration", 1e3),
    ("at the end (mm)", "residual", 1e3),
    ("work (J)", "motor_work", 1.0),
    ("peak torque (N·m)", "peak_moment", 1.0),
    ("largest voltage (V)", "peak_voltage", 1.0),
    ("at limits (% of samples)", "saturated", 100.0),
)
"""Heading, attribute of control/, and what it is multiplied by (0: a word)."""


@dataclass(frozen=True)
class RunVerdict:
    """The verdict of one run, under its name on the page; `mood` is "good", "bad" or "" where nothing is asked."""

    label: str
    verdict: AnalysisVerdict

    @property
    def mood(self) -> str:
        """For its colour."""
        failed = self.verdict.status != "completed"
        return "bad" if failed or self.verdict.feasible is False else "good" if self.verdict.feasible else ""

    @property
    def headline(self) -> str:
        """The answer."""
        first = next(self.verdict.lines())
        return first.removeprefix(f"{self.verdict.name}: ")

    @property
    def facts(self) -> list[str]:
        """The lines below it."""
        return [line.strip() for line in list(self.verdict.lines())[1:]]


def verdicts(runs: Sequence[Run]) -> list[RunVerdict]:
    """Of all runs, in order."""
    return [RunVerdict(run.label, run.results.verdict[run.analysis]) for run in runs]


def loops_table(runs: Sequence[Run]) -> Table:
    """Closed loops, one row each."""
    rows = []
    for run in runs:
        if run.results.has(f"{run.analysis}/control/commands"):
            about = run.results.attributes(f"{run.analysis}/control")
            cells = (f"{scale * about[key]:.4g}" if scale else str(about[key]) for _, key, scale in LOOP_KEYS)
            rows.append((run.label, *("no" if cell == "nan" else cell for cell in cells)))
    return Table(("closed loop", *(heading for heading, _, _ in LOOP_KEYS)), rows)


def zeros_table(runs: Sequence[Run]) -> Table:
    """How the paths of motors-only analyses were inverted, and the zeros nearest to instability."""
    rows = []
    for run in runs:
        group = f"{run.analysis}/zero_dynamics"
        if run.results.has(group):
            about, zeros = run.results.attributes(group), run.results[f"{group}/zeros"]
            kind = "minimum phase" if about["minimum_phase"] else "not minimum phase: stable inversion"
            largest, least = zeros[..., 0].max(), abs(zeros[..., 0]).min()
            rows.append((run.label, kind, f"{about['factor']:.3g}", f"{largest:.4g}", f"{least:.4g}"))
    heading = ("motors only", "zeros along the path", "of the vibration in the output", "largest real part (1/s)",
               "nearest to the axis (1/s)")  # fmt: skip
    return Table(heading, rows)
