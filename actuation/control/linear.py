"""Linear models about an equilibrium or a motion: the analysis `kind = "linear"`, and what is worth telling of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ...mbs.analysis.operating_points import operating_points
from ...mbs.analysis.outcome import AnyOutcome
from ...mbs.analysis.planar_outcome import PlanarOutcome
from ...mbs.model.model import Model
from ...mbs.solve.linearisation import Linearisation
from ..context import ActuatedContext, PlanarActuatedContext, place_of
from ..patches.patches import PatchArray
from .linear_model import LinearModel, linear_model
from .linear_models import LinearKeys, analyse
from .spatial_linear import run_spatial_linear


class Linear(LinearKeys):
    """The robot as x' = A x + B u, y = C x + D u: `about` the static equilibrium, or an earlier analysis at `times`.

    `points` are outputs and disturbance inputs of the model.
    """

    def run(self, context: ActuatedContext | PlanarActuatedContext) -> AnyOutcome:
        """The operating points, with `LinearModels` about them. Raises `SolveError` in singular postures."""
        if isinstance(context, ActuatedContext):
            return run_spatial_linear(context, self)
        outcome = operating_points(context.model, self, context.source(self.source))
        whole = context.whole
        points = self.points or default_points(context.model if whole is None else whole.model)
        places = {point: place_of(whole, point) for point in points}
        return replace(outcome, details=analyse(linear_models(outcome, context.patches, places)))


def linear_models(
    outcome: PlanarOutcome, patches: Mapping[str, PatchArray], points: Sequence[str] | Mapping[str, str] | None = None
) -> tuple[LinearModel, ...]:
    """The linear models about the rows of `outcome`, which know of the `points`, or of those of trajectories.

    `points` are as `Linearisation` takes them.
    """
    model = outcome.assembly.model
    linearisation = Linearisation(model, outcome.q[0], points or default_points(model))
    rows = zip(outcome.time, outcome.q, outcome.v, outcome.a, strict=True)
    return tuple(linear_model(linearisation.at(float(t), q, v, a), patches) for t, q, v, a in rows)


def default_points(model: Model) -> tuple[str, ...]:
    """The points of trajectories; where there are none, the tips of all bodies that have one."""
    points = [trajectory.point for trajectory in model.scene.trajectory if trajectory.point is not None]
    tips = [f"{body.name}.tip" for body in model.bodies if "tip" in body.points]
    return tuple(dict.fromkeys(points or tips))
