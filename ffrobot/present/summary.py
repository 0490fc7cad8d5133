"""Summary at the end of a solve: answers of all analyses, loads of motors, warnings, on one screen."""

from collections.abc import Iterable, Iterator, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING

from ..mbs.quantities.attachment_error import JOLT
from ..mbs.quantities.validity import largest
from ..results.verdict import ROUND_OFF, AnalysisVerdict, Verdict, millimeters, motor_texts
from ..run.result import AnalysisResult, Solution
from .lines import alike, folded

if TYPE_CHECKING:
    from ..actuation.motors import MotorFeasibility

VIBRATION = "vibration"
LINES = 15  # that a summary has at most
MOTORS = 6  # rows of motors for which analyses make room
TEXTS, MOST_TEXTS = 2, 5  # lines of warnings and advice, for which analyses and motors make room
REST = "--verbose"
LABEL = 11  # columns of "warning", "to try" and the like

ANALYSES = ("analysis", "kind", "answer", "tip error, controlled", "tip error, open loop", "link deflection", "remark")
MOTOR = ("motor", "peak", "RMS", "speed", "power", "of limits", "in")

Row = tuple[str, ...]


def summary_lines(
    verdict: Verdict, notes: Sequence[str], accuracy: str, results: str, width: int, printed: int = 0
) -> list[str]:
    """Return the lines of a summary, `width` columns wide, at most `LINES` with those already `printed`.

    Omitted lines are counted. `notes` follow warnings; `accuracy` and the name of the file of `results` are last.
    """
    of_analyses = [_analysis(one) for one in verdict.analyses]
    remarks: list[str] = []
    beside = [(row[0], row[-1]) for row in of_analyses if row[-1]]
    if beside and max(map(len, _aligned([ANALYSES, *of_analyses]))) > width:  # the last column moves below
        remarks = list(_labelled("remark", ["; ".join(alike(beside))]))
        of_analyses = [(*row[:-1], "") for row in of_analyses]
    texts = [*_texts(verdict, remarks), *_labelled("note", folded(notes))]
    wanted = min(sum(len(_wrapped(text, width)) for text in texts), MOST_TEXTS)
    completed = [one for one in verdict.analyses if one.status == "completed"]
    judged = [one for one in completed if one.feasible is not None or one.kind == "closed-loop"]  # others replay
    judged = judged or list(verdict.analyses)
    motors = [_motor(name, motor, one) for one in judged for name, motor in one.motors.items()]
    worst = list(_worst_motors(judged))
    room = LINES - printed - 3 - bool(motors)  # without both headers, accuracy, results
    for_motors = min(len(worst), MOTORS, (room + 1) // 2)
    analyses = _at_most(of_analyses, room - for_motors - min(len(texts), TEXTS))
    room -= len(analyses)
    rows = _at_most(motors if len(motors) + wanted <= room else worst, max(for_motors, room - wanted))
    lines = _aligned([ANALYSES, *analyses]) + (_aligned([MOTOR, *rows]) if rows else [])
    lines += fitted(texts, room - len(rows), width)
    lines += fitted([f"accuracy   {accuracy}"], LINES - printed - 1 - len(lines), width)
    return [_cut(line.rstrip(), width) for line in lines] + [f"results    {results}"]


def _analysis(one: AnalysisVerdict) -> Row:
    error, deflection = one.tool_error, one.deflection
    unstable = f", grows {error.growth:.2g} 1/s" if error.growth else ""
    return (
        one.name,
        one.kind,
        one.in_short,
        _length(error.controlled),
        _length(error.open_loop) + unstable,
        _length(None if deflection is None else deflection[0]),
        _remark(one),
    )


def _remark(one: AnalysisVerdict) -> str:
    if one.status != "completed":
        return f"{one.status} at {one.reached_in_words} s"
    name, factor = one.worst
    _, saturated, _ = one.answer.rpartition(", ")[2].partition(" % of the samples saturated")
    texts = (
        one.answer.partition("; ")[2] if one.feasible else "",
        f"{name} {_percent(factor)} of limits" if factor and one.feasible is not None else "",
        one.answer.rpartition(", ")[2] if saturated else "",
    )
    return "; ".join(filter(None, texts))


def _worst_motors(judged: Sequence[AnalysisVerdict]) -> Iterator[Row]:
    """Every motor in the analysis that asks most of it, the motors in the order of the scene."""
    for name in dict.fromkeys(name for one in judged for name in one.motors):
        having = [one for one in judged if name in one.motors]
        most = max(having, key=lambda one: (one.motors[name].factor, one.motors[name].moment))
        yield _motor(name, most.motors[name], most)


def _motor(name: str, motor: "MotorFeasibility", one: AnalysisVerdict) -> Row:
    share = _percent(motor.factor) if motor.has_limits else "none"
    return name, *motor_texts(motor, one.units[name]), share, one.name


def _texts(verdict: Verdict, remarks: Sequence[str]) -> Iterator[str]:
    warnings = ((one.name, text) for one in verdict.analyses for text in one.warnings)
    advice = ((one.name, text) for one in verdict.analyses for text in one.advice)
    yield from _labelled("warning", alike(warnings))
    yield from _labelled("to try", alike(advice))
    settled = ((one.name, one.settled.in_words) for one in verdict.analyses if one.settled is not None)
    yield from _labelled(VIBRATION, alike(settled))
    yield from remarks
    yield from _labelled("at rest", alike((one.name, one.at_rest) for one in verdict.analyses if one.at_rest))
    yield from _labelled("note", alike((one.name, text) for one in verdict.analyses for text in one.notes))


def _labelled(label: str, texts: Iterable[str]) -> Iterator[str]:
    yield from (f"{label:<{LABEL}}{text}" for text in texts)


def fitted(texts: Sequence[str], room: int, width: int) -> list[str]:
    """Wrap texts, which begin with labels, into `room` lines of `width` columns; the rest is counted.

    The first text of each label has priority, vibrations are last. A long first text is cut for a second one.
    """
    if not texts or room < 1:
        return []
    labels = [text[:LABEL] for text in texts]
    order = sorted(range(1, len(texts)), key=lambda k: labels[k].startswith(VIBRATION) or labels[k] in labels[:k])
    beside = len(_wrapped(texts[order[0]], width)) if order else 0
    free = room - beside if beside <= room - 2 else room
    ends_early = len(_wrapped(_counted(texts[0], len(texts) - 1), width)) > free

    def laid_out(shown: Sequence[int]) -> list[str]:
        left = len(texts) - len(shown)
        blocks = [_wrapped(texts[k] if k < shown[-1] else _counted(texts[k], left), width) for k in shown]
        if ends_early:
            *whole, last = _wrapped(texts[0], width)[:free]
            ending = f" (in full: {REST})"
            blocks[0] = [*whole, wrap(last, width - len(ending))[0] + ending]
        return [line for block in blocks for line in block]

    shown = [0]
    for k in order:
        if len(laid_out(tried := sorted([*shown, k]))) <= room:
            shown = tried
    return laid_out(shown)


def _counted(text: str, left: int) -> str:
    return f"{text} (+{left} more: {REST})" if left else text


def _wrapped(text: str, width: int) -> list[str]:
    return wrap(text, width, subsequent_indent=" " * LABEL, break_long_words=False)


def _at_most(rows: Sequence[Row], room: int) -> list[Row]:
    room = max(room, 1)
    if len(rows) <= room:
        return list(rows)
    return [*rows[: room - 1], (f"{len(rows) - room + 1} more: {REST}", *[""] * (len(rows[0]) - 1))]


def _aligned(rows: Sequence[Row]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    shown = [k for k, of in enumerate(zip(*rows[1:], strict=True)) if any(of)]
    return ["  ".join(row[k].ljust(widths[k]) for k in shown) for row in rows]


def _cut(line: str, width: int) -> str:
    return line if len(line) <= width else f"{line[: width - 1]}…"


def _length(value: float | None) -> str:
    return "" if value is None else millimeters(value, 3)


def _percent(factor: float) -> str:
    return f"{100 * factor if factor > ROUND_OFF else 0:.3g} %" if factor < 10.0 else f"{factor:.3g} ×"


NOT_ESTIMATED = "not estimated"
RESOLVED = 0.3  # largest meaningful estimated error of modes


def error_budget(solution: Solution) -> Iterator[str]:
    """Yield a line on each estimated error: time integration, modes, linear deflection, patches."""
    results, analyses = integrated(solution), solution.analyses
    if aims := [result.analysis.tolerance for result in results]:
        asked = " … ".join(f"{aim:.0e}" for aim in sorted({min(aims), max(aims)}))
        yield f"time integration: {asked} of peaks, requested tolerance"
    yield f"modes: {_modes(solution, results)}"
    text, worst = "links are rigid", [most for one in analyses.values() if (most := largest(one.bending)) is not None]
    if worst:
        name, link = max(worst, key=lambda item: (item[1].is_beyond, item[1].missing.of_length))
        text = "not small: see the warning" if link.is_beyond else f"{name} {link.in_words}: {link.estimate}"
    yield f"deflection: {text}"
    for name, result in analyses.items():
        if result.check is not None:
            yield f"{name}, {result.check.in_words}"
    layouts = (array for of_link in solution.patches.values() for array in of_link.arrays.values())
    yield from (f"patches of {array.stiffness_in_words}" for array in layouts)


def integrated(solution: Solution) -> list[AnalysisResult]:
    """Return results of the analyses that integrate over time."""
    return [result for result in solution.analyses.values() if result.analysis.is_integrated]


def _modes(solution: Solution, results: Sequence[AnalysisResult]) -> str:
    if rigid := [f"{name} in {', '.join(body.rigid_in)}" for name, body in solution.bodies.items() if body.rigid_in]:
        return f"{NOT_ESTIMATED}: rigid without modes: {'; '.join(rigid)}"
    if not solution.links:
        return "links are rigid"
    if solution.mode_choice is not None:
        known = [error for of in solution.mode_choice.errors.values() for error in of.values()]
        return f"{max(known):.0e} of peaks, against all modes of the files" if any(known) else NOT_ESTIMATED
    errors = [result.mode_error for result in results]
    known = [error for error in errors if error is not None]
    if not known or len(known) < len(errors):
        without = [name for name, link in solution.links.items() if not link.residual.any()]
        return f"{NOT_ESTIMATED}: no attachment modes in {', '.join(without)}" if without else NOT_ESTIMATED
    estimate = f"{max(known):.0e} of peaks, estimated"
    if max(known) > RESOLVED:
        estimate = "too few: vibrations above the highest mode are excited"
    if any(result.start_jolt >= JOLT for result in results):
        estimate += "; a start in equilibrium, without a step in acceleration, lowers it"
    return estimate
