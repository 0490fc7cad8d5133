"""What a solve computed: a scene and the results of its analyses, evaluated where studies ask for them."""

from collections.abc import Mapping
from copy import copy
from dataclasses import field, replace
from functools import cached_property
from math import hypot
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from ..actuation.points import PointForces, solve_points
from ..common.arrays import Array, Indices
from ..common.errors import InputError
from ..common.structs import struct
from ..mbs.model.known_motion import Wrench
from ..mbs.posture.limits import left_ranges
from ..mbs.quantities.attachment_error import mode_error, start_errors, start_of_motion
from ..mbs.quantities.motion import point_names, reported_points
from ..mbs.quantities.reactions import Sharing, reactions, shared_evenly
from ..mbs.quantities.settling import Settling, commanded_rest, end_points, settling
from ..mbs.quantities.stress import BodyStress
from ..mbs.quantities.supply import Energies, Momentum, actuator_forces, gear_motions, motors_fit, totals
from ..mbs.quantities.validity import Bending, deflection_warning, doubts
from ..mbs.run.gears import unresolved_gears
from ..mbs.run.record import Run
from ..mbs.run.stops import path_warnings, unseen_loads
from ..mbs.scene.analysis import Analysis, IntegratedAnalysis, TimedAnalysis
from .actuation import Actuation, find_actuation
from .pieces import bending_of_links, links_in_pieces, make_whole_links
from .prepared import Prepared
from .stresses import find_stresses

if TYPE_CHECKING:  # most scenes have none of these
    from .robustness import Deviations


@struct
class FinerCheck:
    """Result of a forward simulation on links with twice the modes."""

    modes: Mapping[str, int]  # number of eigenmodes of each flexible body in it
    # point with the largest distance from the inverse analysis, of those on trajectories if there are any
    point: str
    error: float  # this distance, m
    status: str  # how the simulation ended
    # mean rate, 1/s, at which the open loop multiplies deviations of the inverse analysis; nan if unknown
    growth: float
    least_voltage: float | None = None  # V, that tracking needs with these modes; None of other kinds

    @property
    def in_words(self) -> str:
        """Text with number of modes, largest deviation and least voltage."""
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
    """Reactions, stresses and actuation at outputs of an analysis, and at times between them that show peaks."""

    prepared: Prepared = field(repr=False)  # the scene
    run: Run  # the motion at all these T times
    outputs: Indices  # numbers (k,) of those that are outputs

    @cached_property
    def reactions(self) -> Mapping[str, Wrench]:
        """By joint the force (T, 3), N, on its second side, and moment (T, 3), N·m, about that side, global axes."""
        return reactions(self.run)

    @cached_property
    def actuation(self) -> Actuation | None:
        """Requirements on motors and patches, and whether they keep their limits; None if nothing is prescribed."""
        run, prepared = self.run, self.prepared
        if actuator_forces(run) is None or not run.analysis.is_motion:
            return None
        actuation = find_actuation(prepared.scene, run, prepared.bodies, prepared.patches)
        if (missed := actuation.feasibility.unsupplied) is not None and missed.point:
            from ..mbs.analysis.operating_points import open_loop_growth

            missed = replace(missed, growth=open_loop_growth(run))
            actuation = replace(actuation, feasibility=replace(actuation.feasibility, unsupplied=missed))
        return actuation

    @cached_property
    def stresses(self) -> Mapping[str, BodyStress]:
        """Stresses (Pa) by body, where modal body files have modal stresses."""
        prepared = self.prepared
        return find_stresses(self.run, prepared.parts or prepared.bodies, prepared.patches, prepared.divided)

    @cached_property
    def point_forces(self) -> Mapping[str, PointForces]:
        """Forces (N) at actuation points, by body."""
        return _point_forces(self.prepared, self.run)


