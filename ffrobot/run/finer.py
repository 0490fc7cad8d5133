"""`check = "finer"`: an inverse analysis replayed on links with twice the modes, which holds the error of too few."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError
from ..fe_models.link_source import LinkTable, link_keys, link_path
from ..fe_models.modal_body import ModalBody
from ..mbs.analysis.forward import Forward, actuator_commands, largest_moments
from ..mbs.analysis.operating_points import locked_motors, open_loop_growth
from ..mbs.linear.statics import static_equilibrium
from ..mbs.model.drives import Drives, Replayed
from ..mbs.model.known_motion import State
from ..mbs.model.model import Model
from ..mbs.posture.redundancy import resolved
from ..mbs.posture.start import undeformed_posture
from ..mbs.quantities.motion import section_motion
from ..mbs.run.drive import drive_robot
from ..mbs.run.record import Run
from ..mbs.run.replay import replay_times, supplied
from ..mbs.scene.analysis import TimedAnalysis
from ..mbs.scene.bodies import BodyKeys
from ..mbs.tracking.tracking import Tracking, least_voltage
from ..scene.scene import Scene
from .result import FinerCheck
from .solution import Solution
from .watcher import Watcher

logger = logging.getLogger(__name__)

Prepare = Callable[[Scene, Watcher], Solution]
"""All that analyses of a scene start from."""

TIGHTEST = 1e-5  # tolerance: what is looked for is larger


def with_finer_check(solution: Solution, prepare: Prepare, watcher: Watcher) -> Solution:
    """Return the solution with its analyses replayed on links with more modes, where the scene wants that check."""
    wanted = [name for name, run in solution.outcomes.items() if run.analysis.is_checked and run.status == "completed"]
    if not wanted:
        return solution
    results, failure = dict(solution.analyses), solution.failure
    try:
        finer = prepare(_finer_scene(solution), watcher)
        for name in wanted:
            watcher.stage(f'check of "{name}" on finer links')
            results[name] = results[name].having(check=_check(solution, results[name].run, finer, watcher))
    except Exception as error:
        if failure is not None:  # which is raised
            logger.error("check on finer links failed, too", exc_info=error)
        failure = failure or error
    return replace(solution, analyses=results, failure=failure)


def _finer_scene(solution: Solution) -> Scene:
    """The scene with twice the eigenmodes of each link, of whose patches only the modal forces per volt are asked."""
    scene = solution.scene
    bodies = _with_twice_the_modes(scene.path, scene.body, solution.links)
    forward = Forward(name="replay", kind="forward", end=1.0, output_step=1.0)  # asks nothing of patches
    served = {"allocation": "least-squares", "mode_weights": None, "point_weights": None}
    pzt = tuple(layout.model_copy(update=served) for layout in scene.pzt)
    stiffening = solution.stiffened if scene.geometric_stiffening == "auto" else scene.geometric_stiffening
    changed = {"body": bodies, "pzt": pzt, "analysis": (forward,), "geometric_stiffening": stiffening}
    return scene.model_copy(update=changed)


def _with_twice_the_modes(
    path: Path, bodies: Sequence[BodyKeys], links: Mapping[str, ModalBody]
) -> tuple[BodyKeys, ...]:
    """The bodies of the scene at `path` with twice the eigenmodes of each link and nothing left out.

    `links`: their modal bodies. Raises `InputError` for a body whose link is not known, only its modal body file.
    """
    finer = []
    for body in bodies:
        modal = links.get(body.name)
        if modal is not None:
            if body.link is None:
                raise InputError(
                    f'{path}: analysis: check: expected "link" in body "{body.name}" for "finer", which computes it'
                    " with twice the modes",
                    f"only the modal body file {body.modal}",
                )
            table = LinkTable(_twice_as_many(link_keys(body.link), modal), link_path(body.link))
            body = body.model_copy(update={"link": table, "modes": None})
        finer.append(body)
    return tuple(finer)


def _twice_as_many(keys: dict[str, Any], modal: ModalBody) -> dict[str, Any]:
    """The keys of a link, for twice the eigenmodes that `modal` has."""
    modes = {key: value for key, value in keys.get("modes", {}).items() if key != "indices"}
    damping = dict(keys.get("damping", {}))
    if isinstance(damping.get("ratio"), list | tuple):  # one for each mode: the last is that of all above
        damping["ratio"] = [*damping["ratio"], *[damping["ratio"][-1]] * modal.eigenmode_count]
    return keys | {"modes": modes | {"count": 2 * modal.eigenmode_count}, "damping": damping}


def _check(solution: Solution, source: Run, finer: Solution, watcher: Watcher) -> FinerCheck:
    """Replay `source`, a run of `solution`, on the same robot with finer links."""
    scene = solution.scene
    run = _replayed(source, finer.model, _drives(solution, source, finer), watcher)
    followed = [trajectory.point for trajectory in scene.trajectory if trajectory.point is not None]
    bodies = {node.body.name: node.body for node in solution.model.tree.nodes}
    points = followed or [f"{name}.{point}" for name in solution.links or bodies for point in bodies[name].points]
    errors = {point: _distance(source, run, point) for point in points}
    worst = max(errors, key=lambda point: errors[point])
    modes = {name: link.eigenmode_count for name, link in finer.links.items()}
    asked = source.analysis
    least = least_voltage(finer.model, finer.patches, asked)[0] if isinstance(asked, Tracking) else None
    return FinerCheck(modes, worst, errors[worst], run.status, open_loop_growth(source), least)


def _drives(solution: Solution, source: Run, finer: Solution) -> Drives:
    bends = "joints+pzt" in source.analysis.applicable
    patches, on_finer = (of.patches if bends else {} for of in (solution, finer))
    source_forces = supplied(source, largest_moments(source.model, limits=False), patches, limited=False)
    return Drives(replayed=Replayed(source_forces, actuator_commands(finer.model, on_finer)))


def _replayed(source: Run, finer: Model, drives: Drives, watcher: Watcher) -> Run:
    """Forward dynamics of the finer robot under moments of its motors and voltages of its patches."""
    given = source.analysis
    assert isinstance(given, TimedAnalysis)
    analysis = Forward(
        name=f"check of {given.name}",
        kind="forward",
        end=given.end,
        output_step=given.output_step,
        tolerance=max(given.tolerance, TIGHTEST),
    )
    end = float(source.time[-1])

    def progress(t: float) -> bool:
        return watcher.advance(t, end)

    times = replay_times(source, analysis)[: len(source.time)]
    return drive_robot(finer.without_paths(), analysis, _start(source, finer), progress, drives=drives, times=times)


def _start(source: Run, finer: Model) -> State:
    """Where the source starts: on its trajectories, or of motors alone with their coordinates.

    Links are in equilibrium there, or undeformed where those of the source are.
    """
    follows = any(row.is_trajectory for row in source.model.rows)
    if follows:
        model = resolved(finer, source.analysis.last_time)
    else:
        alone = finer.without_paths()
        model = replace(alone, rows=(*alone.rows, *locked_motors(alone, _as_in(source, alone))))
    start = undeformed_posture(model)
    is_bent = any(source.q[0, node.p_q].any() for node in source.model.tree.nodes)
    return static_equilibrium(model, start) if is_bent else start


def _as_in(source: Run, model: Model) -> Array:
    """Q (n_q,) of `model`, links undeformed, with the joints where `source` has them at its start."""
    q = np.zeros(model.tree.n_q)
    for node, other in zip(model.tree.nodes, source.model.tree.nodes, strict=True):
        q[node.q] = source.q[0, other.q]
    return q


def _distance(source: Run, run: Run, point: str) -> float:
    path, replayed = (section_motion(one, point).r for one in (source, run))
    rows = min(len(path), len(replayed))
    return float(np.linalg.norm(path[:rows] - replayed[:rows], axis=1).max(initial=0.0))
