"""The analysis `kind = "placement"`: optimal centers of patches on a link. SI units.

Mass and stiffness of patches, where the scene adds them to the link, stay where the scene has the patches.
"""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import combinations_with_replacement
from math import ceil, comb
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ...common.arrays import Array, Indices, in_parts
from ...common.errors import InputError, naming, quoted
from ...common.libraries import scipy
from ...common.structs import struct
from ...common.validation import Record
from ...mbs.analysis.operating_points import InstantAnalysis, find_operating_points, of_earlier, row_at
from ...mbs.fields.field_types import ModeCount, Name, PatchCount, PointReference, Positive, Reference, under
from ...mbs.linear.linearisation import LinearEquations
from ...mbs.model.system import motor_forces
from ...mbs.run.gears import supplied_in
from ...mbs.run.record import Details, Run
from ...mbs.scene.analysis import Surroundings
from ..context import ActuatedContext
from ..patches.link_patches import link_patches
from ..patches.patches import SINGULAR, PatchArray, patch_edges
from ..patches.records import PztLayout
from .linear_model import LinearModel, state_space
from .observer import kalman, model_of_filter
from .records import FilterRecord, Sensor, check_sampling
from .robot import default_tip, whole_robot
from .signals import Signal, make_signals

SHARE = 0.1  # of a mode's strain energy in the link, for the mode to count
CHUNK = 200  # sets whose voltages over the path are in memory together
SEED = 0  # of the evolution: the same scene gives the same patches


@struct
class PatchableLink:
    """A link on which patches are placed; p (m,), √kg·m, are coordinates of the modes that its patches excite."""

    array: PatchArray  # patches of the layout where the scene has them, on p
    bodies: tuple[str, ...]  # bodies with the modal coordinates of the link in linear models: itself, or its pieces
    # (m, n), no unit: p from the modal coordinates of the `bodies`, side by side, as linear models have them
    own: Array
    # function of keys "count" or "centers"; raises `InputError` where patches do not fit the link
    patches: Callable[..., PatchArray]


@struct
class Evaluation:
    """A set of patches: centers (count,), m, and the value of the criterion, which is maximized.

    `reach` (modes,), no unit: controllability of each mode relative to that by the best single patch.
    """

    centers: Array
    reach: Array
    value: float


@struct
class Placed(Details):
    """Result of a search for patch positions."""

    wanted: "Placement"  # the keys of the scene
    # best, even: the patches found, and as many spread evenly
    best: Evaluation
    even: Evaluation
    frequency: Array  # (modes,) Hz, of the modes that count
    share: Array  # (modes,) share, no unit, of their strain energy that is in the link
    largest_voltage: Array  # (2,) V of best and even over the path; nan without a path
    candidates: Array  # (k,) m, centers that were allowed
    candidate_reach: Array  # (modes, k), no unit, `Evaluation.reach` of a single patch there
    sets: int  # how many sets of patches were compared
    method: str  # "all sets" or "evolution"


def locked_modes(model: LinearModel, link: PatchableLink, count: int) -> tuple[Array, Array, Array]:
    """The lowest `count` modes of the robot, motors locked, in which the link bends.

    Frequencies (modes,), Hz, shapes (modes, m), no unit, in the link's p, and its share (modes,) of strain energy.
    """
    f = model.freedom
    modal = [i for i, name in enumerate(model.state_names[:f]) if name.startswith("modal/")]
    own = [k for body in link.bodies for k, i in enumerate(modal) if model.state_names[i].startswith(f"modal/{body}/")]
    block = np.ix_(modal, modal)
    K = -(model.mass @ model.A[f:, :f])[block]
    squares, shape = scipy.linalg.eigh((K + K.T) / 2, model.mass[block])
    of_link = link.own @ shape[own]
    energy = np.einsum("im,i,im->m", of_link, link.array.modes.stiffness, of_link)
    share = energy / np.einsum("im,ij,jm->m", shape, (K + K.T) / 2, shape)
    chosen = np.flatnonzero((share > SHARE) & (squares > 0.0))[:count]
    return np.sqrt(squares[chosen]) / (2 * np.pi), of_link[:, chosen].T, share[chosen]


