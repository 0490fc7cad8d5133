"""Feasibility: requirements on patches and motors against their limits, and single changes that suffice. SI units."""

from collections.abc import Callable, Container, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..common.arrays import Array, Indices
from ..common.peaks import largest_below
from ..common.structs import struct
from ..fe_models.modal_body import ModalBody
from ..mbs.model.body import Body
from ..mbs.model.known_motion import mass_matrices
from ..mbs.model.system import MultibodySystem, split_forces
from ..mbs.quantities.motion import modal_coordinates, node_of, point_names
from ..mbs.quantities.supply import actuator_forces, motors_fit
from ..mbs.run.context import amplifiers_on
from ..mbs.run.record import Run
from .motors import MotorFeasibility, first_time, judge_motors

if TYPE_CHECKING:
    from .patches.link_patches import LinkPatches
    from .patches.patches import PatchArray, Voltages
    from .patches.records import PztLayout


ROWS = 50  # of a run at which mass matrices are made, and at twice as many around the largest shift
KEPT = 1.0 + 1e-6  # times limits of rates: more is beyond them
NEGLIGIBLE = 1e-6  # of the length of a link, of a deflection; rad
ROUND_OFF = 1e-6  # of the largest modal force: less is what ill-conditioned patches leave


@struct
class Unsupplied:
    """Path error of motors and patches that cannot supply the modal forces of a path."""

    bodies: tuple[str, ...]  # links with too few patches or actuation points, or none
    with_patches: bool  # whether any link has patches
    point: str = ""  # that with the largest error: on trajectories, or of any body where these are of angles
    # m, largest distance of `point` from its path where the motors keep the computed angles, quasi-static
    angles_kept: float = 0.0
    at_start: float = 0.0  # m, likewise at the first output: the sag of the links
    # m, likewise where motors repeat the computed torques: the first vibration, without the drift that follows
    moments_repeated: float = 0.0
    # 1/s, growth rate of deviations under these torques; 0 where none grows, nan if unknown
    growth: float = 0.0
    families: tuple[str, ...] = ()  # in 3D, for each of `bodies`: those of its modes with unmet forces r
    # deflection, rotation: in 3D, m and rad, for each of `bodies`: largest |Φ K⁻¹ r|, |Φ_r K⁻¹ r| of its points
    deflection: tuple[float, ...] = ()
    rotation: tuple[float, ...] = ()

    @property
    def drift(self) -> str:
        """Text on the growth of the error if the motors repeat their torques."""
        return f"unstable (growth rate {self.growth:.2g} 1/s)" if self.growth > 0.0 else "drifting"

    @property
    def in_words(self) -> str:
        """Message with the links, the path error and a remedy."""
        links = [
            f"{body} ({families}), off by {_length(deflection)}"
            + (f" and {np.degrees(turn):.2g}°" if turn > NEGLIGIBLE else "")
            for body, families, deflection, turn in zip(
                self.bodies, self.families, self.deflection, self.rotation, strict=True
            )
        ] if self.families else []  # fmt: skip
        of_links = f"{'; '.join(links)}, quasi-static" if links else ", ".join(self.bodies)
        of_point = (
            f" With {'patches within their limits' if self.with_patches else 'motors only'}, {self.point} is off its"
            f" path by {_length(self.angles_kept)}, quasi-static, if joints are position-controlled on computed angles"
            f" ({_length(self.at_start)} at the start), and by {_length(self.moments_repeated)} and {self.drift} if"
            ' computed torques are applied open loop. kind = "motors-only" finds torques that follow the path'
        )
        return f"no actuator provides all modal forces required on {of_links}.{of_point if self.point else ''}"


def quasi_static_shift(run: Run, modal: Mapping[str, Array], points: Iterable[str]) -> dict[str, Array]:
    """Shifts (T, 3), m, global axes, of points by name if `modal` forces F (T, n), N/√kg, by body are missing.

    With motors locked, to first order and quasi-static: δp = −K⁻¹ F.
    """
    shift, _ = _locked(run, modal)
    places = run.model.tree.places(run.q, shift)
    return {point: places.at(run.model.tree.section(point)).velocity for point in points}


