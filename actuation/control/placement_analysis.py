"""The analysis `kind = "placement"`: where patches of a link do most, in a scene.

Mass and stiffness of patches, where the scene adds them to the link, stay where the scene has the patches.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Literal

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, quoted
from ...mbs.analysis.operating_points import InstantAnalysis, find_operating_points, of_earlier, row_at
from ...mbs.fields.field_types import Reference
from ...mbs.linear.linearisation import LinearEquations
from ...mbs.model.gears import with_compliance
from ...mbs.model.motors import motor_forces
from ...mbs.run.record import Run
from ...mbs.run.replay import supplied_in
from ...mbs.scene.analysis import Surroundings
from ..context import ActuatedContext
from ..patches.link_patches import LinkPatches, link_patches
from ..patches.patches import PatchArray
from .linear_model import state_space
from .observer import kalman, model_of_filter
from .placement import PatchableLink, place
from .placement_records import EstimateRecord, Placement
from .robot import default_tip, whole_robot
from .sensor_records import Sensor
from .signals import Signal, make_signals


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
        """Yield references to the link and its patches."""
        yield from self.placement.references()

    def problems(self, among: Surroundings) -> Iterator[str]:
        """Check that the analysis placed for has the modal forces or the model that the criterion needs."""
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

    def run(self, context: ActuatedContext) -> Run:
        """Solve for the operating points, and place the patches by them; returned with the centers as `Placed`.

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
            modal = motor_forces(source.model, source.q, supplied_in(source)).modal
            F_p = of_link.modes[link.layout.label].forces(of_link.on_link(modal))
            return replace(run, details=place(model.scene.path, wanted, link, None, F_p))
        run, about = find_operating_points(context, self)
        at = LinearEquations(about.model, about.q[0]).at(float(about.time[0]), about.q[0], about.v[0], about.a[0])
        deviation = None if wanted.estimate is None else _deviation(context, wanted.estimate, link, run)
        return replace(run, details=place(model.scene.path, wanted, link, state_space(at, {}), None, deviation))


def _deviation(
    context: ActuatedContext, record: EstimateRecord, link: PatchableLink, run: Run
) -> Callable[[Array], float]:
    """Return the standard deviation (m) of the tip's estimate by sensors that read (m, count) V of each unit of p.

    The filter is that of a closed loop about `run`, and has whole links. Raises `InputError` where there is none.
    """
    key, robot = f"{context.model.scene.path}: placement.estimate", whole_robot(context, run)
    tip = Sensor(point=record.tip or default_tip(robot.model))
    plant = with_compliance(robot.model)
    read, wanted = (make_signals(plant, context, of) for of in (record.sensor, (tip,)))
    known = model_of_filter(record, robot, 0, [*read, *wanted])
    to_file = robot.model.tree.nodes[robot.model.tree.index[link.name]].body.modal_transform
    own = _patches(context, link.name).modes[link.layout.label].coordinates(to_file.T).T
    columns = [k for k, name in enumerate(known.state_names) if name.startswith(f"modal/{link.name}/")]
    own = own[:, : len(columns)]  # the lowest modes are kept
    as_sensor = Sensor(pzt=link.layout.label, noise=record.noise)

    def deviation(volts: Array) -> float:
        patches = [Signal(f"patch/{k}", as_sensor) for k in range(volts.shape[1])]
        C = np.zeros((len(patches), len(known.A)))
        C[:, columns] = volts.T @ own
        model = replace(
            known, C=np.vstack([known.C, C]), D=np.vstack([known.D, np.zeros((len(C), known.D.shape[1]))]),
            output_names=(*known.output_names, *(patch.name for patch in patches)),
        )  # fmt: skip
        try:
            found = kalman(record, model, [*read, *patches], [s.name for s in wanted], ((), record.sample_time, 0.0))
        except InputError as error:
            raise InputError(f"{key}: {error}") from None
        of_tip = found.E[: len(wanted)]
        return float(np.sqrt(np.trace(of_tip @ found.covariance @ of_tip.T)))

    return deviation


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
            f'{path}: placement.pzt: expected one of the layouts {quoted(of_link.arrays)} of "{name}"', found
        )
    reached, layout = of_link.modes[label], of_link.arrays[label].layout

    def patches(**changes: object) -> PatchArray:
        one = layout.with_one_limit(**({"mode_weights": None, "point_weights": None} | changes))
        found = link_patches(path, [one], body, context.carrying[name])
        if not np.array_equal(found.modes[label].rows, reached.rows):
            raise InputError(f'{path}: placement.body: expected patches that excite the modes of "{label}"')
        return found.arrays[label]

    own = reached.coordinates(to_file.T).T
    return PatchableLink(
        name=name,
        length=body.length,
        bodies=bodies,
        layout=layout,
        stiffness=reached.stiffness,
        served=reached.served,
        own=own,
        patches=patches,
    )


def _patches(context: ActuatedContext, link: str) -> LinkPatches:
    """Those of a link, also where its pieces carry them, on all modes of its file."""
    of_link = context.patches[link]
    layouts = [array.layout for array in of_link.arrays.values()]
    placed = link_patches(context.model.scene.path, layouts, context.links[link], context.carrying[link])
    return replace(placed, bodies=of_link.bodies)
