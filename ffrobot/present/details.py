"""Output of a solve with `--verbose`: all that its summary omits."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from rich.console import Console
from rich.table import Table

from ..actuation.control.linear import LinearModels
from ..actuation.control.loop import LoopRecord
from ..actuation.control.metrics import DEFINITIONS
from ..common.arrays import Array
from ..mbs.analysis.operating_points import RobotAtRest
from ..mbs.inversion.motors_only import AroundPath, describe_zeros, is_minimum_phase
from ..mbs.inversion.zero_dynamics import is_unstable
from ..mbs.linear.joint_conditions import translational_stiffness
from ..mbs.model.body import Body
from ..mbs.model.truncation import modes_kept
from ..mbs.quantities.validity import deflection_warning
from ..mbs.run.integrators import ASKED_FOR
from ..mbs.run.record import Details, Run
from ..results.file import Results
from ..results.tables import Cells, analysis_cells, loop_cells, placement_cells, settling_cells, voltage_cells
from ..run.result import AnalysisResult, ModeChoice, Solution
from .lines import alike, folded, named_tables, tables_of
from .summary import error_budget, integrated

OF_FILE = ("status", "outputs", "rejected")  # of analyses: for the table of a report alone


def print_details(solution: Solution, results: Results, console: Console) -> None:
    """Print tables of analyses and their results, wall time per stage, skipped parts, and paths of files."""
    rows = ((name, cells) for name in results.analyses for cells in analysis_cells(results, name))
    shown = ((name, {key: text for key, text in cells.items() if key not in OF_FILE}) for name, cells in rows)
    for table in named_tables("analysis", shown):
        console.print(table, crop=False)
    for line in _warnings(solution.analyses):
        console.print(f"warning    {line}")
    for line in alike((name, text) for name, result in solution.analyses.items() for text in result.notes):
        console.print(f"note       {line}")
    for table in _tables(solution, results):
        console.print()
        console.print(table, crop=False)
    console.print()
    for line in results.verdict.lines():
        console.print(line)
    for line in _control_lines(_details(solution)):
        console.print(line)
    notes = Table.grid(padding=(0, 2))
    for note in _notes(solution):
        notes.add_row(*note)
    console.print()
    console.print(notes)
    console.out(f"results    {results.path}")


def _warnings(analyses: Mapping[str, AnalysisResult]) -> Iterator[str]:
    """Warnings of all analyses; deflection warnings in full for the worst analysis only."""
    bent = {name: text for name, result in analyses.items() if (text := deflection_warning(result.bending))}
    if bent:
        worst = max(bent, key=lambda name: max(link.missing.of_length for link in analyses[name].bending.values()))
        others = [name for name in bent if name != worst]
        yield f"{worst}: {bent[worst]}" + (f" (likewise, but less: {', '.join(others)})" if others else "")
    texts = ((name, text) for name, result in analyses.items() for text in result.warnings)
    yield from alike((name, text) for name, text in texts if text != bent.get(name))


def _details(solution: Solution) -> dict[str, Details]:
    return {name: result.run.details for name, result in solution.analyses.items()}


def _tables(solution: Solution, results: Results) -> Iterator[Table]:
    tables = {"voltages of": voltage_cells, "residual vibration": settling_cells, "closed loop": loop_cells}
    for first, cells_of in (tables | {"placement": placement_cells}).items():
        yield from tables_of(results, first, cells_of)
    stresses = (row for name, result in solution.analyses.items() for row in _stresses(name, result))
    yield from named_tables("stress in", stresses)
    details = _details(solution).items()
    linear = (row for name, one in details if isinstance(one, LinearModels) for row in _linear(name, one))
    yield from named_tables("linear model", linear)
    at_rest = ((name, one) for name, one in details if isinstance(one, LinearModels | RobotAtRest))
    yield from named_tables("joints", (row for of_one in at_rest for row in _conditions(*of_one)))


def _notes(solution: Solution) -> Iterator[tuple[str, str]]:
    runs = {result.analysis.name: result.run for result in integrated(solution)}
    yield from (("path", note) for note in folded(solution.path_notes))
    chosen = ((name, run.statistics.integrator) for name, run in runs.items())
    said = alike((name, f"{one.in_words}; {one.reason}") for name, one in chosen if one.reason != ASKED_FOR)
    yield from (("integrator", line) for line in said)
    for name, run in runs.items():
        if isinstance(run.details, AroundPath) and run.details.inversion is not None:
            yield "motors only", f"{name}: {_inversion(run, run.details)}"
    if solution.mode_choice is not None:
        yield "modes", _chosen_modes([body.spatial for body in solution.bodies.values()], solution.mode_choice)
    if solution.divided:
        yield "pieces", ", ".join(f"{name}: {len(body.names)}" for name, body in solution.divided.items())
    yield from (("links", note) for note in solution.notes)
    yield "accuracy", "\n".join(error_budget(solution))
    yield "wall time", ", ".join(f"{stage} {value:.2f} s" for stage, value in solution.seconds.items())
    if solution.omissions:
        yield "omitted", "; ".join(solution.omissions)


def _inversion(run: Run, around: AroundPath) -> str:
    inversion = around.inversion
    assert inversion is not None
    linear, factor = inversion.linearisation, inversion.servo.factor
    error = max(float(np.abs(off).max(initial=0.0)) for off in around.held.path_errors(run.time, run.q).values())
    left = f"largest error of the path {error:.2g}"
    if is_minimum_phase(linear):
        output = "the path's own points" if factor == 1 else f"the output with {factor:.2g} times the vibration"
        phase = "minimum phase"
        if is_unstable(linear.zeros).any():
            phase += f" at rest, zeros of up to {linear.zeros.real.max():.2g} 1/s on the way grow too little to matter"
        return f"{output}: {phase}, integrated forward; {left}"
    return (
        f"not minimum phase, zeros at {describe_zeros(linear)} 1/s; stable inversion with"
        f" {around.pre_actuation:.3g} s of pre- and {around.post_actuation:.3g} s of post-actuation"
        f" (start off rest by {inversion.off_rest:.1g}); {left}"
    )


def _stresses(name: str, result: AnalysisResult) -> Iterator[tuple[str, Cells]]:
    for body, stress in result.histories.stresses.items():
        value, k, place = stress.largest()
        most, at, by = f"{value / 1e6:.4g}", f"{result.histories.run.time[k]:g}", stress.recovery.method
        yield name, {"of": body, "largest von Mises (MPa)": most, "at": place, "t (s)": at, "by": by}


def _chosen_modes(bodies: Sequence[Body], choice: ModeChoice) -> str:
    lines = ["; ".join(f"{body.name}: {modes_kept(body)}" for body in bodies if body.n_modes)]
    for name, errors in choice.errors.items():
        if any(errors.values()):
            largest = ", ".join(f"{kind} {error:.0e}" for kind, error in errors.items() if error)
            lines.append(f"{name}: error of leaving out the others, estimated: {largest}")
        else:
            lines.append(
                f"{name}: with fewer ({choice.tried[-2]}) results differ by {max(choice.before[name].values()):.0e}"
            )
    fewer = [f"modes = {body.reduction.lowest} for {body.name}" for body in bodies if body.reduction is not None]
    if fewer:
        lines.append(f"the same without search: {', '.join(fewer)}")
    lines.append(
        f"solved with {', '.join(map(str, choice.tried))} modal coordinates, {choice.seconds:.2f} s before the last;"
        f" the highest frequency is {choice.highest[0]:.3g} of {choice.highest[1]:.3g} rad/s"
    )
    return "\n".join(lines)


FREQUENCIES = 5  # that are listed, and damping ratios
TRANSFERS = 3  # motor to output, with listed zeros: those with the slowest to the right
UNDAMPED = 1e-9  # ratios below are round-off


def _linear(name: str, linear: LinearModels) -> Iterator[tuple[str, Cells]]:
    for model, modes in zip(linear.models, linear.modes, strict=True):
        cells = {
            "t (s)": f"{model.time:g}",
            "DOF": f"{model.freedom}",
            "lowest frequencies (Hz)": _lowest(modes.frequency),
            "largest Re(pole)\n(1/s)": f"{modes.growth:.3g}" if modes.growth else "",
        }
        yield name, cells


def _lowest(frequency: Array) -> str:
    return ", ".join(f"{f:.4g}" for f in frequency[frequency > 0.0][:FREQUENCIES])


def _conditions(name: str, at_rest: LinearModels | RobotAtRest) -> Iterator[tuple[str, Cells]]:
    for t, at in zip(at_rest.times, at_rest.conditions, strict=True):
        for condition, state in at.items():
            stiffness = [(point, *_stiffness(C)) for point, C in state.compliance.items()] or [("", "", "")]
            for k, (point, along, least) in enumerate(stiffness):
                cells = {
                    "t (s)": "" if k else f"{t:g}",
                    "natural frequencies (Hz)": "" if k else _lowest(state.modes.frequency) or "none",
                    "at": point,
                    "stiffness along axes\n(N/mm)": along,
                    "least, along": least,
                }
                yield "" if k else f"{name}: {condition}", cells


def _stiffness(compliance: Array) -> tuple[str, str]:
    """Force over displacement along each axis, and the least of any direction, by a (3, 3) or (6, 6) compliance."""
    stiffness = translational_stiffness(compliance)
    if stiffness is None:
        return "0", ""
    along, least, direction = stiffness
    way = ", ".join(f"{x:g}" for x in np.round(direction, 2) + 0.0)
    return ", ".join(f"{k / 1e3:.4g}" for k in along), f"{least / 1e3:.4g} ({way})"


def _control_lines(details: Mapping[str, Details]) -> Iterator[str]:
    loops = {name: record.metrics for name, record in details.items() if isinstance(record, LoopRecord)}
    if loops:
        yield f"closed-loop control: {DEFINITIONS}"
    for name, metrics in loops.items():
        if np.isfinite(metrics.lowest_frequency):
            yield f"{name}: vibration at {metrics.lowest_frequency:.3g} Hz and above"
    for name, record in details.items():
        if isinstance(record, LinearModels):
            yield from _of_linear(name, record)


def _of_linear(name: str, linear: LinearModels) -> Iterator[str]:
    """Damping of frequencies at the first time of an analysis, zeros, modes out of reach."""
    modes = linear.modes[0]
    ratios = modes.damping_ratio[modes.frequency > 0.0][:FREQUENCIES]
    if np.any(np.abs(ratios) > UNDAMPED):
        listed = ", ".join(f"{ratio:.3g}" for ratio in ratios)
        yield f"{name}, t = {linear.models[0].time:g} s: damping ratios {listed}"
    worst = {
        pair: next((zeros for zeros in known if not zeros.minimum_phase), known[0])
        for pair, known in linear.zeros.items()
    }
    alone = sorted(
        (pair for pair in worst if len(pair) == 2), key=lambda pair: np.abs(worst[pair].unstable).min(initial=np.inf)
    )
    shown = [pair for pair in worst if len(pair) > 2 or pair in alone[:TRANSFERS]]
    for pair in shown:
        half = len(pair) // 2
        yield f"{name}: {', '.join(pair[:half])} → {', '.join(pair[half:])}: {worst[pair].describe()}"
    if len(worst) > len(shown):
        yield f"{name}: zeros of {len(worst) - len(shown)} more transfer functions: see linear/zeros in the results"
    for verb, reaches in (("uncontrollable:", linear.controllable), ("unobservable:", linear.observable)):
        for model, reach in zip(linear.models, reaches, strict=True):
            if reach.lost:
                yield f"{name}, t = {model.time:g} s: {verb} {', '.join(reach.lost)}"
