"""The table of motors from a catalog that can do what the joints of a robot have to do."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.console import Console

from ..actuation.catalog import Choice, choices, read_catalog
from ..common.errors import InputError, quoted
from ..results.file import Results
from ..results.motor_tasks import joint_tasks
from .tables import print_table

SHOWN = 3  # motors of each joint
COLUMNS = ("motor of", "choice", "ratio", "RMS (N·m)", "of rated", "peak (N·m)", "of peak", "speed (rad/s)", "of max")


def print_motor_choice(path: Path, catalog: Path, analysis: str | None, console: Console) -> None:
    """The best motors of each joint for each analysis; the nearest one where none fits.

    Raises `InputError` where the catalog is wrong or no analysis has motors.
    """
    motors = read_catalog(catalog)
    with Results(path) as results:
        tasks = {name: dict(joint_tasks(results, name)) for name in results.analyses}
    judged = [name for name, found in tasks.items() if found]
    wanted = judged if analysis is None else [analysis]
    if not wanted or not set(wanted) <= set(judged):
        raise InputError(f"{path}: --analysis: expected an analysis with motors, {quoted(judged)}, found {analysis}")
    for name in wanted:
        console.print(f'analysis "{name}", motors of {catalog}', soft_wrap=True)
        rows = (row for joint, task in tasks[name].items() for row in _rows(joint, choices(task, motors)))
        print_table(console, COLUMNS, rows)
    console.print("at the motor, with its own rotor; solve again with its gear_ratio and rotor_inertia to confirm")


def _rows(joint: str, found: Sequence[Choice]) -> Iterator[tuple[str, ...]]:
    fitting = [choice for choice in found if choice.fits]
    for k, choice in enumerate(fitting[:SHOWN] or found[:1]):
        name = choice.motor.name if choice.fits else f"none; nearest: {choice.motor.name}"
        values = (choice.rms, choice.peak, choice.speed)
        pairs = zip((f"{value:.3g}" for value in values), (f"{100 * x:.0f} %" for x in choice.shares), strict=True)
        yield ("" if k else joint, name, f"{choice.ratio:g}", *(cell for pair in pairs for cell in pair))
