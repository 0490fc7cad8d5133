"""The integrators of the core, and which one a scene asks for, by the vibrations of the robot.

Explicit steps are limited by the highest frequency whether it is excited or not, implicit ones by the highest that
rings above the tolerance. The rule estimates the number of steps of both; a wrong one is found out in the run.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from .. import _core
from ..linear.vibration import Vibrations, vibrations_of
from ..model.gears import friction_damping, gear_matrices
from ..model.known_motion import State
from ..model.model import Model
from ..model.system import MultibodySystem
from ..scene.analysis import IntegratedAnalysis

NAMES = ("dopri5", "dop853", "radau", "generalized-alpha")
METHODS = {name: getattr(_core.MethodKind, name.replace("-", "_")) for name in NAMES}


class Rule(NamedTuple):
    """Size and cost of steps of DOP853 and Radau IIA, measured in runs of tests/campaigns/choice.py.

    DOPRI5 is never notably faster: undamped, its steps have to be five times as short as those of
    DOP853 (it is stable up to 1.0), damped nearly three.
    """

    # step size times frequency at which DOP853 is stable (Hairer, Nørsett and Wanner 1993, II.10), and at which both
    # resolve a vibration to a tolerance of 1e-4
    stable: float = 4.8
    resolved_dop853: float = 1.25
    resolved_radau: float = 0.30
    # parts of the tolerance below which both need not resolve a vibration, Radau since it damps it away
    negligible_dop853: float = 0.1
    negligible_radau: float = 1.0
    steps_to_start: int = 100  # of Radau, before they have found their size
    # evaluations of a step: twelve stages and the end; three stages in three iterations
    of_dop853: float = 13.0
    of_radau: float = 9.0
    # evaluations in the time of a step's linear algebra, for each coordinate: 1.0 to 1.6 of arms of 8 to 31
    of_algebra: float = 1.5
    short: float = 4000.0  # evaluations of a run: the choice itself takes the time of half of them
    # in short runs, how many times as slow as DOP853 Radau is expected to be, which takes over where that is wrong
    last_resort: float = 100.0


RULE = Rule()

ASKED_FOR = "requested"
REPEATED = "steps taken again"
EXPLICIT = ("dopri5", "dop853")


AFTER = " after "  # in names of integrators that were changed during a run
MOST_TOLD = 3  # changes
CHANGED, IN_ALL = " from t = ", "; changed "  # in reasons


class Contender(NamedTuple):
    """Integrator considered for a run: cost of a step in DOP853 steps, and expected progress, s per cost."""

    name: str
    cost: float = 1.0
    pace: float = 0.0


class Choice(NamedTuple):
    """An integrator by its name in scenes, and why it was chosen.

    Of two `candidates` either takes over during the run where it turns out faster. The name is then "LAST after OTHER".
    """

    name: str
    reason: str
    candidates: tuple[Contender, ...] = ()

    @property
    def in_words(self) -> str:
        """The name, after a change during the run as "OTHER, then LAST"."""
        last, _, before = self.name.partition(AFTER)
        return f"{before}, then {last}" if before else last

    def changed_in(self, run: _core.TreeRun) -> "Choice":
        """The choice with the changes of integrators during `run` in its name and reason."""
        if not run.changes:
            return self
        names = {kind: name for name, kind in METHODS.items()}
        last = names[run.changes[-1][2]]
        before = {*self.name.split(AFTER), *(names[before] for _, before, _, _ in run.changes)} - {last}
        earlier, _, times = self.reason.partition(IN_ALL)  # of a run that was stopped
        known = int(times.split()[0]) if times else earlier.count(CHANGED)
        texts = [
            f"{names[to]}{CHANGED}{t:.4g} s, where steps of {names[before]} were {step:.2g} s"
            for t, before, to, step in run.changes[: max(0, MOST_TOLD - known)]
        ]
        count = known + len(run.changes)
        reason = "; ".join([earlier, *texts]) + (f"{IN_ALL}{count} times in all" if count > MOST_TOLD else "")
        return self._replace(name=f"{last}{AFTER}{' and '.join(before)}", reason=reason)


NOT_INTEGRATED = Choice("none", "nothing to integrate")


def without_choosing(frequency: float, duration: float, replay: float, cost: float) -> Choice | None:
    """DOP853 for a run so short that choosing takes a notable part of it; None for others.

    `frequency` rad/s, about the highest; `duration` s; `cost` of a Radau step in those of DOP853;
    `replay`: time to find replayed inputs, in evaluations.
    """
    steps = max(duration * frequency / RULE.stable, 1.0)
    if steps * RULE.of_dop853 * (1.0 + replay) > RULE.short:
        return None
    pace = duration / steps
    candidates = Contender("dop853", 1.0, pace), Contender("radau", cost, pace / RULE.last_resort)
    return Choice("dop853", f"{steps:.3g} steps are stable at {frequency:.3g} rad/s: a short run", candidates)


def faster_of(
    frequency: Array, damping_ratio: Array, excited: Array, tolerance: float, times: Array, starts: int, cost: float
) -> Choice:
    """DOP853 or Radau IIA, whichever is expected to be faster, with the other to take over where it is not.

    `frequency` (n,) rad/s, ascending, and `damping_ratio` (n,) of n vibrations; `excited` (n,): initial sizes, no unit,
    relative to elastic forces. No step goes beyond an output at `times` (T,), s. Radau has to find its step size
    `starts` times; its steps have a `cost` in DOP853 steps.
    """
    # damped more than critically a vibration falls faster than it would swing
    top = (frequency * np.maximum(1.0, 2 * damping_ratio)).max()
    duration, scale = float(np.ptp(times)), tolerance / 1e-4
    phase = partial(_ringing_phase, frequency, damping_ratio, excited, duration)
    explicit = phase(RULE.negligible_dop853 * tolerance) / (RULE.resolved_dop853 * scale ** (1 / 8))
    implicit = phase(RULE.negligible_radau * tolerance) / (RULE.resolved_radau * scale ** (1 / 5))
    explicit = max(duration * top / RULE.stable, explicit)
    implicit = max(len(times), implicit) + RULE.steps_to_start * starts
    rings = excited > tolerance
    felt = f"{frequency[rings].max():.3g} rad/s" if rings.any() else "none"
    reason = f"highest natural frequency {top:.3g} rad/s, highest excited frequency {felt}"
    dop853 = Contender("dop853", 1.0, duration / explicit)
    radau = Contender("radau", cost, duration / (cost * implicit))
    first, second = (radau, dop853) if radau.pace > dop853.pace else (dop853, radau)
    return Choice(first.name, reason, (first, second))


def beyond_round_off(tolerance: float, run: _core.TreeRun, of_gears: float) -> str:
    """A warning where relative round-off of `run`, or `of_gears` in torques behind gears, exceeds the tolerance.

    Near singular postures, constraint equations determine forces only to double precision over r², where r is the
    least ratio of singular values of these equations in the run. "" where nothing exceeds it.
    """
    of_posture = float(np.finfo(float).eps) / run.least_ratio**2 if run.least_ratio > 0.0 else 0.0
    if not (round_off := max(run.rounding, of_posture, of_gears)) > tolerance:
        return ""
    digit = 10.0 ** np.floor(np.log10(round_off))
    cause = "parts with next to no inertia amplify round-off of forces"
    if of_gears >= 0.01 * round_off:
        cause = "stiff gears amplify round-off of angles"
    elif of_posture >= 0.01 * round_off:
        cause = "nearly singular postures amplify round-off of forces"
    return (
        f"a tolerance of {tolerance:g} is below round-off here: accelerations of joints scatter, as {cause};"
        f" errors may reach {round_off:.1g} of the peaks, which tolerance ="
        f" {np.ceil(round_off / digit) * digit:.1g} allows"
    )


def unmet(choice: Choice, run: _core.TreeRun) -> str:
    """A sentence on the last steps of a `run` in which they became too short, with advice."""
    if run.last_step == 0:
        return (
            "the first step would be too short to change the time: accelerations or frequencies are that large;"
            " check units"
        )
    if run.last_error <= 1:
        saw = f"steps fell to {run.last_step:.2g} s, where round-off sets the error"
    elif np.isfinite(run.last_error):
        saw = f"a step of {run.last_step:.2g} s still errs by {run.last_error:.2g} times what it may"
    else:
        saw = f"the equations of a step of {run.last_step:.2g} s could not be solved"
    return (
        f"{saw} ({choice.name}), and neither loads nor the configuration explain it; loosen the tolerance, or use"
        " another integrator"
    )


def _ringing_phase(omega: Array, damping_ratio: Array, excited: Array, end: float, threshold: float) -> float:
    """∫ ω dt (rad) up to `end`, ω the highest frequency that still rings above the threshold."""
    phase, covered = 0.0, 0.0
    for i in np.flatnonzero(excited > threshold)[::-1]:
        decay = damping_ratio[i] * omega[i]
        lasts = end if decay <= 0 else min(end, float(np.log(excited[i] / threshold)) / decay)
        phase += float(omega[i]) * max(0.0, lasts - covered)
        covered = max(covered, lasts)
    return phase


TOO_STIFF = 1e6  # rates of friction in a run above which explicit steps, a few of its times long, are too many


def integrator_of(model: Model, name: str) -> str:
    """The integrator `name` of a scene, or for "auto" one for the whole run.

    That is Radau where dry friction acts on links with modes: near rest it is a damper so stiff for the light ends of
    links that explicit steps take nanoseconds; else DOP853.
    """
    if name != "auto":
        return name
    return "radau" if _sticks(model) else "dop853"


def choose_integrator(
    system: MultibodySystem,
    analysis: IntegratedAnalysis,
    start: State,
    times: Array,
    stiffness: "Stiffness",
    *,
    is_sampled: bool,
) -> Choice:
    """The integrator for an analysis from `start`, of this `stiffness`, with outputs at `times` (T,), s.

    With a controller (`is_sampled`) steps start anew at each sample, and no other integrator takes over.
    """
    model = system.model
    if analysis.integrator != "auto":
        return Choice(analysis.integrator, ASKED_FOR)
    if len(times) == 1:
        return Choice("dop853", "nothing to integrate")
    if _sticks(model):
        return Choice("radau", "dry friction is a stiff damper to the light ends of links")
    if (rate := stiffness.friction) * float(np.ptp(times)) > TOO_STIFF:
        return Choice("radau", f"friction is a stiff damper: joints come to rest within {1 / rate:.1e} s")
    if not model.tree.gears and model.tree.is_rigid:
        return Choice("dop853", "nothing vibrates")
    if is_sampled:
        return Choice("dop853", "every sample of the controller begins anew")
    replayed = system.replayed
    if replayed is not None and replayed.integrator in (*EXPLICIT, "radau"):
        return Choice(replayed.integrator, "integrator of the run whose forces act")
    replay = 0.0 if replayed is None else replayed.evaluations
    cost = (RULE.of_radau + RULE.of_algebra * model.tree.n_v / (1.0 + replay)) / RULE.of_dop853
    choice = None if model.tree.gears else without_choosing(_of_links(model), float(np.ptp(times)), replay, cost)
    if choice is not None:
        return choice if replayed is None else choice._replace(candidates=())
    vibrations = vibrations_of(system, 0.0, start.q)
    if not len(vibrations.frequency):
        return Choice("dop853", "nothing vibrates")
    excited = _excitation(system, start, vibrations)
    starts = 1 + (0 if replayed is None else len(replayed.breaks))
    of = vibrations.frequency, vibrations.damping_ratio, excited
    choice = faster_of(*of, analysis.tolerance, times, starts, cost)
    # Under a replay the length of steps says less of what they cost: no integrator takes over.
    return choice if replayed is None else choice._replace(candidates=())


class Stiffness(NamedTuple):
    """How fast friction and compliant gears are in a state."""

    friction: float  # largest rate at which friction brings a joint to rest, 1/s
    joint: str  # label of this joint
    gears: float  # highest frequency of the gears without damping, rad/s
    damping: float  # largest rate of their damping, 1/s

    def describe(self, duration: float, integrator: str) -> str:
        """A sentence with advice where friction or gears are too fast for steps of the integrator; else ""."""
        if self.friction * duration > TOO_STIFF:
            implicit = 'integrator = "radau", ' if integrator in EXPLICIT else ""
            return (
                f"friction of {self.joint} brings it to rest within {1 / self.friction:.1e} s, which steps of"
                f" {integrator} cannot follow: use {implicit}less friction or a larger friction_speed"
            )
        if self.gears > max(TOO_STIFF / duration, self.damping / 2):
            return (
                f"compliant gears vibrate at {self.gears:.2g} rad/s, too fast for the run: give them damping or no"
                " stiffness"
            )
        return ""


def stiffness_of(system: MultibodySystem, at: State) -> Stiffness:
    """Friction, dry one at rest, and gears in the state `at`, under the constraints."""
    model = system.model
    friction, (K, D) = friction_damping(model, at.q, is_at_rest=True), gear_matrices(model.tree, at.q)
    if not (friction.any() or K.any()):
        return Stiffness(0.0, "", 0.0, 0.0)
    by_forces = system.core.derivatives(system.scene, 0.0, at.q, at.v, np.zeros(model.tree.n_v)).a_f
    rates, shapes = np.linalg.eig(by_forces @ friction)
    k = int(np.argmax(rates.real))
    share = np.abs(shapes[:, k])
    joint = max(model.tree.nodes, key=lambda node: share[node.v].max(initial=0.0)).joint
    square, damping = (float(np.linalg.eigvals(by_forces @ of).real.max()) for of in (K, D))
    return Stiffness(float(rates[k].real), joint.label, max(square, 0.0) ** 0.5, damping)


def _sticks(model: Model) -> bool:
    return bool(model.sticking) and not model.tree.is_rigid


def _of_links(model: Model) -> float:
    """The highest frequency of links alone, rad/s; damped more than critically it falls faster than it would swing."""
    bodies = [node.body for node in model.tree.nodes if node.body.n_modes]
    omega = [np.sqrt(body.stiffness) for body in bodies]
    rates = [np.diagonal(body.damping) for body in bodies]
    return float(np.maximum(np.concatenate(omega), np.concatenate(rates)).max())


def _excitation(system: MultibodySystem, start: State, vibrations: Vibrations) -> Array:
    """Size (n,) with which each vibration rings from `start` on, in the elastic forces of a link, relative to these.

    A mode at rest follows its load and the links' static deflection; the velocity v, the acceleration a or the jerk j
    about that with which it starts is the vibration v/ω, a/ω², j/ω³. What the robot does beside following statically
    is what changes its elastic forces: φᵀ K q̇ = ω² v, and so on. Gears carry at least what the norm of errors takes for
    small (core/recursion/motion/motion_norm.h).
    """
    model, omega, K = system.model, vibrations.frequency, vibrations.springs
    dt = (1e-3 if system.replay is None else 0.1) / float(omega.max())  # round-off of what is replayed is no jerk
    q, v, a = start.q, start.v, _acceleration(system, 0.0, start, system.replay)
    later = State(model.tree.integrate(q, dt * v), v + dt * a)
    jerk = (_acceleration(system, dt, later, system.replay) - a) / dt
    project = (K @ vibrations.shape).T / omega[:, None] ** 2
    amplitude = np.abs(project @ v) / omega + np.abs(project @ a) / omega**2 + np.abs(project @ jerk) / omega**3
    forces = K @ vibrations.shape * amplitude
    springs = [(node.p_v, node.body.stiffness * q[node.p_q]) for node in model.tree.nodes if node.body.n_modes]
    for gear in model.tree.gears:
        least = _core.small_twist * max(gear.spring.slopes)
        springs.append((gear.joint.v, np.append(gear.spring.moment(gear.twist(q, v)[0]), least)))
    of_each = np.array([np.linalg.norm(forces[columns], axis=0) for columns, _ in springs])
    carried = [of for _, of in springs]
    if system.replay is not None:  # which may carry what would bend links
        alone = _acceleration(system, 0.0, start, None)
        carried = [np.append(of, alone[columns]) for columns, of in springs]
    sizes = np.array([np.linalg.norm(of) for of in carried]) + of_each.sum(axis=1)
    sizes = np.maximum(sizes, max(1e-3 * float(sizes.max()), 1e-300))
    return (of_each / sizes[:, None]).max(axis=0)


def _acceleration(system: MultibodySystem, t: float, state: State, replay: _core.Replay | None) -> Array:
    """(n_v,) at time t."""
    states = np.concatenate([state.q, state.v])[None]
    core, scene, _ = system.integrated
    return _core.tree_outputs(core, scene, [t], states, replay).accelerations[0]
