"""Many runs of one scene with keys varied: plan, folders of the runs, processes, table."""

from __future__ import annotations

from .runs import missing_columns
from .sweep import Sweep, drop_results, forget_failures, plan_sweep, print_table, run_sweep, stale_rows

__all__ = [
    "Sweep", "drop_results", "forget_failures", "missing_columns", "plan_sweep", "print_table", "run_sweep",
    "stale_rows",
]  # fmt: skip
