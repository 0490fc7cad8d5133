"""The studies of searches: the best design of one goal, and the curve of two."""

from __future__ import annotations

from ..pictures.studies.diagrams import Points
from ..pictures.studies.study import Study
from .front import Front
from .front_record import front_headings, front_remarks, front_rows
from .optimum import Optimum, headline, key_rows, limit_rows, remarks
from .searched_diagrams import parallel, progress, states_of
from .study_parts import floats, make_study, numbers, table, with_unit


def optimum_study(found: Optimum) -> Study:
    """Keys and limits, prices in words, the verdict of the best design; all designs."""
    problem = found.problem
    tables = [table(("key", "start", "best", "bounds"), key_rows(found))]
    if problem.limits:
        tables.append(
            table(("limit", "start", "best", "", "shadow price: objective per unit of the limit"), limit_rows(found))
        )
    states = states_of(problem, found.tried, [found.best])
    goals = [(problem.objective.text, None), *((limit.goal.text, limit) for limit in problem.limits)]
    best = "best" if found.feasible else "nearest"
    return make_study(
        "optimum", "The best design", found.scene, headline(found), [*remarks(found), *found.verdict.lines()], tables,
        [parallel(found.space, goals, found.tried, states, best), progress(problem, found.tried, states)],
        good=found.feasible,
    )  # fmt: skip


def front_study(found: Front) -> Study:
    """The curve, what it costs to go along it, all designs of its searches."""
    chosen = [one.design for one in found.points]
    states = states_of(found.problem, found.tried, chosen)
    limits = [(limit.goal.text, limit) for limit in found.problem.limits]
    goals = [(found.goals[0], None), *limits, (found.goals[1], None)]
    return make_study(
        "front", "Two goals", found.scene,
        f"{found.goals[0]} against {found.goals[1]}: {len(found.points)} designs", front_remarks(found),
        [table(front_headings(found), front_rows(found))],
        [front_curve(found), parallel(found.space, goals, found.tried, states, "on the curve")],
        good=all(one.feasible for one in found.points),
    )  # fmt: skip


def front_curve(found: Front) -> Points:
    """Both goals, designs that have not converged hollow."""
    goal, against = found.values.T
    price = [f"price {-p:.4g}" if p is not None else "" for p in numbers(one.price for one in found.points)]
    return Points(
        name="front", title=f"{found.goals[0]} against {found.goals[1]}",
        x_label=with_unit(found.goals[1], found.units[1]), y_label=with_unit(found.goals[0], found.units[0]),
        labels=tuple(price), x=floats(against), y=floats(goal), joined=True,
        sure=tuple(bool(one.converged and one.feasible) for one in found.points),
    )  # fmt: skip
