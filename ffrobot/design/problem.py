"""What is to be least, and what may not be exceeded: `--minimise`, `--maximise`, `--subject-to`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..common.arrays import Array, as_floats
from ..common.errors import InputError
from ..common.tables import shown
from .goals import OfMotors, parse_goal
from .readings import Goal, Reading
from .variables import Space

LIMIT = re.compile(r"(?P<goal>.*\S)\s*(?P<sense><=|>=)\s*(?P<bound>\S+)\s*")

LINEAR = 0.1  # ratios of goals to their size: logarithms above, their tangent below, for goals may be negative
KEPT = 1e-6  # of a limit: what is beyond it by no more keeps it


@dataclass(frozen=True)
class Limit:
    """`sense` · (goal − bound) ≤ 0; `sense` is 1 of "<=" and −1 of ">="."""

    goal: Goal
    sense: float
    bound: float

    @property
    def text(self) -> str:
        """As the user wrote it, more or less."""
        return f"{self.goal.text} {'<=' if self.sense > 0 else '>='} {self.bound:g}"

    @property
    def scale(self) -> float:
        """The scale of its excess: the bound; of 0 the goal's unit."""
        return abs(self.bound) or 1.0


@dataclass(frozen=True)
class Problem:
    """Goal 0 shall be least (`sense` 1) or largest (−1), within the `limits`; `scale` is its size."""

    objective: Goal
    sense: float
    limits: tuple[Limit, ...]
    scale: float = 1.0

    @property
    def goals(self) -> tuple[Goal, ...]:
        """The objective, then that of each limit."""
        return (self.objective, *(limit.goal for limit in self.limits))

    def scaled(self, values: Sequence[float]) -> Array:
        """(1 + m) F to be least, and g ≤ 0, of the goals' values: logarithms of their ratios to size and bounds.

        Powers of lengths, as masses and deflections are, become linear in the logarithms of these.
        """
        logarithms, _ = self._logarithms(values)
        return as_floats(logarithms * self._senses)

    def factors(self, values: Sequence[float]) -> Array:
        """(1 + m) what turns slopes of goals with these values into those of `scaled`."""
        _, slopes = self._logarithms(values)
        return as_floats(slopes * self._senses / self._sizes)

    def excess(self, values: Sequence[float]) -> Array:
        """(m) how far goals are beyond their limits, of these; below 0 within."""
        bounds = np.array([limit.bound for limit in self.limits])
        return as_floats(self._senses[1:] * (np.array(values[1:]) - bounds) / np.abs(self._sizes[1:]))

    @property
    def _senses(self) -> Array:
        signs = [np.sign(self.scale), *(np.sign(limit.bound) or 1.0 for limit in self.limits)]
        return as_floats(np.array([self.sense, *(limit.sense for limit in self.limits)]) * signs)

    @property
    def _sizes(self) -> Array:
        return np.array([self.scale, *(limit.bound or 1.0 for limit in self.limits)])

    def _logarithms(self, values: Sequence[float]) -> tuple[Array, Array]:
        """Logarithms of ratios, and their derivatives; below `LINEAR`, and where a bound is 0, on a tangent."""
        of_zero = np.array([False, *(limit.bound == 0.0 for limit in self.limits)])
        ratios = np.array(values) / self._sizes + of_zero
        place = np.where(of_zero, 1.0, np.maximum(ratios, LINEAR))
        return np.log(place) + (ratios - place) / place, 1.0 / place

    def violation(self, readings: Sequence[Reading]) -> float:
        """The largest excess, of its limit; 0 where none is exceeded."""
        excess = self.excess([reading.value for reading in readings])
        return max(0.0, float(excess.max())) if excess.size else 0.0

    def sized_by(self, value: float) -> Problem:
        """The same with the objective relative to its size at some design."""
        return replace(self, scale=value or 1.0)


def read_problem(minimise: str | None, maximise: str | None, subject_to: Sequence[str]) -> Problem:
    """By what the command line says. Raises `InputError`."""
    if (minimise is None) == (maximise is None):
        found = "both" if minimise is not None else "none"
        raise InputError(f"optimise: expected one objective, --minimise RESPONSE or --maximise RESPONSE, found {found}")
    objective = parse_goal(minimise, "--minimise") if minimise is not None else parse_goal(maximise or "", "--maximise")
    return Problem(objective, 1.0 if minimise is not None else -1.0, tuple(map(parse_limit, subject_to)))


def with_motors(problem: Problem, space: Space) -> Problem:
    """The problem with goals of motors by the variables that are such; within their limits, unless one says others."""
    chosen = tuple(variable for variable in space.variables if variable.motors)

    def bound(goal: Goal) -> Goal:
        return replace(goal, chosen=chosen) if isinstance(goal, OfMotors) else goal

    limits = tuple(replace(limit, goal=bound(limit.goal)) for limit in problem.limits)
    if chosen and not any(isinstance(limit.goal, OfMotors) and limit.goal.what == "share" for limit in limits):
        limits += (Limit(OfMotors("motors share", "share", chosen), 1.0, 1.0),)
    return replace(problem, objective=bound(problem.objective), limits=limits)


def parse_limit(text: str) -> Limit:
    """`peak joints.elbow.moment <= 20`. Raises `InputError`."""
    match = LIMIT.fullmatch(text.strip())
    try:
        bound = float(match["bound"]) if match else np.nan
    except ValueError:
        bound = np.nan
    if match is None or not np.isfinite(bound):
        raise InputError(
            '--subject-to: expected "RESPONSE <= NUMBER" or "RESPONSE >= NUMBER", such as "peak joints.elbow.moment <='
            f' 20", found "{shown(text)}"'
        )
    return Limit(parse_goal(match["goal"], "--subject-to"), 1.0 if match["sense"] == "<=" else -1.0, bound)
