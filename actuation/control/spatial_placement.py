"""Where patches on a link in space do most: the analysis `kind = "placement"` there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...common.arrays import as_floats
from ...common.errors import InputError
from ...common.validation import quoted
from ...mbs.analysis.operating_points import InstantAnalysis, of_earlier
from ...mbs.analysis.outcome import Outcome
from ...mbs.analysis.spatial_replay import motor_forces_of
from ...mbs.solve.spatial_linearisation import SpatialLinearisation
from ..context import ActuatedContext
from ..patches.patches import PatchArray
from ..patches.spatial_patches import link_patches
from ..patches.spatial_records import SpatialPztLayout
from .linear_model import state_space
from .placing import PatchableLink, elsewhere, place
from .records import Placement
from .spatial_linear import operating_points_in_space


def run_spatial_placement(context: ActuatedContext, analysis: InstantAnalysis, wanted: Placement) -> Outcome:
    """The operating point, or those of the path, with what was `Placed`.

    Of several layouts of a link the others stay where they are. Raises `InputError` where it does not say which one is
    placed, and for a link without room for the patches.
    """
    model = context.model
    link = _link(context, wanted)
    if wanted.criterion == "voltage":
        assert analysis.source is not None
        source = context.outcomes[analysis.source]
        run = of_earlier(source, analysis)
        reached = context.patches[wanted.body].modes[link.layout.label]
        F_p = reached.forces(context.patches[wanted.body].on_link(motor_forces_of(source).modal))
        return replace(run, details=place(model.scene.path, wanted, link, None, F_p))
    run, about = operating_points_in_space(context, analysis)
    at = SpatialLinearisation(about.model, about.q[0]).at(float(about.time[0]), about.q[0], about.v[0], about.a[0])
    return replace(run, details=place(model.scene.path, wanted, link, state_space(at, {}), None))


def _link(context: ActuatedContext, wanted: Placement) -> PatchableLink:
    """By the coordinates that the layout reaches; patches elsewhere reach the same."""
    name = wanted.body
    path, of_link, body = context.model.scene.path, context.patches[name], context.links[name]
    whole = context.whole
    bodies: tuple[str, ...] = (name,)
    tree = (context.model if whole is None else whole.model).tree
    to_file = tree.nodes[tree.index[name]].body.modal_transform
    if whole is not None and name in whole.divided:
        bodies, to_file = whole.divided[name].bodies, to_file @ whole.divided[name].gathered
    label = wanted.pzt or ("" if len(of_link.arrays) > 1 else next(iter(of_link.arrays)))
    if label not in of_link.arrays:
        found = f'"{label}"' if label else "none"
        raise InputError(
            f'{path}: placement.pzt: expected one of the layouts {quoted(of_link.arrays)} of "{name}", found {found}'
        )
    reached, layout = of_link.modes[label], of_link.arrays[label].layout
    assert isinstance(layout, SpatialPztLayout)

    def patches(**changes: object) -> PatchArray:
        keys = {"allocation": "least-squares", "mode_weights": None, "point_weights": None} | changes
        found = link_patches(path, [layout.model_copy(update=elsewhere(layout, keys))], body, context.carrying[name])
        if not np.array_equal(found.modes[label].rows, reached.rows):
            raise InputError(f'{path}: placement.body: expected patches that reach the modes of "{label}"')
        return found.arrays[label]

    own = as_floats(np.linalg.solve(reached.T, to_file[reached.rows]))
    return PatchableLink(name, body.length, bodies, layout, reached.stiffness, reached.served, own, patches)
