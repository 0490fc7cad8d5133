"""What a solve computed: of the scene as a whole, and of each analysis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..actuation.feasibility import Feasibility
from ..actuation.patches.patches import PatchArray
from ..actuation.patches.structure import StructureEffect
from ..actuation.patches.voltages import Voltages
from ..actuation.points import PointForces, PointSet
from ..common.arrays import Array
from ..fe_models.modal_body import ModalBody
from ..mbs.analysis.outcome import EarlierRun
from ..mbs.analysis.planar_outcome import PlanarOutcome
from ..mbs.model.model import Model
from ..mbs.quantities.stress import BodyStress
from ..mbs.quantities.validity import Bending
from ..mbs.scene.analysis import Analysis
from ..scene.pieces import BodyInPieces
from ..scene.scene import Scene
from .bodies import LoadedBody
from .mode_search import ModeChoice


@dataclass(frozen=True)
class FinerCheck:
    """What a replay on twice the modes found.

    Attributes:
        modes: eigenmodes of each flexible body in it.
        point: that is farthest from where the inverse analysis has it, of those on trajectories where there are any.
        error: by how much, m, at worst.
        status: how the replay ended.
    """

    modes: Mapping[str, int]
    point: str
    error: float
    status: str

    @property
    def in_words(self) -> str:
        """On how many modes, and how far off."""
        ended = "" if self.status == "completed" else f", which ended early ({self.status})"
        modes = ", ".join(map(str, dict.fromkeys(self.modes.values())))
        return f"forward simulation on {modes} modes{ended}: {self.point} is off by {1e3 * self.error:.2g} mm"


@dataclass(frozen=True)
class AnalysisResult:
    """What was computed of one analysis.

    Attributes:
        outcome: motion, forces, and what only its kind finds.
        bending: how far flexible bodies leave small deformations, and what loads do to their stiffness.
        seconds: wall time, with all that follows from the outcome.
        closer: the same at the outputs and between, from which all peaks are; None where nothing is between.
        voltages: of patches, by body.
        point_forces: at actuation points, by body.
        predicted_shift: by point, (T, 2) m: what voltages within their limits leave undone.
        feasibility: whether motors and patches can do it; None where nothing is asked of them.
        stresses: by body, where modal body files hold modal stresses.
        mode_error: estimated for too few modes, of peaks; None where it is not known. It does not see what a jolt does.
        start_jolt: see `attachment_error`.
        check: what a replay on finer links found, where that is asked for.
        warnings: why results may be wrong, or not mean what they seem to, a text each.
        notes: what is worth knowing of results that are right, likewise.
    """

    outcome: PlanarOutcome
    bending: Mapping[str, Bending] = field(default_factory=dict)
    seconds: float = 0.0
    voltages: Mapping[str, Voltages] = field(default_factory=dict)
    point_forces: Mapping[str, PointForces] = field(default_factory=dict)
    predicted_shift: Mapping[str, Array] = field(default_factory=dict)
    feasibility: Feasibility | None = None
    stresses: Mapping[str, BodyStress] = field(default_factory=dict)
    mode_error: float | None = None
    start_jolt: float = 0.0
    check: FinerCheck | None = None
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    closer: AnalysisResult | None = field(default=None, repr=False)

    @property
    def status(self) -> str:
        """How the run ended."""
        return self.outcome.status

    @property
    def analysis(self) -> Analysis:
        """What was asked for."""
        return self.outcome.analysis

    @property
    def stiffening_effect(self) -> float:
        """Largest relative change of a link's stiffness by the loads of the run."""
        return max((link.stiffness_change for link in self.bending.values()), default=0.0)

    @property
    def position_error(self) -> float:
        """The largest estimated error of positions for deflections that are not small, of the length of a link."""
        return max((link.position_error for link in self.bending.values()), default=0.0)


@dataclass(frozen=True)
class Solution:
    """Everything a solve computed.

    Attributes:
        scene, model, bodies: what was solved; patches and actuation points of bodies by name.
        structure: what patches that are part of their link change of it, by body.
        analyses: by name, in the order of the scene, as far as they were run.
        preparation: wall time by stage before the analyses, s.
        omissions: what the scene did not need, one line each.
        mode_choice: where `modes = "auto"`.
        stiffened: whether geometric stiffening is in the equations.
        divided: bodies in pieces by name; then `model` is that of the pieces, whose bodies are `parts`, and `whole` the
            one without them. `on_pieces` are the patches of such bodies on the pieces.
        earlier: runs of analyses to go on with, from a results file: see `results.resume`.
        path_notes: what was found of paths before the analyses, one line each.
        failure: what ended the run, where that was an error after analyses that are worth keeping.
    """

    scene: Scene
    model: Model
    bodies: Mapping[str, LoadedBody]
    patches: Mapping[str, PatchArray]
    points: Mapping[str, PointSet]
    structure: Mapping[str, StructureEffect]
    analyses: Mapping[str, AnalysisResult] = field(default_factory=dict)
    preparation: Mapping[str, float] = field(default_factory=dict)
    omissions: tuple[str, ...] = ()
    mode_choice: ModeChoice | None = None
    stiffened: bool = False
    earlier: Mapping[str, EarlierRun] = field(default_factory=dict)
    path_notes: tuple[str, ...] = ()
    failure: Exception | None = None
    divided: Mapping[str, BodyInPieces] = field(default_factory=dict)
    parts: Mapping[str, LoadedBody] = field(default_factory=dict)
    whole: Model | None = None
    on_pieces: Mapping[str, PatchArray] = field(default_factory=dict)

    @property
    def outcomes(self) -> Mapping[str, PlanarOutcome]:
        """The outcome of each analysis, by its name."""
        return {name: result.outcome for name, result in self.analyses.items()}

    @property
    def patch_arrays(self) -> tuple[PatchArray, ...]:
        """Of all bodies."""
        return tuple(self.patches.values())

    @property
    def acting_patches(self) -> Mapping[str, PatchArray]:
        """The patches of each link on the bodies of `model`."""
        return {**self.patches, **self.on_pieces}

    @property
    def links(self) -> dict[str, ModalBody]:
        """The modal bodies of the flexible bodies, as their files have them."""
        return {name: body.modal for name, body in self.bodies.items() if body.modal is not None}

    @property
    def seconds(self) -> dict[str, float]:
        """Wall time by stage."""
        return {**self.preparation, **{name: result.seconds for name, result in self.analyses.items()}}
