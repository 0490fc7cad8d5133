"""The analysis `kind = "static"`: equilibrium, torques, natural frequencies and stiffness with the joints locked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal

from ...common.errors import InputError, SolveError
from ..fields.field_types import PointReference
from ..fields.references import Reference
from ..scene.analysis import Analysis
from ..solve.joint_conditions import JointCondition, joint_conditions
from ..solve.linearisation import LinearEquations
from .context import Context
from .operating_points import linear_states, places_of, run_static
from .outcome import Details, Outcome


@dataclass(frozen=True)
class RobotAtRest(Details):
    """Natural frequencies and compliance in the equilibrium, by condition of its joints: see `joint_conditions`."""

    conditions: tuple[Mapping[str, JointCondition], ...]
    times = (0.0,)


class Static(Analysis):
    """The equilibrium at t = 0 with the torques, forces and voltages that it needs.

    With it come natural frequencies and the compliance at points, with joints locked and behind compliant gears.
    """

    kind: Literal["static"]
    points: tuple[PointReference, ...] | None = None
    """Points whose compliance is computed; by default those of trajectories, or all tips; tools, payloads and loads."""

    is_algebraic = True
    allocates_patches = True

    def references(self) -> Iterator[Reference]:
        """The points."""
        for point in self.points or ():
            yield Reference("points", point)

    def run(self, context: Context) -> Outcome:
        """Motion and forces at t = 0."""
        found = run_static(context, self)
        try:
            model, _, (q,), (v,), (a,) = linear_states(context.model, found, [0])
            mechanism = LinearEquations(model, q, places_of(context, self.points, loaded=True)).at(0.0, q, v, a)
        except (InputError, SolveError) as error:
            text = f"no natural frequencies and no compliance: {error}"
            statistics = replace(found.statistics, warnings=(*found.statistics.warnings, text))
            return replace(found, statistics=statistics)
        return replace(found, details=RobotAtRest((joint_conditions(mechanism),)))
