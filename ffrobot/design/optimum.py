"""The best design as it was found: values, limits that are reached with their prices, files, the text of it."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from ..common.arrays import Array, as_floats
from ..common.files import write_atomically
from ..common.tables import TableWriter
from ..present.tables import plain_table
from ..results.verdict import Verdict
from .evaluations import Evaluated
from .local_search import Local
from .optimality import Conflict, Optimality
from .problem import KEPT, Problem
from .readings import Reading
from .steps import AIM
from .variables import Space

SHARE = 0.01  # of a limit: the room that prices are told for
COLUMNS = ("what", "name", "start", "best", "low", "high", "reached", "price")


@dataclass(frozen=True)
class Optimum:
    """What a search has found.

    Attributes:
        scene: its file. `problem`, `space`: what was asked for.
        method: the optimiser; `message`: why it ended where that was not at an optimum.
        start, best: designs; of the search that has found the best one. `searches`: all of them.
        optimality: how the best one stands; None without gradients.
        conflict: limits that no design near the best one keeps together; None where it keeps all, or that is not known.
        runs: in all; `failures` of them in words. `tolerance`: of the runs, at most.
        verdict: of the best design.
        best_scene: the scene file of the best design, whole; None where it was not kept.
        designs: the table of all designs with their goals; None likewise.
        tried: these designs, in the order of the search.
    """

    scene: Path
    problem: Problem
    space: Space
    method: str
    start: Evaluated
    best: Evaluated
    optimality: Optimality | None
    conflict: Conflict | None
    message: str
    searches: tuple[Local, ...]
    runs: int
    failures: tuple[str, ...]
    tolerance: float
    verdict: Verdict
    best_scene: Path | None
    designs: Path | None
    tried: tuple[Evaluated, ...]

    @property
    def keys(self) -> tuple[str, ...]:
        """With dots."""
        return tuple(map(".".join, self.space.keys))

    @property
    def values(self) -> tuple[object, ...]:
        """Of the keys, in the best design."""
        return self.space.point(self.best.place)

    @property
    def value(self) -> float:
        """Of the goal that is least or largest."""
        return self.best.readings[0].value

    @property
    def limits(self) -> Array:
        """(m) values of the goals that are limited."""
        return np.array([reading.value for reading in self.best.readings[1:]])

    @property
    def violation(self) -> float:
        """The largest excess of a limit, of the limit; up to 1e-6 the design is `feasible`."""
        return self.problem.violation(self.best.readings)

    @property
    def feasible(self) -> bool:
        """Whether the best design keeps all limits."""
        return self.violation <= KEPT

    @property
    def converged(self) -> bool:
        """Whether gradients say that nothing better is near."""
        return self.optimality is not None and self.optimality.reached(AIM)

    @property
    def prices(self) -> Array:
        """(m) ∂goal/∂limit: the change of the best value for one unit more of each limit; NaN of those not reached."""
        if self.optimality is None:
            return np.full(len(self.problem.limits), np.nan)
        room = np.array([limit.sense / limit.scale for limit in self.problem.limits])
        return as_floats(-self.optimality.limits * room / self.problem.factors(self.best.values)[0])

    @property
    def bound_prices(self) -> Array:
        """(n) ∂goal/∂bound likewise, of the bounds that numbers are at."""
        if self.optimality is None:
            return np.full(len(self.space.variables), np.nan)
        found = -self.optimality.bounds / self.problem.factors(self.best.values)[0]
        pairs = zip(self.space.variables, self.best.place, strict=True)
        return np.array(found / [np.nan if variable.is_catalogue else variable.slope(u) for variable, u in pairs])

    def __str__(self) -> str:
        console = Console(file=io.StringIO(), width=120)
        print_optimum(self, console)
        assert isinstance(console.file, io.StringIO)
        return console.file.getvalue()


def print_optimum(found: Optimum, console: Console) -> None:
    """Goal, keys and limits, what is reached and what that costs, the verdict of the best design, how it was found."""

    def say(text: str) -> None:
        console.print(text, soft_wrap=True, markup=False, highlight=False)

    say(headline(found))
    keys = plain_table("key", "start", "best", "bounds")
    for row in key_rows(found):
        keys.add_row(*row)
    console.print(keys, highlight=False)
    if found.problem.limits:
        limits = plain_table("limit", "start", "best", "")
        for limit in limit_rows(found):
            limits.add_row(*limit[:4])
        console.print(limits, highlight=False)
    console.print()
    for line in remarks(found):
        say(line)
    console.print()
    for line in found.verdict.lines():
        say(line)


def remarks(found: Optimum) -> Iterator[str]:
    """Prices of limits and bounds in words, what to mind, and how the design was found."""
    yield from (f"price      {text}" for text in prices_in_words(found))
    if found.optimality is not None:
        yield from (f"note       {text}" for text in found.optimality.kinks)
    if found.message:
        yield f"note       {found.message}"
    if len(found.searches) > 1:
        yield f"starts     {_starts(found)}"
    if failed := len(found.failures):
        yield f"failed     {failed} of {found.runs} runs, passed over: {found.failures[0]}"
    runs = f"{found.runs} runs with a tolerance of at most {found.tolerance:g}"
    yield f"how        {found.method}, {runs}; {_standing(found)}"


def prices_in_words(found: Optimum) -> Iterator[str]:
    """What a little more room saves, for each limit and bound that is reached."""
    if not found.feasible:
        return
    for limit, price in zip(found.problem.limits, found.prices, strict=True):
        if np.isfinite(price):
            unit = found.best.readings[1 + found.problem.limits.index(limit)].unit
            room = limit.sense * SHARE * limit.scale
            yield f"{limit.goal.text}: {_trade(found, limit.bound, room, price, unit)}"
    for variable, price, u in zip(found.space.variables, found.bound_prices, found.best.place, strict=True):
        if np.isfinite(price):
            bound = variable.low if u < 0.5 else variable.high
            room = (-1.0 if u < 0.5 else 1.0) * SHARE * (abs(bound) or variable.high - variable.low)
            yield f"{variable.name}: {_trade(found, bound, room, price, '')}"


def write_optimum(found: Optimum, path: Path) -> None:
    """Goal, keys and limits with their prices, one line each, as CSV."""
    text = io.StringIO()
    writer = TableWriter(text)
    writer.writerow(COLUMNS)
    problem, starts = found.problem, found.start.values or (np.nan,) * len(found.best.values)
    writer.writerow(["goal", problem.objective.text, starts[0], found.value, "", "", "", ""])
    for variable, price in zip(found.space.variables, found.bound_prices, strict=True):
        bounds = ("", "") if variable.is_catalogue else (variable.low, variable.high)
        for key in variable.keys:
            k = found.space.keys.index(key)
            start = found.space.point(found.start.place)[k]
            writer.writerow(["key", found.keys[k], start, found.values[k], *bounds, *_reached(price)])
    for k, (limit, price) in enumerate(zip(problem.limits, found.prices, strict=True)):
        within = ("", limit.bound) if limit.sense > 0 else (limit.bound, "")
        writer.writerow(["limit", limit.goal.text, starts[k + 1], found.limits[k], *within, *_reached(price)])
    write_atomically(path, text.getvalue().encode(), "table of the optimum", ours=True)


def _reached(price: float) -> tuple[str, object]:
    return ("yes", price) if np.isfinite(price) else ("no", "")


def headline(found: Optimum) -> str:
    """The best value and what it saves, or that no design keeps all limits."""
    word = "least" if found.problem.sense > 0 else "largest"
    text = f"{word} {found.problem.objective.text}: {_value(found.best.readings[0])}"
    if found.start.completed and (own := found.start.values[0]):
        text += f", {100 * (found.value - own) / abs(own):+.4g} % of the start's {own:.6g}"
    return text if found.feasible else f"no design found that keeps all limits; nearest is one with {text}"


def key_rows(found: Optimum) -> Iterator[tuple[str, str, str, str]]:
    """Of each key its name, where the search began, its best value, and its bounds."""
    start, best = found.space.point(found.start.place), found.values
    for variable in found.space.variables:
        for key in variable.keys:
            k = found.space.keys.index(key)
            bounds = f"{len(variable.rows)} rows" if variable.is_catalogue else f"{variable.low:g} to {variable.high:g}"
            yield found.keys[k], _number(start[k]), _number(best[k]), bounds


def limit_rows(found: Optimum) -> Iterator[tuple[str, str, str, str, str]]:
    """Of each limit its text, the goal at first and in the best design, whether it is reached, its price."""
    for k, (limit, price) in enumerate(zip(found.problem.limits, found.prices, strict=True)):
        cost = f"{price:.4g}" if np.isfinite(price) else ""
        yield limit.text, _at(found.start, k + 1), _at(found.best, k + 1), _state(found, k), cost


def _state(found: Optimum, k: int) -> str:
    limit, value = found.problem.limits[k], found.limits[k]
    excess = limit.sense * (value - limit.bound) / limit.scale
    if excess > KEPT:
        return f"exceeded by {100 * excess:.3g} %"
    return "active" if found.optimality is not None and np.isfinite(found.optimality.limits[k]) else "satisfied"


def _trade(found: Optimum, bound: float, room: float, price: float, unit: str) -> str:
    """`20.2 N in place of 20 saves 0.012 kg (0.5 %)`."""
    gained = abs(price * room)
    verb = "saves" if found.problem.sense > 0 else "gains"
    of = f" {found.best.readings[0].unit}".rstrip()
    share = f" ({100 * gained / abs(found.value):.3g} %)" if found.value else ""
    return f"{bound + room:.6g}{f' {unit}' if unit else ''} instead of {bound:g} {verb} {gained:.4g}{of}{share}"


def _starts(found: Optimum) -> str:
    """How many of the searches end at the best design."""
    ends = [one.best.values[0] for one in found.searches if one.best.completed]
    near = sum(abs(end - found.value) <= AIM * abs(found.value) for end in ends)
    worst = max((found.problem.sense * end for end in ends), default=np.nan) * found.problem.sense
    return f"{near} of {len(found.searches)} end at this value, within {AIM:g}; the worst at {worst:.6g}"


def _standing(found: Optimum) -> str:
    """How near to an optimum it is."""
    if found.optimality is None:
        return "the best of the designs that were tried"
    stands = found.optimality
    return (
        f"{'converged' if found.converged else 'not converged'}: the gradient of the Lagrangian is"
        f" {stands.residual:.1g} of the objective over the range of a parameter, known to {stands.gradient_error:.1g}"
    )


def _at(design: Evaluated, k: int) -> str:
    return _value(design.readings[k]) if design.completed else "failed"


def _value(reading: Reading) -> str:
    return f"{reading.value:.6g}{' ' if reading.unit else ''}{reading.unit}"


def _number(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
