"""Where patches on a link in the plane do most: the analysis `kind = "placement"`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from ...common.errors import InputError
from ...fe_models.modal_body import ModalBody
from ...mbs.analysis.operating_points import InstantAnalysis, operating_points
from ...mbs.analysis.outcome import AnyOutcome
from ...mbs.analysis.planar_outcome import PlanarOutcome
from ...mbs.fields.references import Reference
from ...mbs.model.planar_body import PlanarBody
from ...mbs.scene.analysis import Surroundings
from ..context import ActuatedContext, PlanarActuatedContext
from ..patches.patches import PatchArray, patch_array
from ..patches.records import PatchKeys
from .linear import linear_models
from .placing import PatchableLink, Placed, elsewhere, place
from .records import Placement
from .spatial_placement import run_spatial_placement


class PatchPlacement(InstantAnalysis):
    """Optimal positions of patches; `placement` has the criterion."""

    kind: Literal["placement"]
    placement: Placement
    """Patches and criterion."""

    @property
    def is_over_path(self) -> bool:
        """Whether the voltages of a whole motion count, not the robot at one instant."""
        return self.placement.criterion == "voltage"

    @property
    def needs_times(self) -> bool:
        """Unless the whole motion counts."""
        return not self.is_over_path

    def references(self) -> Iterator[Reference]:
        """The link."""
        yield from self.placement.references()

    def problems(self, among: Surroundings) -> Iterator[str]:
        """Whether what it is about gives what the criterion judges by."""
        if not self.is_over_path:
            if self.instants is not None and len(self.instants) != 1:
                yield f"times: expected one time to place patches for, found {len(self.instants)}"
        else:
            source = next((other for other in among.earlier if other.name == self.source), None)
            if source is None or "joints+pzt" not in source.applicable:
                found = "none" if source is None else f'"{source.name}" of kind "{source.kind}"'
                yield (
                    f"about: expected an earlier analysis of kind {among.replayable('joints+pzt')} for"
                    f' placement.criterion = "voltage", found {found}'
                )
        yield from super().problems(among)

    def run(self, context: ActuatedContext | PlanarActuatedContext) -> AnyOutcome:
        """The operating point, or those of the path, with what was `Placed`."""
        if isinstance(context, ActuatedContext):
            return run_spatial_placement(context, self, self.placement)
        source = context.source(self.source)
        outcome = operating_points(context.model, self, source)
        return replace(outcome, details=_placed(self, context, outcome, source))


def _placed(
    analysis: PatchPlacement, context: PlanarActuatedContext, outcome: PlanarOutcome, source: PlanarOutcome | None
) -> Placed:
    """The best places for the patches of one body, about `outcome` or over the path of its `source`."""
    robot, wanted, model, F_p = context.model, analysis.placement, None, None
    if analysis.is_over_path:
        assert source is not None
        if source.F_p is None:
            raise InputError(
                f'{robot.scene.path}: analysis "{analysis.name}": placement.criterion: expected motors that fit the'
                f' mechanism for "voltage", found {len(robot.motors)} for {robot.degrees_of_freedom}'
            )
        F_p = source.F_p[:, source.modal_columns(wanted.body)]
    else:
        (model,) = linear_models(outcome, {})
    path, layout, body = robot.scene.path, context.patches[wanted.body].layout, context.links[wanted.body]
    return place(path, wanted, patchable_link(path, layout, body, robot.body(wanted.body)), model, F_p)


def patchable_link(path: Path, layout: PatchKeys, body: ModalBody, planar: PlanarBody) -> PatchableLink:
    """Of the scene at `path`, by the modes of the link in the model."""

    def patches(**changes: object) -> PatchArray:
        return patch_array(path, layout.model_copy(update=elsewhere(layout, changes)), body, planar)

    served, unit = planar.n_eigenmodes, np.eye(planar.n_modes)
    return PatchableLink(planar.name, body.length, (planar.name,), layout, planar.stiffness, served, unit, patches)