def place(
    scene_path: Path,
    wanted: "Placement",
    link: PatchableLink,
    model: LinearModel | None,
    F_p: Array | None,
    deviation: Callable[[Array], float] | None = None,
) -> Placed:
    """Find the best centers for the patches of a link.

    The criterion needs a `model` (controllability), modal forces F_p (T, m), N/√kg (voltage), or the `deviation`, m, of
    the estimated tip by readings (m, count), V/(m·√kg), of patches. Controllability of a mode is Σ (φᵀ b_k)² over the
    patches, b_k the modal forces of a patch per volt, relative to the best single patch (Gawronski, Advanced Structural
    Dynamics, 2004, ch. 4). Raises `InputError` where there is no room.
    """
    key, layout = f"{scene_path}: placement", link.array.layout
    stiffness, served = link.array.modes.stiffness, link.array.served
    count = wanted.count or layout.patch_count
    modes = wanted.modes or min(count, served)
    if layout.coupling == "surface":
        raise InputError(f'{key}: expected patches with coupling = "rotation"', '"surface", outlined in the mesh')
    if wanted.pzt not in (None, layout.label):
        raise InputError(f'{key}.pzt: expected "{layout.label}"', f'"{wanted.pzt}"')
    if modes > served or (F_p is not None and modes > count):
        most = served if F_p is None else min(count, served)
        raise InputError(f"{key}.modes: expected at most {most}", modes)
    centers, gap, Phi_V, C = _candidates(scene_path, wanted, link, count)
    if model is not None:
        frequency, shape, share = locked_modes(model, link, modes)
    else:  # the voltages of a path must reach those of the link itself
        lowest = np.argsort(stiffness)[:modes]
        frequency, shape = np.sqrt(stiffness[lowest]) / (2 * np.pi), np.eye(len(stiffness))[lowest]
        share = np.ones(len(lowest))
    spread = patch_edges(layout.with_one_limit(count=count, centers=None), link.array.link.length).mean(axis=1)
    even = spread, np.zeros((len(Phi_V), count)), np.ones(count)
    with suppress(InputError):  # else they do nothing
        array = link.patches(count=count, centers=None)
        even = spread, array.Phi_V, array.effects.capacitance.diagonal()
    largest = np.square(shape @ Phi_V).max(axis=1)
    if not np.all(largest > 0.0):
        raise InputError(f'{key}: expected modes that patches on "{layout.body}" can reach', "some they cannot")

    def gain(Phi_V: Array) -> Array:
        return np.square(shape @ Phi_V) / largest[:, None]

    def judge(Phi_V: Array, capacitance: Array) -> Array:
        """Values (sets,) of sets of patches, Phi_V (m, sets, count) and capacitances (sets, count)."""
        if deviation is not None:  # by reciprocity the charge of a deflection p is Φ_Vᵀ p
            return -np.array([deviation(volts) for volts in (Phi_V / capacitance).swapaxes(0, 1)])
        if F_p is not None:
            return -_voltages(shape, Phi_V, F_p)
        return _measured(wanted.measure, gain(Phi_V.reshape(len(Phi_V), -1)).reshape(-1, *Phi_V.shape[1:]).sum(axis=2))

    room = len(centers) - (count - 1) * gap
    indices, sets, method = _search(room, gap * np.arange(count), wanted.most_sets, lambda i: judge(Phi_V[:, i], C[i]))
    found = [(centers[indices], Phi_V[:, indices], C[indices]), even]
    rated = [Evaluation(x, gain(P).sum(axis=1), float(judge(P[:, None], of[None])[0])) for x, P, of in found]
    voltages = [np.nan if F_p is None else float(_voltages(shape, P[:, None], F_p)[0]) for _, P, _ in found]
    best = 0 if rated[0].value >= rated[1].value else 1  # even spacing need not be on the grid
    return Placed(
        wanted=wanted,
        best=rated[best],
        even=rated[1],
        frequency=frequency,
        share=share,
        largest_voltage=np.array([voltages[best], voltages[1]]),
        candidates=centers,
        candidate_reach=gain(Phi_V),
        sets=sets,
        method=method,
    )


