"""Which integrator a scene asks for, by the vibrations of the robot.

Explicit steps are held by the highest frequency whether it is excited or not, implicit ones by the highest that rings
above the tolerance. The rule estimates the number of steps of both; a wrong one is found out in the run.
"""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array
from .. import _core
from ..linear.vibration import Vibrations, vibrations_of, without_rows
from ..model.gears import tree_resistance_slope
from ..model.known_motion import State
from ..model.model import Model
from ..model.system import MultibodySystem
from ..scene.analysis import IntegratedAnalysis
from .integrators import ASKED_FOR, EXPLICIT, RULE, Choice, faster_of, without_choosing

SMALL_TWIST = 1e-5  # rad
TOO_STIFF = 1e6  # rates of friction in a run above which explicit steps, a few of its times long, are too many


def integrator_of(model: Model, name: str) -> str:
    """Resolve the name of an integrator in a scene to a method, without switching during the run.

    "auto" is Radau where dry friction acts on links with modes: near rest it is a damper so stiff for the light ends of
    links that explicit steps take nanoseconds; else DOP853.
    """
    if name != "auto":
        return name
    return "radau" if _sticks(model) else "dop853"


def choose_integrator(
    system: MultibodySystem, analysis: IntegratedAnalysis, start: State, times: Array, *, is_sampled: bool
) -> Choice:
    """The integrator for an analysis from `start` with outputs at `times` (T,), s.

    Where a controller `is_sampled`, every sample starts anew and nothing takes over.
    """
    model = system.model
    if analysis.integrator != "auto":
        return Choice(analysis.integrator, ASKED_FOR)
    if len(times) == 1:
        return Choice("dop853", "nothing to integrate")
    if _sticks(model):
        return Choice("radau", "dry friction is a stiff damper to the light ends of links")
    if (rate := fastest_friction(system, start)[0]) * float(np.ptp(times)) > TOO_STIFF:
        return Choice("radau", f"friction is a stiff damper: joints come to rest within {1 / rate:.1e} s")
    if not model.tree.gears and not any(node.body.n_modes for node in model.tree.nodes):
        return Choice("dop853", "nothing vibrates")
    if is_sampled:
        return Choice("dop853", "every sample of the controller begins anew")
    replayed = system.replayed
    if replayed is not None and replayed.integrator in (*EXPLICIT, "radau"):
        return Choice(replayed.integrator, "integrator of the run whose forces act")
    replay = 0.0 if replayed is None else replayed.evaluations
    cost = RULE.cost_of_radau(model.tree.n_v, replay)
    choice = None if model.tree.gears else without_choosing(_of_links(model), float(np.ptp(times)), replay, cost)
    if choice is not None:
        return choice if replayed is None else choice._replace(candidates=())
    vibrations = vibrations_of(model, without_rows(model), 0.0, start.q)
    if not len(vibrations.frequency):
        return Choice("dop853", "nothing vibrates")
    excited = _excitation(system, start, vibrations)
    starts = 1 + (0 if replayed is None else len(replayed.breaks))
    of = vibrations.frequency, vibrations.damping_ratio, excited
    choice = faster_of(*of, analysis.tolerance, times, starts, cost)
    # Under a replay the length of steps says less of what they cost: no integrator takes over.
    return choice if replayed is None else choice._replace(candidates=())


def fastest_friction(system: MultibodySystem, at: State) -> tuple[float, str]:
    """Rate (1/s) at which friction brings a joint to rest, in the state `at`, at most; and which: 0 without friction.

    With D the slopes of friction at zero rates, the largest eigenvalue of M⁻¹ D, under what rows hold.
    """
    model, nothing = system.model, np.zeros(system.model.tree.n_v)
    D = np.diag(tree_resistance_slope(model.tree, nothing[None])[0]) + model.along_cut.damping(at.q)
    if not D.any():
        return 0.0, ""
    by_forces = system.derivatives(0.0, at.q, at.v, nothing).a_f
    rates, shapes = np.linalg.eig(by_forces @ D)
    fastest = int(np.argmax(rates.real))
    share = np.abs(shapes[:, fastest])
    joint = max(model.tree.nodes, key=lambda node: share[node.v].max(initial=0.0)).joint
    return float(rates[fastest].real), joint.label


def _sticks(model: Model) -> bool:
    nodes = model.tree.nodes
    joints = (*(node.joint for node in nodes), *model.tree.loops)
    has_friction = any(friction.coulomb > 0 for joint in joints for friction in joint.frictions)
    return has_friction and any(node.body.n_modes for node in nodes)


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
    small (core/recursion/motion/motion_norm.cpp).
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
        least = SMALL_TWIST * max(gear.spring.slopes)
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
