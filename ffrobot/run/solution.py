"""What a solve of a scene computed: of the scene as a whole, and of each analysis."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import field
from functools import cached_property
from math import hypot
from typing import TYPE_CHECKING

import numpy as np

from ..common.arrays import Array, Indices
from ..common.structs import struct
from ..fe_models.modal_body import ModalBody
from ..mbs.model.body import Body
from ..mbs.model.known_motion import Wrench
from ..mbs.model.model import Model
from ..mbs.model.projection import vanishing_in_plane
from ..mbs.model.truncation import modes_kept
from ..mbs.posture.limits import left_ranges
from ..mbs.quantities.attachment_error import (
    Start,
    mode_error,
    modes_in_motion,
    phase_error,
    start_jolt,
    start_of_motion,
)
from ..mbs.quantities.path_seen import path_warnings
from ..mbs.quantities.reactions import Sharing
from ..mbs.quantities.settling import Settling
from ..mbs.quantities.stress import BodyStress
from ..mbs.quantities.supply import Energies, Momentum, gear_motions
from ..mbs.quantities.validity import Bending, deflection_warning, doubts
from ..mbs.run.gears import unresolved_gears
from ..mbs.run.record import Run
from ..mbs.scene.analysis import Analysis, IntegratedAnalysis
from ..scene.pieces import BodyInPieces
from ..scene.scene import Scene
from .bodies import LoadedBody

if TYPE_CHECKING:  # most scenes have none of these
    from ..actuation.patches.link_patches import LinkPatches
    from ..actuation.points import PointForces, PointSet
    from .actuation import Actuation
    from .mode_search import ModeChoice
    from .robustness import Deviations


@struct
class FinerCheck:
    """Result of a forward simulation on links with twice the modes.

    Attributes:
        modes: eigenmodes of each flexible body in it.
        point: that is farthest from where the inverse analysis has it, of those on trajectories where there are any.
        error: by how much, m, at worst.
        status: how the replay ended.
        growth: mean rate, 1/s, at which the open loop multiplies deviations of the inverse analysis; nan if unknown.
        least_voltage: V, that tracking needs with these modes; None of other kinds.
    """

    modes: Mapping[str, int]
    point: str
    error: float
    status: str
    growth: float
    least_voltage: float | None = None

    @property
    def in_words(self) -> str:
        """Number of modes, largest deviation and least voltage as text."""
        ended = "" if self.status == "completed" else f", which ended early ({self.status})"
        modes = ", ".join(map(str, dict.fromkeys(self.modes.values()))) or "no"
        least = "" if self.least_voltage is None else f"; least voltage {self.least_voltage:.3g} V"
        if self.least_voltage is not None and np.isnan(self.least_voltage):
            least = "; no motion within the limits was found with these modes, so their least voltage is not known"
        grown = f", in an open loop in which deviations grow by {self.growth:.2g} 1/s" if self.growth > 0.0 else ""
        off = f"{self.point} is off by {1e3 * self.error:.2g} mm{grown}"
        return f"forward simulation on {modes} modes{ended}: {off}{least}"


@struct
class Histories:
    """Quantities with peaks, at outputs of an analysis and at times between them.

    Attributes:
        run: at these times.
        outputs: (T,) which of the times are outputs.
        reactions: forces in joints by name.
        actuation: what patches have to do, and whether motors and patches can; None where nothing is prescribed.
        stresses: by body, where modal body files hold modal stresses.
        point_forces: at actuation points, by body.
    """

    run: Run
    outputs: Indices
    reactions: Mapping[str, Wrench]
    actuation: Actuation | None
    stresses: Mapping[str, BodyStress]
    point_forces: Mapping[str, PointForces]


@struct
class AnalysisResult:
    """Results of one analysis.

    Attributes:
        run: its motion, with forces that redundant constraints share, and how it went.
        energies, momentum: of the robot.
        histories: what has peaks.
        point_forces: at actuation points, by body.
        check: what a replay on finer links found, where that is asked for.
        bending: how far flexible bodies leave small deformations, and what loads do to their stiffness.
        sharing: reactions that redundant constraints leave open; None where there are none.
        predicted_shift: by point, (T, 3) m: what voltages within their limits leave undone.
        settling: by point, of runs whose paths end before them.
        deviations: what is left of it where the robot is not its model, where that is asked for.
    """

    run: Run
    energies: Energies
    momentum: Momentum
    histories: Histories = field(repr=False)
    point_forces: Mapping[str, PointForces] = field(default_factory=dict)
    check: FinerCheck | None = None
    bending: Mapping[str, Bending] = field(default_factory=dict)
    sharing: Sharing | None = None
    predicted_shift: Mapping[str, Array] = field(default_factory=dict)
    settling: Mapping[str, Settling] = field(default_factory=dict)
    deviations: Deviations | None = None

    @cached_property
    def reactions(self) -> Mapping[str, Wrench]:
        """Forces in joints by name."""
        of, outputs = self.histories.reactions, self.histories.outputs
        return {joint: Wrench(acting.force[outputs], acting.moment[outputs]) for joint, acting in of.items()}

    @cached_property
    def actuation(self) -> Actuation | None:
        """Requirements on motors and patches at outputs; None if nothing is prescribed."""
        actuation = self.histories.actuation
        return None if actuation is None else actuation.at(self.histories.outputs)

    @property
    def analysis(self) -> Analysis:
        """Record of the analysis."""
        return self.run.analysis

    @cached_property
    def mode_error(self) -> float | None:
        """Estimated for too few modes, of peaks; None where it is not known."""
        error = mode_error(modes_in_motion(self.run)) if self._is_integrated else None
        return None if error is None else hypot(error, phase_error(self._start))

    @cached_property
    def start_jolt(self) -> float:
        """Relative jump of acceleration at the start; see `attachment_error`."""
        return start_jolt(self._start) if self._is_integrated else 0.0

    @cached_property
    def _start(self) -> Start:
        return start_of_motion(self.run)

    @property
    def _is_integrated(self) -> bool:
        return self.analysis.is_integrated and len(self.run.time) > 0

    @property
    def status(self) -> str:
        """Status of the run, such as "completed"."""
        return self.run.status

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons to doubt the results, one text each, most serious first."""
        bent, run = deflection_warning(self.bending), self.run
        texts = [bent] if bent else []
        texts += [*self._doubts, *run.statistics.warnings, *unresolved_gears(gear_motions(run)), *run.details.warnings]
        if not isinstance(self.analysis, IntegratedAnalysis) and len(run.time):
            of = self.histories.run
            texts += left_ranges(of.model, None, of.time, of.q, of.v)
        if run.is_prescribed:
            texts += path_warnings(run.analysis, run.time, run.model.scene.trajectory)
        if self.actuation is not None and (missed := self.actuation.feasibility.unsupplied) is not None:
            texts.append(missed.in_words)
        return tuple(texts)

    @property
    def notes(self) -> tuple[str, ...]:
        """Properties of correct results, a text each."""
        model = self.run.model
        texts = () if self.sharing is None else (self.sharing.in_words,)
        if self.run.is_prescribed and model.tree.loops and not model.motors:
            return (*texts, "no motors, so no torques: joints of kinematic loops have motors with motor = true alone")
        return texts

    @cached_property
    def _doubts(self) -> tuple[str, ...]:
        return tuple(doubts(self.run, self.run.analysis.tolerance))

    @property
    def stiffening_effect(self) -> float:
        """Largest relative change of a link's stiffness by the loads of the run."""
        return max((link.stiffness_change for link in self.bending.values()), default=0.0)