def _measured(measure: str, reach: Array) -> Array:
    """Values (sets,) of the reach (modes, sets)."""
    if measure == "worst":
        return reach.min(axis=0)
    if measure == "mean":
        return reach.mean(axis=0)
    with np.errstate(divide="ignore"):
        return np.exp(np.log(reach).mean(axis=0))


def _voltages(shape: Array, Phi_V: Array, F_p: Array) -> Array:
    """Largest voltage (sets,) that the modes' forces take over a path; voltages of least size where many would do."""
    forces, largest = shape @ F_p.T, []
    for some in in_parts(Phi_V.shape[1], CHUNK):
        chunk = np.einsum("mn,nsk->smk", shape, Phi_V[:, some])
        reachable = np.linalg.cond(chunk) < SINGULAR
        worst = np.full(len(chunk), np.inf)
        worst[reachable] = np.abs(np.linalg.pinv(chunk[reachable]) @ forces).max(axis=(1, 2), initial=0.0)
        largest.append(worst)
    return np.concatenate(largest)


def _search(room: int, offset: Indices, most_sets: int, judge: Callable[[Indices], Array]) -> tuple[Indices, int, str]:
    """The best set of candidates (count,), the number of sets compared, and the method.

    Candidates are y_1 ≤ y_2 ≤ … below `room` plus the `offset` (count,) of the patches before: they never overlap.
    """
    count = len(offset)
    if comb(room + count - 1, count) <= most_sets:
        sets = np.array(list(combinations_with_replacement(range(room), count)), dtype=np.intp) + offset
        return sets[int(np.argmax(judge(sets)))], len(sets), "all sets"

    def decoded(y: Array) -> Indices:
        return np.sort(np.round(y), axis=0).astype(np.intp).T + offset

    compared = 0

    def cost(y: Array) -> Array | float:
        nonlocal compared
        values = judge(decoded(y).reshape(-1, count))
        compared += len(values)
        lack = -np.nan_to_num(values, neginf=-1e300)
        return lack if y.ndim > 1 else float(lack[0])

    result = scipy.optimize.differential_evolution(
        cost, [(0, room - 1)] * count, integrality=np.ones(count, dtype=bool), vectorized=True, updating="deferred",
        seed=SEED, popsize=30, maxiter=300, tol=1e-8, polish=False,
    )  # fmt: skip
    return decoded(result.x), compared, "evolution"


def _candidates(
    scene_path: Path, wanted: "Placement", link: PatchableLink, count: int
) -> tuple[Array, int, Array, Array]:
    """Places (k,), m, for the center of a patch, how many two patches lie apart, Φ_V (m, k), capacitances (k,), F."""
    layout, whole = link.array.layout, link.array.link.length
    length = layout.length
    spacing = wanted.spacing or length / 2
    steps = int((whole - length) / spacing * (1 + 1e-9))
    gap = ceil(length / spacing * (1 - 1e-9))
    if steps < 0 or steps + 1 <= (count - 1) * gap:
        raise InputError(
            f'{scene_path}: placement.count: expected patches that fit side by side on "{layout.body}" ({whole:g}'
            f" m, centers every {spacing:g} m)",
            f"{count} of {length:g} m",
        )
    centers = length / 2 + spacing * np.arange(steps + 1)
    columns, capacitance = np.zeros((len(link.array.Phi_V), len(centers))), np.ones(len(centers))
    for k, center in enumerate(centers):
        with suppress(InputError):  # across a step of the section: such a patch does nothing
            patch = link.patches(count=None, centers=(float(center),))
            columns[:, k], capacitance[k] = patch.Phi_V[:, 0], patch.effects.capacitance[0, 0]
    return centers, gap, columns, capacitance


