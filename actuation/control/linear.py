"""Linear models about an equilibrium or a motion: the analysis `kind = "linear"`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Literal

from ...common.arrays import Array
from ...mbs.analysis.operating_points import InstantAnalysis, OperatingPoints, find_operating_points, places_of
from ...mbs.analysis.outcome import Outcome
from ...mbs.fields.field_types import PointReference
from ...mbs.fields.references import Reference
from ...mbs.model.model import Model, modal_directions
from ...mbs.solve.joint_conditions import joint_conditions
from ...mbs.solve.linearisation import LinearEquations, LinearMechanism
from ..context import ActuatedContext
from ..patches.link_patches import LinkPatches
from .linear_model import state_space
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
            yield Reference("points", point)

    def run(self, context: ActuatedContext) -> Outcome:
        """The operating points, with `LinearModels` about them. Raises `SolveError` in singular postures."""
        run, about = find_operating_points(context, self)
        return replace(run, details=make_linear_models(context, self, about))


def make_linear_models(context: ActuatedContext, analysis: Linear, about: OperatingPoints) -> LinearModels:
    """About these states. Points have the names of the scene, modes those of the model, also of links in pieces."""
    free = about.model
    linearization = LinearEquations(free, about.q[0], places_of(context, analysis.points))
    mechanisms = [
        linearization.at(float(t), q, v, a) for t, q, v, a in zip(about.time, about.q, about.v, about.a, strict=True)
    ]
    models = [state_space(one, voltages_at(free, one, context.patches)) for one in mechanisms]
    return replace(analyse(tuple(models)), conditions=tuple(map(joint_conditions, mechanisms)))


def voltages_at(model: Model, mechanism: LinearMechanism, patches: Mapping[str, LinkPatches]) -> dict[str, Array]:
    """By "pzt/LAYOUT/k", what a volt does along s: on the modes of its link, or of the pieces of that."""
    found: dict[str, Array] = {}
    for of_link in patches.values():
        along_s = modal_directions(model, of_link.per_volt) @ mechanism.transformation
        for layout in of_link.arrays:
            found |= {f"pzt/{layout}/{k}": row for k, row in enumerate(along_s[of_link.columns(layout)], 1)}
    return found