@struct
class AnalysisResult:
    """Results of one analysis."""

    prepared: Prepared = field(repr=False)  # the scene
    run: Run  # its motion and statistics, with least-squares multipliers of redundant constraints
    histories: Histories = field(repr=False)  # quantities with peaks, also between outputs
    # the run whose paths it follows: itself, or the one that it replays
    commanding: Run = field(repr=False)
    # reactions that redundant constraints leave undetermined; None where there are none
    sharing: Sharing | None = None
    check: FinerCheck | None = None  # result of `check = "finer"`; None without this key
    deviations: "Deviations | None" = None  # table of `robustness`; None without this key

    @classmethod
    def of(cls, prepared: Prepared, run: Run, earlier: "Mapping[str, AnalysisResult]") -> Self:
        """Make the result of a `run`, with peaks between outputs where known; `earlier`: results by analysis."""
        seen, sharing = shared_evenly(replace(run, links=links_in_pieces(prepared)))
        twists = {joint: gear.curve for joint, gear in gear_motions(seen).items()}  # splines through outputs
        known = {joint: curve for joint, curve in twists.items() if curve is not None}
        closest = seen
        if run.closer is not run and len(known) == len(twists):
            closest = shared_evenly(replace(run.closer, links=seen.links, twists=known))[0]
        outputs = np.searchsorted(closest.time, run.time)
        source = earlier.get(run.analysis.source or "") if run.analysis.takes_actuation else None
        commanding = seen if source is None else source.run
        result = cls(prepared, seen, Histories(prepared, closest, outputs), commanding, sharing)
        if prepared.wanted is None:  # now: an error is one of the outputs of this analysis
            of = result.histories
            _ = of.reactions, of.actuation, of.stresses, of.point_forces, result.totals, result.bending
            _ = result.point_forces, result.settling, result.predicted_shift
        return result

    def wants(self, *names: str) -> bool:
        """Whether the results file has one of these datasets or groups of the analysis, or a part of it."""
        return any(self.prepared.wants(f"{self.analysis.name}/{name}") for name in names)

    def having(self, **others: Any) -> Self:
        """The result with other values of its fields; quantities that are already evaluated are kept."""
        made = copy(self)
        vars(made).update(others)
        return made

    @cached_property
    def totals(self) -> tuple[Energies, Momentum]:
        """Energies (J) and momentum (kg·m/s, kg·m²/s) of the robot at outputs."""
        return totals(self.run)

    @cached_property
    def point_forces(self) -> Mapping[str, PointForces]:
        """Forces (N) at actuation points at outputs, by body."""
        of = self.histories
        return of.point_forces if of.run is self.run else _point_forces(self.prepared, self.run)

    @cached_property
    def bending(self) -> Mapping[str, Bending]:
        """By flexible body: largest deflection, change of stiffness by loads, and estimated errors by both."""
        return bending_of_links(self.prepared, self.histories.run)

    @cached_property
    def settling(self) -> Mapping[str, Settling]:
        """Residual vibration by point, of a run that goes on after the paths that it, or its actuation, follows."""
        run, analysis = self.run, self.run.analysis
        if not isinstance(analysis, TimedAnalysis) or run.status != "completed":
            return {}
        rest = commanded_rest(self.commanding)
        if rest is None or not rest.since < run.time[-1]:
            return {}
        metrics = getattr(run.details, "metrics", None)
        lowest = rest.frequency if metrics is None else metrics.lowest_frequency
        points = list(end_points(self.prepared.scene, reported_points(run)))
        seen = self.histories.run
        if seen is run:  # gears may be known at outputs alone
            seen = replace(run.closer, links=run.links)
        return settling(seen, rest, points, analysis.settled, lowest)

    @cached_property
    def predicted_shift(self) -> Mapping[str, Array]:
        """Estimated shift (T, 3), m, of each point by modal forces that no actuator supplies.

        {} without such forces, or where division into pieces moves joints to other places in the tree.
        """
        run, of = self.run, self.histories
        asked, forces = of.actuation, actuator_forces(of.run)
        if asked is None or forces is None or not motors_fit(of.run):
            return {}
        if not (asked.unmet or asked.feasibility.unsupplied):
            return {}
        from ..actuation.feasibility import quasi_static_shift

        points, missing = point_names(run), {**forces.modal, **asked.unmet}
        if (whole := make_whole_links(self.prepared)) is not None:
            try:
                run = whole.as_links(run)
            except InputError:
                return {}
        return quasi_static_shift(run, {name: values[of.outputs] for name, values in missing.items()}, points)

    @cached_property
    def reactions(self) -> Mapping[str, Wrench]:
        """Forces (N) and moments (N·m) in joints at outputs, by the joint's name."""
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
        """Estimated error of too few modes, relative to peaks; None where it is not known."""
        error = mode_error(self.run) if self._is_integrated else None
        return None if error is None else hypot(error, self._start_errors[1])

    @property
    def start_jolt(self) -> float:
        """Share of the largest deformation that vibrates from the start on (`attachment_error.start_errors`)."""
        return self._start_errors[0]

    @cached_property
    def _start_errors(self) -> tuple[float, float]:
        return start_errors(start_of_motion(self.run)) if self._is_integrated else (0.0, 0.0)

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
        texts += [*doubts(run, run.analysis.tolerance), *run.statistics.warnings]
        texts += [*unresolved_gears(gear_motions(run)), *run.details.warnings]
        if not isinstance(self.analysis, IntegratedAnalysis) and len(run.time):
            of = self.histories.run
            texts += left_ranges(of.model, None, of.time, of.q, of.v)
        if run.is_prescribed:
            texts += path_warnings(run.analysis, run.time, run.model.scene.trajectory)
        if self.actuation is not None and (missed := self.actuation.feasibility.unsupplied) is not None:
            texts.append(missed.in_words)
        for gauge in filter(None, (sensor.strain for sensor in getattr(self.analysis, "sensor", ()))):
            link, _, point = gauge.partition(".")
            patched, place = self.prepared.patches.get(link), self.prepared.links[link].stress[point].position
            if patched and (link in self.prepared.divided or not patched.is_beside(place)):
                where = "below a patch or on a subdivided link with patches a gauge"
                texts.append(f'strain "{gauge}": {where} reads the strain of modes alone, tens of percent off')
        return tuple(texts)

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """Remarks that are no warnings, a text each."""
        model = self.run.model
        texts: tuple[str, ...] = () if self.sharing is None else (self.sharing.in_words,)
        if self._is_integrated:
            texts += tuple(unseen_loads(model.scene.load, self.run.time[[0, -1]]))
        if self._is_integrated and model.scene.trajectory and not (of := self.analysis).follows_trajectories:
            texts += () if of.source else ("without actuation it does not follow the trajectories",)
        if self.run.is_prescribed and model.tree.loops and not model.motors:
            return (*texts, "no motors, so no torques: joints of kinematic loops have motors with motor = true alone")
        return texts

    @property
    def stiffening_effect(self) -> float:
        """Largest relative change of a link's stiffness by the loads of the run."""
        return max((link.stiffness_change for link in self.bending.values()), default=0.0)