class EstimateRecord(FilterRecord):
    """Kalman filter that estimates the tip by the placed patches as sensors."""

    sample_time: Positive
    """Time between readings, s."""
    noise: Positive
    """Standard deviation of the noise of each patch, V."""
    sensor: tuple[Sensor, ...] = ()
    """Other sensors, such as encoders, with their noise."""
    tip: PointReference | None = None
    """Point "BODY.POINT" to be estimated; by default the tip of the robot."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        check_sampling(self.sensor, self.sample_time, "sample_time", at_every_sample=True)
        return self

    def references(self) -> Iterator[Reference]:
        """Yield references to sensors, loads and the tip."""
        for k, sensor in enumerate(self.sensor, 1):
            yield from under(f"sensor no. {k}", sensor.references())
        yield from super().references()
        if self.tip is not None:
            yield Reference("tip", self.tip)


class Placement(Record):
    """Optimal positions of the `count` patches of a [[pzt]] on its link.

    Modes are the lowest of the robot with locked motors; with criterion "voltage", those of the link, whose forces in
    the inverse analysis `about` count. With "estimate" patches are sensors.

    Patches stiffen the link where the scene has them, also while others are tried. Exact is a second run with the
    centers found, or one with `structural = false`.
    """

    body: str
    """Link with patches."""
    pzt: Name | None = None
    """Layout of the patches; required if a link has several layouts."""
    count: PatchCount | None = None
    """Number of patches; by default that of its [[pzt]]."""
    criterion: Literal["controllability", "voltage", "estimate"] = "controllability"
    """Controllability of the robot's lowest modes, the largest voltage over its limit along the path, or the deviation
    of the estimated tip (the root of the trace of its covariance).
    """
    estimate: EstimateRecord | None = None
    """Filter of criterion "estimate"."""
    measure: Literal["worst", "mean", "product"] = "worst"
    """Controllability measure: that of the worst mode, their mean, or their product."""
    modes: ModeCount | None = None
    """Number of the lowest modes that count."""
    spacing: Positive | None = None
    """Distance between tried centers, m; by default half the length of a patch."""
    most_sets: Annotated[int, Field(gt=0, le=10_000_000)] = 100_000
    """Largest number of sets for an exhaustive search; beyond it, differential evolution searches."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.criterion == "estimate") != (self.estimate is not None):
            found = "none" if self.estimate is None else f'it with "{self.criterion}"'
            raise ValueError(f'expected the table "estimate" with criterion = "estimate" only, found {found}')
        return self

    def references(self) -> Iterator[Reference]:
        """Yield references to the link and its patches."""
        yield Reference("placement.body", self.body)
        yield Reference("placement.body", self.body, "patched body")
        if self.pzt is not None:
            yield Reference("placement.pzt", self.pzt, "patches")
        if self.estimate is not None:
            yield from under("placement.estimate", self.estimate.references())


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
        """Whether patches are placed for an instant of `about`, not for its whole motion."""
        return not self.is_over_path

    def references(self) -> Iterator[Reference]:
        """Yield references to the link and its patches."""
        yield from self.placement.references()

    def problems(self, among: Surroundings) -> Iterator[str]:
        """Yield a message if `about` lacks the modal forces or the model that the criterion needs."""
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
        """Find the operating points, and place the patches by them; the details of the run are `Placed`.

        Other layouts of the link stay where they are. Raises `InputError` unless the layout is known and has room.
        """
        model, wanted = context.model, self.placement
        link = _link(context, wanted)
        if self.is_over_path:
            assert self.source is not None
            source = context.outcomes[self.source]
            run = of_earlier(source, self).at([row_at(model.scene.path, self, source, t) for t in self.times])
            modal = motor_forces(source.model, source.q, supplied_in(source)).modal
            F_p = link.array.modes.forces(context.patches[wanted.body].on_link(modal))
            return replace(run, details=place(model.scene.path, wanted, link, None, F_p))
        run, about = find_operating_points(context, self)
        at = LinearEquations(about.model, about.q[0]).at(float(about.time[0]), about.q[0], about.v[0], about.a[0])
        deviation = None if wanted.estimate is None else _deviation(context, wanted.estimate, link, run)
        return replace(run, details=place(model.scene.path, wanted, link, state_space(at), None, deviation))