@struct
class Solution:
    """Everything a solve of a scene in space computed.

    Attributes:
        scene, model: what was solved.
        bodies: by name.
        patches: by body.
        analyses: by name, in the order of the scene.
        seconds: wall time by stage.
        failure: what ended the run after these analyses; None where all ran, or the last of them did not complete.
        unread: the run of the analysis of which outputs failed; its integration is kept.
        path_notes: what was found of paths before the analyses, one line each.
        points: actuation points, by body.
        earlier: runs of analyses to go on with, from a results file: see `results.resume`.
        mode_choice: where `modes = "auto"`.
        divided: bodies in pieces by name; then `model` is that of the pieces, whose bodies are `parts`, and `whole`
            that of the links.
        stiffened: whether all links have geometric stiffening.
    """

    scene: Scene
    model: Model
    bodies: Mapping[str, LoadedBody]
    patches: Mapping[str, LinkPatches]
    analyses: Mapping[str, AnalysisResult]
    seconds: Mapping[str, float]
    failure: Exception | None = None
    unread: Run | None = None
    path_notes: tuple[str, ...] = ()
    points: Mapping[str, PointSet] = field(default_factory=dict)
    earlier: Mapping[str, Run] = field(default_factory=dict)
    mode_choice: ModeChoice | None = None
    divided: Mapping[str, BodyInPieces] = field(default_factory=dict)
    parts: Mapping[str, LoadedBody] = field(default_factory=dict)
    whole: Model | None = None
    stiffened: bool = False

    @property
    def outcomes(self) -> dict[str, Run]:
        """Runs by the name of their analysis."""
        runs = [*(result.run for result in self.analyses.values()), *([self.unread] if self.unread else [])]
        return {run.analysis.name: run for run in runs}

    def goes_on(self, outcome: Run) -> bool:
        """Whether `outcome` is of use to `resume`; a search for modes or pieces has its own bodies and starts again."""
        searched = any("auto" in (body.modes, body.pieces) for body in self.scene.body)
        return not searched and outcome.analysis.is_resumable

    @property
    def links(self) -> dict[str, ModalBody]:
        """The modal bodies of the flexible bodies, as their files have them."""
        return {name: body.modal for name, body in self.bodies.items() if body.modal is not None}

    @property
    def is_stiffened(self) -> bool:
        """Whether geometric stiffening is in the equations, of all links or of those in pieces."""
        return self.stiffened or any(node.body.stiffening is not None for node in self.model.tree.nodes)

    @property
    def omissions(self) -> tuple[str, ...]:
        """Parts of the equations that a planar scene omits, one line each."""
        return tuple(omissions(self.scene, self.bodies)) if self.scene.is_planar else ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on motions that links cannot perform, and on omitted modes, one line each."""
        left_out = (
            f"{name}: all modes but {modes_kept(body.spatial)}"
            for name, body in self.bodies.items()
            if body.spatial.reduction is not None and not self.scene.is_planar
        )
        return (*self.link_notes, *left_out)

    @property
    def link_notes(self) -> tuple[str, ...]:
        """Notes on motions that links cannot perform, and on their meshes, one line each."""
        rigid = (
            f"{name}: rigid in {', '.join(body.rigid_in)}, of which its file has no modes"
            for name, body in self.bodies.items()
            if body.rigid_in
        )
        unkept = (
            f"{name}: rigid in {', '.join(body.without_coordinate)}, of which its equations keep none of the modes"
            for name, body in self.bodies.items()
            if body.without_coordinate
        )
        remarks = (f"{name}: {text}" for name, modal in self.links.items() for text in modal.remarks)
        return (*rigid, *unkept, *remarks, *self._off_axis())

    def _off_axis(self) -> Iterator[str]:
        """Patches without a face on links whose faces are not at equal distances from the axis."""
        for array in (array for of_link in self.patches.values() for array in of_link.arrays.values()):
            layout, stations = array.layout, self.links[array.body].stations
            if layout.face is not None or stations.middle is None:
                continue
            between, axis = (stations.height, 0) if layout.normal == "y" else (stations.width, 1)
            assert between is not None
            x = stations.position[:, 0]
            under = (x < array.edges[:, 1:]) & (np.append(x[1:], x[-1]) > array.edges[:, :1])
            off = np.where(under.any(axis=0), np.abs(stations.middle[:, axis]), 0.0)
            if (off > OFF_AXIS * between).any():
                yield (
                    f'pzt "{layout.label}": the axis of "{array.body}" is up to {1e3 * off.max():.2g} mm off the middle'
                    " between its faces, where patches without face have the same arm on both: name the face"
                )


_STAGE_1 = {"modes": "stage 1 but for damping, stresses and name", "mesh": "the mesh, which is that of an earlier run"}

OFF_AXIS = 0.01  # of the extent: less is that of a mesh
RIGID = 1e-9  # of the motion across: less along the axis is round-off

_TERMS = {
    "D_ff": "damping",
    "S_tilde": "inertia between rotation and pairs of modes",  # S̃
    "j": "change of inertia to first order in deflections",  # j
}


def omissions(scene: Scene, bodies: Mapping[str, LoadedBody]) -> Iterator[str]:
    """Yield one line for each effect that a planar scene omits."""
    of = {name: body.spatial for name, body in bodies.items()}
    for name, body in bodies.items():
        if body.modal is None:
            continue
        if not body.computed:
            yield f"{name}: stage 1, up to date"
        elif body.reused:
            yield f"{name}: {_STAGE_1[body.reused]}"
        yield from _modes(name, of[name], body.modal)
    flexible = [name for name, body in bodies.items() if body.modal is not None]
    rigid = [name for name in bodies if name not in flexible]
    if rigid:
        yield f"modal coordinates of {', '.join(rigid)}, rigid"
    yield "out-of-plane motion"
    stiff = [name for name in flexible if _is_rigid_along(of[name])]
    if stiff:
        yield f"axial deformation of {', '.join(stiff)}: no axial modes in [modes] family"
    for term, symbol in _TERMS.items():
        zero = [name for name, body in of.items() if term in vanishing_in_plane(body)]
        if zero:
            whose = "" if zero == flexible else f" of {', '.join(zero)}"
            yield f"{symbol}{whose}, which is zero"
    algebraic = [analysis.name for analysis in scene.analysis if analysis.is_algebraic]
    if algebraic:
        yield f"integration of {', '.join(algebraic)}, algebraic"


def _is_rigid_along(body: Body) -> bool:
    """Whether no force at a point moves any point of the link along its axis, where joints and weight load it."""
    along = [point.translation[0] for point in body.points.values()]
    across = [point.translation[1] for point in body.points.values()]
    return bool(np.abs(along).max(initial=0.0) <= RIGID * np.abs(across).max(initial=0.0))


def _modes(name: str, body: Body, modal: ModalBody) -> Iterator[str]:
    """Modes that do not move in the plane, and those left out by choice."""
    whole = body if body.reduction is None else body.reduction.whole
    idle = np.flatnonzero(~whole.modal_transform.any(axis=1))
    if idle.size:
        families = Counter(modal.family[k] for k in idle)
        named = ", ".join(f"{count} {family}" for family, count in families.items())
        yield f"{name}: {idle.size} of {modal.mode_count} modes, without in-plane motion ({named})"
    if body.reduction is not None:
        yield f"{name}: all modes but {modes_kept(body)}"
