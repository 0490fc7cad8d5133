"""`check = "finer"`: an inverse analysis replayed on links with twice the modes, which holds the error of too few."""

import logging
from dataclasses import replace

import numpy as np

from ..common.errors import InputError
from ..fe_models.link_source import LinkTable, link_keys, link_path
from ..mbs.analysis.forward import Forward, actuator_commands, largest_moments
from ..mbs.analysis.operating_points import open_loop_growth
from ..mbs.linear.statics import static_equilibrium
from ..mbs.model.drives import Drives, Replayed
from ..mbs.model.known_motion import State
from ..mbs.model.model import Model
from ..mbs.posture.prescribed import following_motors
from ..mbs.posture.redundancy import resolved
from ..mbs.posture.start import undeformed_posture
from ..mbs.quantities.motion import section_motion
from ..mbs.run.drive import drive_robot
from ..mbs.run.record import Run
from ..mbs.run.replay import replay_times, supplied
from ..mbs.scene.analysis import TimedAnalysis
from ..mbs.tracking.tracking import Tracking, least_voltage
from ..scene.scene import Scene
from .prepare import prepare_scene
from .result import FinerCheck, Solution
from .watcher import Watcher

logger = logging.getLogger(__name__)

TIGHTEST = 1e-5  # tolerance: what is looked for is larger


def with_finer_check(solution: Solution, watcher: Watcher) -> Solution:
    """Return the solution with the inputs of analyses with `check = "finer"` simulated on links with more modes."""
    wanted = [name for name, run in solution.outcomes.items() if run.analysis.is_checked and run.status == "completed"]
    if not wanted:
        return solution
    results, failure = dict(solution.analyses), solution.failure
    try:
        finer = prepare_scene(_finer_scene(solution), watcher)
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
    scene, bodies = solution.scene, []
    for body in scene.body:
        modal = solution.links.get(body.name)
        if modal is not None:
            if body.link is None:
                raise InputError(
                    f'{scene.path}: analysis: check: expected "link" in body "{body.name}" for "finer", which computes'
                    " it with twice the modes",
                    f"only the modal body file {body.modal}",
                )
            keys, count = link_keys(body.link), modal.eigenmode_count
            modes = {key: value for key, value in keys.get("modes", {}).items() if key != "indices"}
            damping = dict(keys.get("damping", {}))
            if isinstance(damping.get("ratio"), list | tuple):  # one for each mode: the last is that of all above
                damping["ratio"] = [*damping["ratio"], *[damping["ratio"][-1]] * count]
            finer = keys | {"modes": modes | {"count": 2 * count}, "damping": damping}
            body = body.model_copy(update={"link": LinkTable(finer, link_path(body.link)), "modes": None})
        bodies.append(body)
    forward = Forward(name="replay", kind="forward", end=1.0, output_step=1.0)  # asks nothing of patches
    served = {"allocation": "least-squares", "mode_weights": None, "point_weights": None}
    pzt = tuple(layout.model_copy(update=served) for layout in scene.pzt)
    stiffening = solution.stiffened if scene.geometric_stiffening == "auto" else scene.geometric_stiffening
    changed = {"body": tuple(bodies), "pzt": pzt, "analysis": (forward,), "geometric_stiffening": stiffening}
    return scene.model_copy(update=changed)


def _check(solution: Solution, source: Run, finer: Solution, watcher: Watcher) -> FinerCheck:
    """Apply torques and voltages of `source`, a run of `solution`, to the same robot with finer links."""
    given, end = source.analysis, float(source.time[-1])
    assert isinstance(given, TimedAnalysis)
    analysis = Forward(
        name=f"check of {given.name}",
        kind="forward",
        end=given.end,
        output_step=given.output_step,
        tolerance=max(given.tolerance, TIGHTEST),
    )
    patches, on_finer = (of.patches if "joints+pzt" in given.applicable else {} for of in (solution, finer))
    forces = supplied(source, largest_moments(source.model, limits=False), patches, limited=False)
    run = drive_robot(
        finer.model.without_paths(),
        analysis,
        _start(source, finer.model),
        lambda t: watcher.advance(t, end),
        drives=Drives(replayed=Replayed(forces, actuator_commands(finer.model, on_finer))),
        times=replay_times(source, analysis)[: len(source.time)],
    )
    bodies = {node.body.name: node.body for node in solution.model.tree.nodes}
    known = [f"{name}.{point}" for name in solution.links or bodies for point in bodies[name].points]
    points = solution.scene.path_points or known
    errors = {point: _distance(source, run, point) for point in points}
    worst = max(errors, key=lambda point: errors[point])
    modes = {name: link.eigenmode_count for name, link in finer.links.items()}
    least = least_voltage(finer.model, finer.patches, given)[0] if isinstance(given, Tracking) else None
    return FinerCheck(modes, worst, errors[worst], run.status, open_loop_growth(source), least)


def _start(source: Run, finer: Model) -> State:
    """Where the source starts: on its trajectories, or at the coordinates of its motors; links as bent as there."""
    nodes = source.model.tree.nodes
    if any(row.is_trajectory for row in source.model.rows):
        model = resolved(finer, source.analysis.last_time)
    else:
        q = np.zeros(finer.tree.n_q)
        for node, other in zip(finer.tree.nodes, nodes, strict=True):
            q[node.q] = source.q[0, other.q]
        model = following_motors(finer, q)
    start = undeformed_posture(model)
    return static_equilibrium(model, start) if any(source.q[0, node.p_q].any() for node in nodes) else start


def _distance(source: Run, run: Run, point: str) -> float:
    path, replayed = (section_motion(one, point).r for one in (source, run))
    rows = min(len(path), len(replayed))
    return float(np.linalg.norm(path[:rows] - replayed[:rows], axis=1).max(initial=0.0))
