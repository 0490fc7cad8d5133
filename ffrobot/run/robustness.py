"""What is left of a computed motion where the robot is not its model: a table of simulations, of one cause each."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ..actuation.context import ActuatedContext
from ..actuation.control.closed_loop import ClosedLoop, position
from ..actuation.control.records import JointPid, Sensor
from ..actuation.control.robot import ControlledRobot, default_tip
from ..common.arrays import Array
from ..common.errors import SolveError
from ..common.structs import struct
from ..mbs.analysis.forward import Forward
from ..mbs.joints.joint import GearedJoint, stiffer
from ..mbs.linear.statics import static_equilibrium
from ..mbs.model.body import scaled
from ..mbs.model.build import build_model
from ..mbs.model.gears import elastic_joints, with_compliance
from ..mbs.model.known_motion import State, mass_matrices
from ..mbs.model.model import Model
from ..mbs.model.system import MultibodySystem
from ..mbs.posture.prescribed import following_motors
from ..mbs.run.context import place_of
from ..mbs.run.gears import with_motor_coordinates
from ..mbs.run.record import Run
from ..mbs.scene.analysis import Robustness
from ..mbs.scene.loads import Load
from ..scene.scene import Scene

SAMPLED = 0.25  # of the rate with which damping acts on bending links, 1/sample time: half of it per unit of bandwidth
LOOSEST = 1e-6  # tolerance of the simulations: open-loop arms add up errors


@struct
class Deviations:
    """Largest distance (m) of the tip from the computed motion in simulations with one cause of deviation each.

    NaN where it has no meaning, infinite where the simulation ended early. `bandwidth` (rad/s): of the controller.
    """

    causes: tuple[str, ...]
    lanes: Mapping[str, Array]  # (causes,) by use of the inputs: "open_loop", "joint_control", …
    bandwidth: float


def robust(scene: Scene) -> Scene:
    """Return the scene with robustness turned on for all analyses that support it."""
    changed = [
        one.model_copy(update={"robustness": Robustness()}) if getattr(one, "robustness", one) is None else one
        for one in scene.analysis
    ]
    return scene.model_copy(update={"analysis": tuple(changed)})


def deviations(context: ActuatedContext, source: Run) -> Deviations:
    """The robustness table of a run `source`, simulated again for each cause."""
    asked: Robustness = source.analysis.robustness  # type: ignore[attr-defined]
    held = f"zero-order hold of {1e3 * asked.sample_time:g} ms"
    runs, nominal = _Runs(context, source, asked), context.model
    robots: dict[str, list[Model]] = {"as computed": [nominal], held: [nominal]}
    for cause, robot in varied_robots(nominal, asked):
        robots.setdefault(cause, []).append(robot)
    scene, tip = nominal.scene, runs.points[-1]
    forces = [Load.model_validate({"point": tip, axis: f"{asked.force!r}"}) for axis in "xyz"[: 3 - scene.is_planar]]
    robots[f"{asked.force:g} N at the tip"] = [
        build_model(scene.model_copy(update={"load": (*scene.load, force)}), _bodies(nominal)) for force in forces
    ]

    def lane(run: Callable[[Model], Run], *, is_sampled: bool) -> Array:
        """Return the largest error for each cause; NaN "as computed" for runs that are sampled in any case."""
        first = [np.nan] if is_sampled else [runs.worst(run, [nominal]), runs.worst(runs.held, [nominal])]
        return np.array(first + [runs.worst(run, of) for of in list(robots.values())[len(first) :]])

    lanes = {
        "open_loop": lane(runs.replayed, is_sampled=False),
        "joint_control": lane(runs.controlled, is_sampled=True),
    }
    if runs.applied != "joints":
        lanes["joint_control_without_voltages"] = lane(partial(runs.controlled, part="joints"), is_sampled=True)
    return Deviations(tuple(robots), lanes, runs.bandwidth)


def varied_robots(model: Model, asked: Robustness) -> Iterator[tuple[str, Model]]:
    """Yield cause and robot with more or less stiffness or mass of links, or stiffness of gears; one cause for both."""
    scene, bodies = model.scene, _bodies(model)
    for what in ("stiffness", "mass"):
        for share, factor in _both_ways(asked.parameters):
            varied = [scaled(body, **{what: factor}) if body.n_modes else body for body in bodies]
            yield f"{what} ± {100 * share:g} %", build_model(scene, varied)
    for share, factor in _both_ways(asked.gears if elastic_joints(model) else ()):
        joints = tuple(
            joint.model_copy(update={"stiffness": stiffer(joint.stiffness, factor)})
            if isinstance(joint, GearedJoint) and joint.stiffness is not None
            else joint
            for joint in scene.joint
        )
        yield f"gear stiffness ± {100 * share:g} %", build_model(scene.model_copy(update={"joint": joints}), bodies)


def _both_ways(shares: Sequence[float]) -> Iterator[tuple[float, float]]:
    return ((share, 1.0 + sign * share) for share in shares for sign in (-1, 1))


def _bodies(model: Model) -> list[Any]:
    names = {body.name for body in model.scene.body}
    return [node.body for node in model.tree.nodes if node.body.name in names]


class _Runs:
    """Simulations of other robots under what `source` found."""

    def __init__(self, context: ActuatedContext, source: Run, asked: Robustness) -> None:
        given, scene = source.analysis, context.model.scene
        self.context = replace(context, outcomes={**context.outcomes, given.name: source}, earlier=None)
        self.source, self.asked = source, asked
        self.applied = "joints+pzt" if "joints+pzt" in given.applicable else "joints"
        followed = dict.fromkeys(scene.path_points)
        self.points = [place_of(context.whole, point) for point in followed] or [default_tip(source.model)]
        self.keys = {
            "name": "robustness",
            "actuation": given.name,
            "end": given.last_time,
            "output_step": getattr(given, "output_step", 0.0),
            "tolerance": min(given.tolerance, LOOSEST),
        }
        self.wanted = [position(source.model, source.q, point) for point in self.points]
        self.controller = self._controller()

    def _controller(self) -> dict[str, Any]:
        """Critically damped with rigid links and gears; slow enough for its samples where they give way to motors."""
        model, T = self.context.model, self.asked.sample_time
        rigid = ControlledRobot(model.without_paths(), self.context.patches, self.source).rigid().mobility()
        mobility = model.by_motor(rigid)
        geared, start = self._geared(model)
        giving = np.diag(np.linalg.inv(mass_matrices(MultibodySystem(geared), start.q[None])[0]))[geared.motor_columns]
        squares = [float(node.body.stiffness.min()) for node in model.tree.nodes if node.body.n_modes]
        squares += [min(gear.spring.slopes) * mobility[gear.joint.joint.name].max() for gear in geared.tree.gears]
        slow_enough = SAMPLED * float((rigid / giving).min())
        self.bandwidth = self.asked.bandwidth or min(0.5 * min(squares, default=4.0 / T**2) ** 0.5, slow_enough / T)
        sides = dict.fromkeys(model.motors, "joint") | {gear.joint.joint.name: "motor" for gear in geared.tree.gears}
        gains = {joint: float((1.0 / of).min()) * self.bandwidth**2 for joint, of in mobility.items()}

        def pid(side: str) -> JointPid:
            P = {joint: gain for joint, gain in gains.items() if sides[joint] == side}
            D = {joint: 2.0 * gain / self.bandwidth for joint, gain in P.items()}
            keys = {"kind": "joint-pid", "side": side, "rate": "difference", "proportional": P, "derivative": D}
            return JointPid.model_validate(keys)

        read = {"resolution": self.asked.resolution}
        encoders = (Sensor.model_validate(read | {side: joint}) for joint, side in sides.items())
        return {"controller": tuple(map(pid, sorted(set(sides.values())))), "sensor": tuple(encoders)}

    def replayed(self, model: Model) -> Run:
        """Under the torques and voltages of the source, at any time."""
        return self._run(Forward.model_validate({**self.keys, "kind": "forward", "apply": self.applied}), model)

    def controlled(self, model: Model, part: str = "") -> Run:
        """Sampled, with the controller of the joints."""
        return self.held(model, part, self.controller)

    def held(self, model: Model, part: str = "", controller: Mapping[str, Any] | None = None) -> Run:
        """Sampled, with a controller beside them or without."""
        keys = {"kind": "closed-loop", "sample_time": self.asked.sample_time, "feed_forward": part or self.applied}
        return self._run(ClosedLoop.model_validate({**self.keys, **keys, **(controller or {})}), model)

    def _run(self, analysis: Any, model: Model) -> Run:
        run = analysis.run(replace(self.context, model=model, start=self._start(model)))
        assert isinstance(run, Run)
        return run

    def _geared(self, model: Model) -> tuple[Model, State]:
        """The robot alone with its compliant gears, and in its coordinates where the source begins."""
        alone = with_compliance(model.without_paths())
        moved = with_motor_coordinates(self.source, alone)
        return alone, State(moved.q[0], moved.v[0])

    def _start(self, model: Model) -> State | None:
        """At rest with the motors where those of the source begin, links in equilibrium; None for its own model."""
        if model is self.context.model:
            return None
        alone, start = self._geared(model)
        q = start.q.copy()
        for node in alone.tree.nodes:
            q[node.p_q] = 0.0
        return static_equilibrium(following_motors(alone, q), State(q, 0.0 * start.v))

    def worst(self, run: Callable[[Model], Run], robots: Sequence[Model]) -> float:
        """The largest distance, m, of the followed points from where they are to be; infinite where a run fails."""
        most = 0.0
        for robot in robots:
            try:
                simulated = run(robot)
            except SolveError:
                return np.inf
            if simulated.failed or len(simulated.time) < len(self.source.time):
                return np.inf
            offs = (
                np.linalg.norm(position(simulated.model, simulated.q, p) - at, axis=1)
                for p, at in zip(self.points, self.wanted, strict=True)
            )
            most = max(most, *(float(off.max()) for off in offs))
        return most