def freed_shift(run: Run, modal: Mapping[str, Array], point: str, rows: Indices) -> Array:
    """The shift (len(rows), 3), m, of a point at outputs `rows` if motors keep their torques: the robot recoils.

    `modal` forces (T, n), N/√kg, by body are missing; as they are inner forces, momentum does not change.
    """
    # δq = δq_locked − R γ with Rᵀ M δq = 0
    shift, R = _locked(run, modal, rows)
    MR = mass_matrices(MultibodySystem(run.model), run.q[rows]) @ R
    gamma = np.linalg.solve(np.swapaxes(R, 1, 2) @ MR, np.einsum("tki,tk->ti", MR, shift)[:, :, None])
    tree, freed = run.model.tree, shift - (R @ gamma)[:, :, 0]
    return tree.places(run.q[rows], freed).at(tree.section(point)).velocity


def _seen_at_points(about: Unsupplied, run: Run, modal: Mapping[str, Array], points: Iterable[str]) -> Unsupplied:
    """`about` with the shift of the point that has the largest error by unmet modal forces (T, n), N/√kg."""
    shift = {name: np.linalg.norm(shifts, axis=1) for name, shifts in quasi_static_shift(run, modal, points).items()}
    point = max(shift, key=lambda name: float(shift[name].max()))
    kept, step = shift[point], max(1, len(run.time) // ROWS)
    parts = np.array_split(np.arange(len(kept)), min(ROWS, len(kept)))
    coarse = np.array([rows[kept[rows].argmax()] for rows in parts])  # vibration peaks between evenly spaced rows
    top = coarse[np.linalg.norm(freed_shift(run, modal, point, coarse), axis=1).argmax()]
    near_top = np.unique(np.linspace(max(0, top - step), min(len(run.time) - 1, top + step), 2 * ROWS).astype(int))
    freed = np.linalg.norm(freed_shift(run, modal, point, near_top), axis=1)
    return replace(
        about,
        point=point,
        angles_kept=float(kept.max()),
        at_start=float(kept[0]),
        moments_repeated=2.0 * float(freed.max()),  # vibration after a sudden lack of force
    )


def _locked(run: Run, modal: Mapping[str, Array], rows: Indices | slice = slice(None)) -> tuple[Array, Array]:
    """δq (T, n_v) by −K⁻¹ r of modes with motors locked, and R = ∂q/∂γ (T, n_v, motors) by motor angles γ.

    By virtual work: the parts of a unit force along each joint coordinate on modes and on motors.
    """
    tree, q = run.model.tree, run.q[rows]
    joints = np.flatnonzero(tree.joint_columns)
    T, count = len(q), len(joints)
    split = split_forces(run.model, np.repeat(q, count, axis=0), np.tile(np.eye(tree.n_v)[joints], (T, 1)))
    moments = np.concatenate([np.zeros((T * count, 0)), *split.moments.values()], axis=1)
    shift, R = np.zeros((T, tree.n_v)), np.zeros((T, tree.n_v, moments.shape[1]))
    for name, r in modal.items():
        node = node_of(run, name)
        shift[:, node.p_v] = -(r[rows] @ node.body.modal_transform) / node.body.stiffness
    shift[:, joints] = np.einsum("tjn,tn->tj", split.left.reshape(T, count, tree.n_v), shift)
    R[:, joints] = moments.reshape(T, count, moments.shape[1])
    return shift, R


def _length(value: float) -> str:
    return f"{1e3 * value:.2g} mm"


@struct
class Remedies:
    """Single changes with which the patches suffice; infinite or 0 if there is none."""

    limit: float  # V, the largest required voltage
    layers: int  # number of layers of the same thickness, at the same voltage
    thickness: float  # of one layer, m, with the voltage raised in proportion (at the same field)
    count: int  # patches of the same size, evenly spread; 0 where no number with room suffices, or none are tried
    most_count: int  # the largest number with room
    most_factor: float  # ratio of required to available voltage with these


@struct
class PatchFeasibility:
    """Requirements on the patches of one layout in one analysis; k patches, n modes, peaks over time."""

    required_moment: Array  # (k,) N·m at the required voltage
    available_moment: Array  # (k,) N·m at the limit
    saturation_time: Array  # (k,) s, when a limit is first exceeded; NaN where none is
    slew: Array  # (k,) V/s, largest of the required voltage, mean between outputs
    slew_limit: Array  # (k,) V/s
    current: Array  # (k,) A, largest at the required voltage, mean between outputs
    current_limit: Array  # (k,) A
    field: Array  # (k,) V/m in a layer at the required voltage
    limited_field: Array  # (k,) V/m at the voltage within the limit
    strain: Array  # (k,), no unit, of the outer surface by bending of the link, mean along the patch
    mode_required: Array  # (n,) N/√kg, largest modal force
    mode_available: Array  # (n,) N/√kg, modal force with every patch at its limit
    find_remedies: Callable[[], Remedies]

    @property
    def remedies(self) -> Remedies:
        """Single changes with which the patches suffice, computed on request."""
        if np.any(self.rates > KEPT):
            return Remedies(np.inf, 0, np.inf, 0, len(self.rates), np.inf)
        return self.find_remedies()

    @property
    def factor(self) -> Array:
        """Ratio (k,), no unit, of required to available torque, slew rate or current; up to 1 the patch suffices."""
        return np.maximum(self.required_moment / self.available_moment, self.rates)

    @property
    def rates(self) -> Array:
        """Ratio (k,), no unit, of required to available slew rate or current, the larger one."""
        return np.maximum(self.slew / self.slew_limit, self.current / self.current_limit)

    @property
    def mode_factor(self) -> Array:
        """Ratio (n,), no unit, of required to available modal force; above 1 no voltages within limits suffice.

        Infinite where no patch reaches the mode, 0 where no force is required.
        """
        without = np.where(self.mode_required > 0, np.inf, 0.0)
        return np.divide(self.mode_required, self.mode_available, out=without, where=self.mode_available > 0)


@struct
class Feasibility:
    """Requirements of one analysis on its actuators: motors by joint, patches by layout.

    `unsupplied`: modal forces required that motors and patches cannot supply, whatever their limits.
    """

    motors: dict[str, MotorFeasibility]
    patches: dict[str, PatchFeasibility]
    unsupplied: Unsupplied | None = None

    @property
    def is_feasible(self) -> bool:
        """Whether actuators supply all that is required, within their limits."""
        return self.unsupplied is None and not any(factor > 1.0 for factor in self.factors.values())

    @property
    def factors(self) -> dict[str, float]:
        """Largest ratio of requirement to limit of each actuator, by its name in messages."""
        motors = {f"motor {name}": float(motor.factor) for name, motor in self.motors.items()}
        return motors | {f"patches of {name}": float(np.max(of.factor)) for name, of in self.patches.items()}


def judge_patches(
    patches: "PatchArray",
    voltages: "Voltages",
    charge: Array,
    time: Array,
    p: Array,
    F_p: Array,
    *,
    with_count: Callable[[int], float | None] | None,
) -> PatchFeasibility:
    """The requirements on the patches of one layout.

    At `time` (T,), s: `charge` (T, k), C, modal coordinates p (T, n), m·√kg, of the link, required forces F_p (T, m),
    N/√kg, on modes of the layout. `with_count(k)`, if any: largest voltage (V) of k such patches; None without room.
    """
    amplifiers, layout, pace = patches.amplifiers, patches.layout, 1.0 / np.diff(time)[:, None]
    required, limit = worst(voltages.required, amplifiers.range)
    slew, current = (np.abs(np.diff(of, axis=0) * pace) for of in (voltages.required, charge))
    beyond = np.any([voltages.required < amplifiers.range[0], voltages.required > amplifiers.range[1]], axis=0)
    beyond[1:] |= (slew > amplifiers.slew * KEPT) | (current > amplifiers.current * KEPT)
    toward = [np.where(sign * patches.Phi_V > 0.0, *amplifiers.range[::-1]) for sign in (-1.0, 1.0)]
    of_modes = np.array([(patches.Phi_V * V).sum(axis=1) for V in toward])
    mode_required, mode_available = worst(F_p[:, : patches.served], of_modes[:, : patches.served])
    curvature = np.abs(p @ patches.effects.turn.T).max(axis=0) / layout.length
    return PatchFeasibility(
        required_moment=np.abs(patches.moment_per_volt) * required,
        available_moment=np.abs(patches.moment_per_volt) * limit,
        saturation_time=first_time(time, beyond),
        slew=slew.max(axis=0, initial=0.0),
        slew_limit=amplifiers.slew,
        current=current.max(axis=0, initial=0.0),
        current_limit=amplifiers.current,
        field=np.abs(voltages.required).max(axis=0) / layout.spacing,
        limited_field=np.abs(voltages.within_limit).max(axis=0) / layout.spacing,
        strain=patches.effects.lever * (patches.effects.extent / 2 + layout.layers * layout.thickness) * curvature,
        mode_required=mode_required,
        mode_available=mode_available,
        find_remedies=partial(_remedies, patches, required / limit, voltages.largest, with_count),
    )


def worst(values: Array, range: Array) -> tuple[Array, Array]:
    """The absolute value (k,) in each column of `values` (T, k) with the largest share of its limit, and limits.

    `range` (2, k) has the negative limits, then the positive ones; all in the unit of the values.
    """
    pair = np.array([-values.min(axis=0, initial=0.0), values.max(axis=0, initial=0.0)])
    limit = np.abs(range)
    share = np.divide(pair, limit, out=np.zeros_like(pair), where=limit > 0.0)
    side = np.where(share[1] == share[0], pair[1] >= pair[0], share[1] > share[0]).astype(int)
    each = np.arange(len(side))
    return pair[side, each], limit[side, each]


def _remedies(
    patches: "PatchArray", shares: Array, largest: float, with_count: Callable[[int], float | None] | None
) -> Remedies:
    """The limit, layers, thickness or count that alone would suffice, by c ∝ N t_p (t_b + N t_p) of the worst patch."""
    k = int(np.argmax(shares))
    factor = shares[k]
    t_b, t_p, N = patches.effects.extent[k], patches.layout.thickness, patches.layout.layers
    layers, height = 0, np.inf
    if not patches.layout.structural:  # else they stiffen the link, too
        height = (-t_b + np.sqrt(t_b**2 + 4 * max(factor, 1.0) * N * t_p * (t_b + N * t_p))) / 2
        layers = max(N, int(np.ceil(height / t_p - 1e-9)))
    count, most, missing = 0, len(patches.edges), factor
    if with_count is not None:
        missing, least = np.inf, np.abs(patches.amplifiers.range).min()
        room = int((1.0 + 1e-6) * patches.link.length / patches.layout.length)
        for number in range(patches.served, min(room + 1, 200)):
            if (voltage := with_count(number)) is None:
                continue
            most, missing = number, voltage / least
            if missing <= 1.0:
                count = number
                break
    return Remedies(largest, layers, height / N, count, most, missing)


@struct
class LinkInMotion:
    """Motion of a link with n modes, and the modal forces required."""

    modal: ModalBody
    spatial: Body  # equations of the link, with payloads
    p: Array  # (T, n) m·√kg, coordinates of the modes of the modal body
    F_p: Array  # (T, n) N/√kg, forces on these modes required of patches


def links_in_motion(run: Run, bodies: Mapping[str, tuple[ModalBody, Body]]) -> dict[str, LinkInMotion]:
    """The motion of each link by name; `bodies`: modal bodies and equations of these links."""
    forces = actuator_forces(run)
    assert forces is not None
    return {
        name: LinkInMotion(modal, spatial, modal_coordinates(run, name), forces.modal[name])
        for name, (modal, spatial) in bodies.items()
    }


def judge_actuators(
    run: Run,
    links: Mapping[str, LinkInMotion],
    patches: "Mapping[str, LinkPatches]",
    voltages: "Mapping[str, Voltages]",
    others: Container[str],
) -> Feasibility:
    """The requirements on motors by joint ("JOINT 2" of a second coordinate) and on patches by layout.

    `patches` are by link, `voltages` by layout. Links among `others` need no modal forces of patches.
    """
    judged, every = dict[str, PatchFeasibility](), dict(voltages)  # with voltages of loads
    for load in run.model.scene.load:
        if load.pzt is not None:
            given = np.transpose([of.sample(run.time)[0] for of in load.voltage or ()])
            every[load.pzt] = replace(every[load.pzt], required=every[load.pzt].required + given)
    for body, of_link in patches.items():
        link, required = links[body], np.hstack([every[name].required for name in of_link.arrays])
        charge = required @ amplifiers_on(run.model, {body: of_link}).capacitance + link.p @ of_link.Phi_V
        for name, array in of_link.arrays.items():
            if not array.layout.is_driven:
                continue
            trial = None if run.analysis.is_repeated else partial(_largest_voltage, run, link, array.layout)
            own, F_p = charge[:, of_link.columns(name)], array.modes.forces(link.F_p)
            judged[name] = judge_patches(array, every[name], own, run.time, link.p, F_p, with_count=trial)
    return Feasibility(judge_motors(run), judged, find_unsupplied(run, links, patches, voltages, others))


def _largest_voltage(run: Run, link: LinkInMotion, layout: "PztLayout", count: int) -> float | None:
    """The voltage, V, that `count` such patches need alone, evenly spread; None if they have no room."""
    from .patches.link_patches import on_kept_modes, with_count
    from .patches.patches import voltage_gain

    patches = with_count(layout, link.modal, link.spatial, count)
    if patches is None:
        return None
    if link.spatial.name in run.model.tree.index:  # else in pieces, with all modes
        patches = on_kept_modes(patches, node_of(run, link.spatial.name).body)
    forces, gain = patches.reach.modes.forces, voltage_gain(patches.reach)
    bounds = np.abs(link.F_p) @ np.abs(forces(np.eye(link.F_p.shape[1])) @ gain.T).max(axis=1)
    return largest_below(bounds, lambda rows: float(np.abs(forces(link.F_p[rows]) @ gain.T).max(initial=0.0)))


def find_unmet(
    links: Mapping[str, LinkInMotion],
    patches: "Mapping[str, LinkPatches]",
    voltages: "Mapping[str, Voltages]",
    *,
    limited: bool,
) -> dict[str, Array]:
    """Unmet modal forces (T, n), N/√kg, by link, at voltages within limits (`limited`) or at required ones."""
    unmet = {}
    for name, link in links.items():
        unmet[name] = link.F_p
        if (of_link := patches.get(name)) is not None:
            of = [voltages[layout] for layout in of_link.arrays]
            applied = np.concatenate([one.within_limit if limited else one.required for one in of], axis=1)
            unmet[name] = of_link.unmet(link.F_p, applied)
    return unmet


def find_unsupplied(
    run: Run,
    links: Mapping[str, LinkInMotion],
    patches: "Mapping[str, LinkPatches]",
    voltages: "Mapping[str, Voltages]",
    others: Container[str],
) -> Unsupplied | None:
    """The path error by modal forces that voltages cannot supply; None if these bend no link.

    `patches` are by link, `voltages` by layout; links among `others` do not count.
    """
    largest = max((float(np.abs(link.F_p).max(initial=0.0)) for link in links.values()), default=0.0)
    unsupplied: list[tuple[float, float, str, str]] = []
    for name, left in find_unmet(links, patches, voltages, limited=False).items():
        modal, counts = links[name].modal, np.abs(left).max(axis=0) > ROUND_OFF * largest
        body = links[name].spatial.whole
        p = left @ body.modal_transform / body.stiffness
        deflection, rotation = (
            max(float(np.linalg.norm(p @ of.T, axis=1).max()) for of in shapes)
            for shapes in zip(*((at.translation, at.rotation) for at in body.points.values()), strict=True)
        )
        if name not in others and counts.any() and max(deflection / modal.length, rotation) > NEGLIGIBLE:
            of_modes = dict.fromkeys(family for family, one in zip(modal.family, counts, strict=True) if one)
            unsupplied.append((deflection, rotation, name, ", ".join(of_modes)))
    if not unsupplied:
        return None
    unsupplied.sort(reverse=True)
    deflections, rotations, bodies, families = zip(*unsupplied, strict=True)
    about = Unsupplied(bodies, bool(patches))
    if not run.space.is_plane:
        about = replace(about, families=families, deflection=deflections, rotation=rotations)
    if not (motors_fit(run) and links.keys() <= run.model.tree.index.keys()):
        return about  # motors do not determine the places of points, or links are in pieces
    points = run.model.scene.path_points or point_names(run)
    return _seen_at_points(about, run, find_unmet(links, patches, voltages, limited=True), points)
