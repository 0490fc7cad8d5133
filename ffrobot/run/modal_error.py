"""How far off results are by the modes that links do not have: solved again with fewer."""

from __future__ import annotations

from dataclasses import replace
from math import ceil

from ..mbs.model.truncation import loaded_points, with_fewer_modes
from .mode_choice import reported_modes
from .mode_search import Errors, difference
from .prepare import with_bodies
from .solution import Solution
from .solve import run_analyses
from .watcher import Watcher

PART = 2 / 3  # of the eigenmodes of each link in the solve that is compared with


def modal_errors(solution: Solution, watcher: Watcher | None = None) -> Errors | None:
    """Estimated error of the largest quantity of each kind, relative to its peak, by analysis; None where unknown.

    The difference to a solve with two thirds of the eigenmodes of each link. With attachment modes the error falls with
    the fourth power of their number or faster, or like their number where a motion begins with a jolt: the difference
    is not below the error of the solution itself. Known are completed analyses of scenes whose flexible
    links all have attachment modes, beyond which nothing static is missing; links with eigenmodes alone lack what no
    solve with fewer of them shows.

    Costs a solve with fewer modes. Raises what a solve raises.
    """
    bodies = {name: body.spatial for name, body in solution.bodies.items() if body.spatial.n_modes}
    whole = {name: body for name, body in bodies.items() if body.attachment_modes and body.reduction is None}
    if not bodies or whole.keys() != bodies.keys() or any(body.n_eigenmodes < 2 for body in whole.values()):
        return None
    scene = solution.scene
    fewer = {
        name: with_fewer_modes(body, ceil(PART * body.n_eigenmodes), loaded_points(scene, name))
        for name, body in whole.items()
    }
    unsolved = replace(with_bodies(solution, fewer), failure=None, earlier={})
    coarse = run_analyses(unsolved, watcher or Watcher())
    return {
        name: difference(reported_modes(result), reported_modes(coarse.analyses[name]))
        for name, result in solution.analyses.items()
        if name in coarse.analyses and result.status == coarse.analyses[name].status == "completed"
    }