def _deviation(
    context: ActuatedContext, record: EstimateRecord, link: PatchableLink, run: Run
) -> Callable[[Array], float]:
    """The standard deviation (m) of the tip's estimate by patches that read (m, count) V per unit of p.

    The filter is that of a closed loop about `run`, and has whole links. Raises `InputError` where there is none.
    """
    key, robot = f"{context.model.scene.path}: placement.estimate", whole_robot(context, run)
    tip = Sensor(point=record.tip or default_tip(robot.model))
    read, wanted = (make_signals(robot.plant, context, of) for of in (record.sensor, (tip,)))
    known = model_of_filter(record, robot, 0, [*read, *wanted])
    layout, tree = link.array.layout, robot.model.tree
    own = link.array.modes.coordinates(tree.nodes[tree.index[layout.body]].body.modal_transform.T).T
    columns = [k for k, name in enumerate(known.state_names) if name.startswith(f"modal/{layout.body}/")]
    own = own[:, : len(columns)]  # the lowest modes are kept
    as_sensor = Sensor(pzt=layout.label, noise=record.noise)

    def deviation(volts: Array) -> float:
        patches = [Signal(f"patch/{k}", as_sensor) for k in range(volts.shape[1])]
        C = np.zeros((len(patches), len(known.A)))
        C[:, columns] = volts.T @ own
        model = replace(
            known, C=np.vstack([known.C, C]), D=np.vstack([known.D, np.zeros((len(C), known.D.shape[1]))]),
            output_names=(*known.output_names, *(patch.name for patch in patches)),
        )  # fmt: skip
        with naming(key):
            found = kalman(record, model, [*read, *patches], [s.name for s in wanted], ((), record.sample_time, 0.0))
        of_tip = found.E[: len(wanted)]
        return float(np.sqrt(np.trace(of_tip @ found.covariance @ of_tip.T)))

    return deviation


def _link(context: ActuatedContext, wanted: Placement) -> PatchableLink:
    """The link by the coordinates that the layout reaches; patches elsewhere must reach the same."""
    name = wanted.body
    path, arrays, whole = context.model.scene.path, context.patches[name].arrays, context.whole
    bodies: tuple[str, ...] = (name,)
    tree = (context.model if whole is None else whole.model).tree
    to_file = tree.nodes[tree.index[name]].body.modal_transform
    if whole is not None and name in whole.divided:
        bodies, to_file = whole.divided[name].bodies, to_file @ whole.divided[name].gathered
    label = wanted.pzt or ("" if len(arrays) > 1 else next(iter(arrays)))
    if label not in arrays:
        found = f'"{label}"' if label else "none"
        raise InputError(f'{path}: placement.pzt: expected one of the layouts {quoted(arrays)} of "{name}"', found)

    def placed(layout: PztLayout) -> PatchArray:  # also where pieces carry them, on all modes of the link's file
        return link_patches([layout], context.links[name], context.carrying[name]).arrays[label]

    array = placed(arrays[label].layout)

    def patches(**changes: object) -> PatchArray:
        one = array.layout.with_one_limit(**({"mode_weights": None, "point_weights": None} | changes))
        if not np.array_equal((found := placed(one)).modes.rows, array.modes.rows):
            raise InputError("expected the same modes")
        return found

    return PatchableLink(array, bodies, array.modes.coordinates(to_file.T).T, patches)
