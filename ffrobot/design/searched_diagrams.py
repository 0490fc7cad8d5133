"""Diagrams of the designs that a search has tried: parallel coordinates, and how the goal went."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..pictures.studies.diagrams import Axis, Numbers, Parallel, Progress, State, axis_of_goal
from .evaluations import Evaluated
from .finding import numbers, with_unit
from .problem import KEPT, Limit, Problem
from .variables import Space, Variable


def states_of(problem: Problem, designs: Sequence[Evaluated], best: Sequence[Evaluated]) -> tuple[State, ...]:
    """Of each design, whose readings begin with those of the goals of `problem`."""
    chosen = {one.design.folder for one in best}

    def state(one: Evaluated) -> State:
        if not one.completed:
            return "failed"
        if one.design.folder in chosen:
            return "best"
        return "kept" if problem.violation(one.readings[: len(problem.goals)]) <= KEPT else "exceeded"

    return tuple(map(state, designs))


def parallel(
    space: Space,
    goals: Sequence[tuple[str, Limit | None]],
    designs: Sequence[Evaluated],
    states: tuple[State, ...],
    best_label: str,
) -> Parallel:
    """A line for each design over the variables of `space` and the `goals`, with limits, that it has readings of."""
    points = [space.point(one.place) for one in designs]
    axes: list[Axis] = []
    for variable in space.variables:
        first = space.keys.index(variable.keys[0])
        for k in range(len(variable.keys) if variable.is_catalogue else 1):
            axes.append(_axis(variable, k, [point[first + k] for point in points]))
    for g, (text, limit) in enumerate(goals):
        unit = next((one.readings[g].unit for one in designs if one.completed), "")
        values = numbers(one.values[g] if one.completed else np.nan for one in designs)
        bound, sense = (limit.bound, limit.sense) if limit is not None else (None, 1.0)
        axes.append(axis_of_goal(with_unit(text, unit), values, bound, 1 if sense > 0 else -1))
    return Parallel(
        name="designs", title=f"{len(designs)} designs", axes=tuple(axes), states=states,
        designs=tuple(f"design {k}" for k in range(len(designs))), best_label=best_label,
    )  # fmt: skip


def progress(problem: Problem, designs: Sequence[Evaluated], states: tuple[State, ...]) -> Progress:
    """The goal of each design in the order of the search."""
    values = [one.values[0] if one.completed else np.nan for one in designs]
    unit = next((one.readings[0].unit for one in designs if one.completed), "")
    return Progress(
        name="convergence", title=f"{problem.objective.text}, design by design",
        y_label=with_unit(problem.objective.text, unit),
        values=numbers(values), states=states, best=_best_so_far(problem, designs, values),
        logarithmic=axis_of_goal("", numbers(values)).logarithmic,
    )  # fmt: skip


def _best_so_far(problem: Problem, designs: Sequence[Evaluated], values: Sequence[float]) -> Numbers:
    """Of those that keep all limits; None before the first one."""
    kept = [
        problem.sense * value if one.completed and problem.violation(one.readings) <= KEPT else np.inf
        for one, value in zip(designs, values, strict=True)
    ]
    return numbers(problem.sense * np.minimum.accumulate(kept))


def _axis(variable: Variable, k: int, values: Sequence[object]) -> Axis:
    """Of a number between its bounds, or of column k of a catalogue."""
    if not variable.is_catalogue:
        low, high = variable.low, variable.high
        numbers_of = tuple(float(value) for value in values)  # type: ignore[arg-type]
        return Axis(label=variable.name, values=numbers_of, low=low, high=high, logarithmic=variable.logarithmic)
    name, column = ".".join(variable.keys[k]), list(dict.fromkeys(row[k] for row in variable.rows))
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in column):
        axis = axis_of_goal(name, tuple(float(value) for value in column))
        return axis.model_copy(update={"values": tuple(float(value) for value in values)})  # type: ignore[arg-type]
    numbered = tuple(float(column.index(value)) for value in values)
    return Axis(label=name, values=numbered, low=-0.5, high=len(column) - 0.5, names=tuple(map(str, column)))