def _point_forces(prepared: Prepared, run: Run) -> dict[str, PointForces]:
    if run.analysis.allocates_patches and any(row.is_trajectory for row in run.model.rows):
        return {name: solve_points(points, run) for name, points in prepared.points.items()}
    return {}


Errors = Mapping[str, Mapping[str, float]]
"""By analysis and kind of quantity, relative to peaks."""


@struct
class ModeChoice:
    """Result of the search for the number of modes."""

    # estimated error by omitted modes of the largest quantity of each kind, relative to its peak, by analysis and kind;
    # 0 where all modes of the files were needed
    errors: Errors
    before: Errors  # likewise, the difference between the last two solves
    # numbers of modal coordinates of all bodies together in the solves; the last is the one kept
    tried: tuple[int, ...]
    seconds: float  # wall time of the solves before the last
    highest: tuple[float, float]  # ω (rad/s) of the highest mode kept, and of the highest there is


@struct
class Solution(Prepared):
    """Everything a solve of a scene in space computed."""

    # results by name, in the order of the scene
    analyses: Mapping[str, AnalysisResult] = field(default_factory=dict)
    seconds: Mapping[str, float] = field(default_factory=dict)  # wall time by stage
    failure: Exception | None = None  # the error that ended the run after these analyses; None without one
    unread: Run | None = None  # the run of an analysis whose integration succeeded and whose outputs failed
    path_notes: tuple[str, ...] = ()  # remarks on paths, such as the factor of `fastest`, one line each
    # runs of analyses that are resumed, from a results file
    earlier: Mapping[str, Run] = field(default_factory=dict)
    mode_choice: ModeChoice | None = None  # result of the search for `modes = "auto"`

    @property
    def outcomes(self) -> dict[str, Run]:
        """Runs by the name of their analysis."""
        runs = [*(result.run for result in self.analyses.values()), *([self.unread] if self.unread else [])]
        return {run.analysis.name: run for run in runs}

    def goes_on(self, outcome: Run) -> bool:
        """Whether `outcome` can be resumed; not with bodies of a search for modes or pieces, which starts again."""
        searched = any("auto" in (body.modes, body.pieces) for body in self.scene.body)
        return not searched and outcome.analysis.is_resumable
