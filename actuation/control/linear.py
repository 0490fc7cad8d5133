"""Linear models about an equilibrium or a motion: the analysis `kind = "linear"`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np

from ...common.arrays import Array
from ...mbs._core import TimeFunction
from ...mbs.analysis.gears import wound_up
from ...mbs.analysis.operating_points import InstantAnalysis, of_earlier, row_at
from ...mbs.analysis.outcome import Outcome
from ...mbs.analysis.static import run_static
from ...mbs.fields.field_types import PointReference
from ...mbs.fields.references import Reference
from ...mbs.model.gears import with_compliance
from ...mbs.model.model import Model, modal_directions, without_paths
from ...mbs.model.rows import ConstraintRow
from ...mbs.scene.analysis import Analysis
from ...mbs.solve.linearisation import LinearEquations, LinearMechanism
from ...mbs.solve.start import undeformed_posture
from ..context import ActuatedContext, place_of
from ..patches.link_patches import LinkPatches
from .linear_model import LinearModel, state_space
from .linear_models import LinearModels, analyse


class Linear(InstantAnalysis):
    """The robot as x' = A x + B u, y = C x + D u: `about` the static equilibrium, or an earlier analysis at `times`.

    `points` are outputs and disturbance inputs of the model.
    """

    kind: Literal["linear"]
    points: tuple[PointReference, ...] | None = None
    """Points whose motion is an output and at which disturbances act; by default those of trajectories, or all tips."""

    needs_actuators = True

    def references(self) -> Iterator[Reference]:
        """The points."""
        for point in self.points or ():
            yield Reference("points", point, needs_marker=True)

    def run(self, context: ActuatedContext) -> Outcome:
        """The operating points, with `LinearModels` about them. Raises `SolveError` in singular postures."""
        run, about = find_operating_points(context, self)
        return replace(run, details=make_linear_models(context, self, about))


class OperatingPoints(NamedTuple):
    """States about which a robot is linear: `model` follows nothing, its gears give where the scene says so.

    time (T,) s; q (T, n_q), v and a (T, n_v).
    """

    model: Model
    time: Array
    q: Array
    v: Array
    a: Array


def find_operating_points(context: ActuatedContext, analysis: InstantAnalysis) -> tuple[Outcome, OperatingPoints]:
    """The equilibrium, or the instants of a motion, that an analysis is about, as they were found, and their states."""
    model = with_compliance(without_paths(context.model))
    if analysis.source is None:
        run = _equilibrium(context, analysis)
        source, rows = run, [0]
    else:
        source = context.outcomes[analysis.source]
        rows = [row_at(model.scene.path, analysis, source, float(t)) for t in analysis.times]
        run = of_earlier(source, analysis).at(rows)
    q, v, a = wound_up(source, model)[:3]
    return run, OperatingPoints(model, run.time, q[rows], v[rows], a[rows])


def make_linear_models(context: ActuatedContext, analysis: Linear, about: OperatingPoints) -> LinearModels:
    """About these states. Points have the names of the scene, modes those of the model, also of links in pieces."""
    free, whole = about.model, context.whole
    points = analysis.points or _default_points(free if whole is None else whole.model)
    places = {point: place_of(whole, point) for point in points}
    linearisation = LinearEquations(free, about.q[0], places)
    models: list[LinearModel] = []
    for t, q, v, a in zip(about.time, about.q, about.v, about.a, strict=True):
        mechanism = linearisation.at(float(t), q, v, a)
        models.append(state_space(mechanism, voltages_at(free, mechanism, context.patches)))
    return analyse(tuple(models))


def _equilibrium(context: ActuatedContext, analysis: Analysis) -> Outcome:
    """Static; where nothing is followed, motors keep the initial posture."""
    model = context.model
    if not any(row.is_trajectory for row in model.rows):
        context = replace(
            context, model=replace(model, rows=(*model.rows, *held_by_motors(model, undeformed_posture(model).q)))
        )
    return run_static(context, analysis)


def held_by_motors(model: Model, q: Array) -> list[ConstraintRow]:
    """Rows that keep the coordinates of motors where they are at q (n_q,)."""
    rows = []
    for joint, columns in model.motors.items():
        node = model.tree.nodes[model.tree.carried[joint]]
        for k in columns:
            q_index = node.q.start + int(k) - node.v.start
            target, nothing = TimeFunction.constant(float(q[q_index])), np.zeros(3)
            rows.append(
                ConstraintRow(
                    joint, "coordinate", node.inner, node.outer, nothing, nothing, coordinate=int(k), q_index=q_index,
                    target=target,
                )
            )  # fmt: skip
    return rows


def voltages_at(model: Model, mechanism: LinearMechanism, patches: Mapping[str, LinkPatches]) -> dict[str, Array]:
    """By "pzt/LAYOUT/k", what a volt does along s: on the modes of its link, or of the pieces of that."""
    found: dict[str, Array] = {}
    for of_link in patches.values():
        along_s = modal_directions(model, of_link.per_volt) @ mechanism.transformation
        for layout in of_link.arrays:
            found |= {f"pzt/{layout}/{k}": row for k, row in enumerate(along_s[of_link.columns(layout)], 1)}
    return found


def _default_points(model: Model) -> tuple[str, ...]:
    """The points of trajectories; where there are none, the tips of all bodies that have one."""
    points = [trajectory.point for trajectory in model.scene.trajectory if trajectory.point is not None]
    tips = [f"{node.body.name}.tip" for node in model.tree.nodes if "tip" in node.body.points]
    return tuple(dict.fromkeys(points or tips))
