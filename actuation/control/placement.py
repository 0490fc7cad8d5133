"""Where patches on a link do most: the analysis `kind = "placement"`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

import numpy as np

from ...common.errors import InputError, quoted
from ...mbs.analysis.operating_points import InstantAnalysis, find_operating_points, of_earlier, row_at
from ...mbs.analysis.outcome import Outcome
from ...mbs.analysis.replay import motor_forces_of
from ...mbs.fields.references import Reference
from ...mbs.scene.analysis import Surroundings
from ...mbs.solve.linearisation import LinearEquations
from ..context import ActuatedContext
from ..patches.link_patches import LinkPatches, link_patches
from ..patches.patches import PatchArray
from .linear_model import state_space
from .placing import PatchableLink, elsewhere, place
from .records import Placement


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

    def run(self, context: ActuatedContext) -> Outcome:
        """The operating point, or those of the path, with what was `Placed`.

        Of several layouts of a link the others stay where they are. Raises `InputError` where it does not say which one
        is placed, and for a link without room for the patches.
        """
        model, wanted = context.model, self.placement
        link = _link(context, wanted)
        if self.is_over_path:
            assert self.source is not None
            source = context.outcomes[self.source]
            run = of_earlier(source, self).at([row_at(model.scene.path, self, source, t) for t in self.times])
            of_link = _patches(context, wanted.body)
            F_p = of_link.modes[link.layout.label].forces(of_link.on_link(motor_forces_of(source).modal))
            return replace(run, details=place(model.scene.path, wanted, link, None, F_p))
        run, about = find_operating_points(context, self)
        at = LinearEquations(about.model, about.q[0]).at(float(about.time[0]), about.q[0], about.v[0], about.a[0])
        return replace(run, details=place(model.scene.path, wanted, link, state_space(at, {}), None))


def _link(context: ActuatedContext, wanted: Placement) -> PatchableLink:
    """By the coordinates that the layout reaches; patches elsewhere reach the same."""
    name = wanted.body
    path, of_link, body = context.model.scene.path, _patches(context, name), context.links[name]
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

    def patches(**changes: object) -> PatchArray:
        keys = {"allocation": "least-squares", "mode_weights": None, "point_weights": None} | changes
        found = link_patches(path, [layout.model_copy(update=elsewhere(layout, keys))], body, context.carrying[name])
        if not np.array_equal(found.modes[label].rows, reached.rows):
            raise InputError(f'{path}: placement.body: expected patches that excite the modes of "{label}"')
        return found.arrays[label]

    own = reached.coordinates(to_file.T).T
    return PatchableLink(name, body.length, bodies, layout, reached.stiffness, reached.served, own, patches)


def _patches(context: ActuatedContext, link: str) -> LinkPatches:
    """Those of a link, also where its pieces carry them, on all modes of its file."""
    of_link = context.patches[link]
    layouts = [array.layout for array in of_link.arrays.values()]
    placed = link_patches(context.model.scene.path, layouts, context.links[link], context.carrying[link])
    return replace(placed, bodies=of_link.bodies)
