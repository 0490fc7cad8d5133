"""`check = "finer"`: an inverse analysis replayed on links with twice the modes.

A replay on the same modes is the same model run backwards: its error of 1e-13 says nothing of the modes that were left
out. Here moments of motors and voltages of patches act, as functions of time, on links of twice the eigenmodes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..actuation.patches.patches import PatchArray
from ..actuation.patches.voltages import voltage_gain
from ..common.arrays import as_floats, as_list
from ..common.errors import InputError
from ..fe_models.link_file import LinkTable, link_keys, link_path
from ..fe_models.modal_body import ModalBody
from ..mbs._core import TimeFunction
from ..mbs.analysis.drive import drive
from ..mbs.analysis.forward import Forward, has_raised_masses
from ..mbs.analysis.planar_outcome import PlanarOutcome
from ..mbs.analysis.replay import actuation_source, replay_times
from ..mbs.fields.waypoints import spline
from ..mbs.model.model import ModalLoad, Model
from ..mbs.model.raised_mass import coordinate_factors, integrated, modal_factors
from ..mbs.model.system import MechanismSystem
from ..mbs.quantities.observation import point_motion
from ..mbs.scene.analysis import TimedAnalysis
from ..mbs.scene.bodies import BodyKeys
from ..mbs.solve.initial_state import undeformed_state
from ..mbs.solve.linearisation import held_by_motors
from ..mbs.solve.state import State
from ..mbs.solve.statics import static_equilibrium
from ..scene.scene import Scene
from .bodies import LoadedBody
from .solution import FinerCheck, Solution
from .watcher import Watcher

SAMPLES_PER_RADIAN = 4.0  # of the fastest mode, of splines through moments and voltages
MOST_SAMPLES = 200_000
TIGHTEST = 1e-5  # tolerance: what is looked for is larger

B = TypeVar("B", bound=BodyKeys)


@dataclass(frozen=True)
class Histories:
    """Moments of motors, and voltages of patches by body, as functions of time."""

    moments: list[TimeFunction]
    voltages: Mapping[str, list[TimeFunction]]


def finer_scene(scene: Scene, bodies: Mapping[str, LoadedBody]) -> Scene:
    """The scene with twice the eigenmodes of each link and nothing left out.

    Raises `InputError` for a body whose link is not known, only its modal body file.
    """
    links = {name: loaded.modal for name, loaded in bodies.items() if loaded.modal is not None}
    finer = with_twice_the_modes(scene.path, scene.body, links)
    forward = Forward(name="replay", kind="forward", end=1.0, output_step=1.0)  # asks nothing of patches
    return scene.model_copy(update={"body": finer, "analysis": (forward,)})


def with_twice_the_modes(path: Path, bodies: Sequence[B], links: Mapping[str, ModalBody]) -> tuple[B, ...]:
    """The bodies of the scene at `path` with twice the eigenmodes of each link and nothing left out.

    `links`: their modal bodies. Raises `InputError` for a body whose link is not known, only its modal body file.
    """
    finer = []
    for body in bodies:
        modal = links.get(body.name)
        if modal is not None:
            if body.link is None:
                raise InputError(
                    f'{path}: analysis: check: expected "link" in body "{body.name}" for "finer", which computes'
                    f" it with twice the modes, found only the modal body file {body.modal}"
                )
            table = LinkTable(_twice_the_modes(link_keys(body.link), modal), link_path(body.link))
            keys = {"link": table, "modes": None}
            body = body.model_copy(update={key: keys[key] for key in keys if key in type(body).model_fields})
        finer.append(body)
    return tuple(finer)


def _twice_the_modes(keys: dict[str, Any], modal: ModalBody) -> dict[str, Any]:
    modes = {key: value for key, value in keys.get("modes", {}).items() if key != "indices"}
    damping = dict(keys.get("damping", {}))
    if isinstance(damping.get("ratio"), list | tuple):  # one for each mode: the last is that of all above
        damping["ratio"] = [*damping["ratio"], *[damping["ratio"][-1]] * modal.eigenmode_count]
    return keys | {"modes": modes | {"count": 2 * modal.eigenmode_count}, "damping": damping}


def check_on(source: PlanarOutcome, solution: Solution, finer: Solution, watcher: Watcher) -> FinerCheck:
    """Replay `source`, an outcome of `solution`, on the same robot with the links of `finer`."""
    model = solution.model
    if source.tau is None or model.gears or source.gears:
        raise InputError(
            f'{model.scene.path}: analysis "{source.analysis.name}": check: expected motors that fit the mechanism, and'
            ' joints without stiffness, for "finer"'
        )
    histories = _histories(source, model, solution.patches)
    voltages = [
        ModalLoad(body, finer.patches[body].Phi_V[:, k], function)
        for body, functions in histories.voltages.items()
        for k, function in enumerate(functions)
    ]
    driven = replace(finer.model, modal_loads=(*finer.model.modal_loads, *voltages))
    run = _replayed(source, driven, histories.moments, _start(source, finer.model), watcher)
    followed = [trajectory.point for trajectory in model.scene.trajectory if trajectory.point is not None]
    points = followed or [f"{body.name}.{point}" for body in model.links for point in body.points]
    errors = {point: _distance(source, run, point) for point in points}
    worst = max(errors, key=lambda point: errors[point])
    modes = {name: link.eigenmode_count for name, link in finer.links.items()}
    return FinerCheck(modes, worst, errors[worst], run.status)


def _histories(source: PlanarOutcome, model: Model, patches: Mapping[str, PatchArray]) -> Histories:
    """Splines through what the source found, as dense as the fastest vibration asks for."""
    fastest = max((float(np.sqrt(body.stiffness.max(initial=0.0))) for body in model.bodies), default=0.0)
    begin, end = float(source.time[0]), float(source.time[-1])
    count = int(np.clip(SAMPLES_PER_RADIAN * fastest * (end - begin), len(source.time), MOST_SAMPLES))
    times = as_floats(np.linspace(begin, end, max(count, 6)))
    tau, F_p = actuation_source(source).sample(as_list(times))
    if F_p.shape[1] and has_raised_masses(source):
        F_p = F_p * modal_factors(model)
    voltages = {
        name: spline(times, F_p[:, source.modal_columns(name)] @ voltage_gain(array).T, 3)
        for name, array in patches.items()
        if source.F_p is not None
    }
    return Histories(spline(times, tau, 3), voltages)


def _replayed(
    source: PlanarOutcome, exact: Model, moments: list[TimeFunction], start: State, watcher: Watcher
) -> PlanarOutcome:
    """Forward dynamics of the model under moments of its motors."""
    assert isinstance(source.analysis, TimedAnalysis)
    given = source.analysis
    analysis = Forward(
        name=f"check of {given.name}", kind="forward", end=given.end, output_step=given.output_step,
        tolerance=max(given.tolerance, TIGHTEST),
    )  # fmt: skip
    loads = exact.loads if source.details.loads is None else source.details.loads
    drives = [*zip(exact.motors.values(), moments, strict=True), *loads]
    raised = integrated(exact)
    assembly = MechanismSystem(raised, raised.joints, drives)
    reported = None if raised is exact else MechanismSystem(exact, exact.joints, drives)
    factors = 1.0 if raised is exact else coordinate_factors(exact)
    end = float(source.time[-1])

    def progress(t: float) -> bool:
        return watcher.advance(t, end)

    times = replay_times(source, analysis)[: len(source.time)]
    start = State(start.q * factors, start.v * factors)
    return drive(assembly, analysis, start, progress, reported=reported, times=times)


def _start(source: PlanarOutcome, model: Model) -> State:
    """Where the source starts: on its trajectories, or of motors alone with their angles.

    Links are in equilibrium there, or undeformed where those of the source are.
    """
    alone = source.F_p is None
    held = held_by_motors(source.assembly.model, source.q[0]) if alone else model.trajectories
    assembly = MechanismSystem(model, [*model.joints, *held], model.loads)
    state = undeformed_state(assembly)
    p = np.delete(source.q[0], source.assembly.frame_coordinates)
    return static_equilibrium(assembly, state) if p.any() else state


def _distance(source: PlanarOutcome, run: PlanarOutcome, point: str) -> float:
    """The largest, m, between where the two runs have a point."""
    path, found = (point_motion(outcome, point).position for outcome in (source, run))
    rows = min(len(path), len(found))
    return float(np.linalg.norm(path[:rows] - found[:rows], axis=1).max(initial=0.0))
