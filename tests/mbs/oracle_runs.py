"""Analyses of planar robots, and what they found in coordinates (R, θ, p) of one body after the other."""

from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from mechanisms import always
from moving_trees import state_of
from tree_oracle import row_values, target_rates

from ffrobot.mbs import _core
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.posture.path_start import path_start
from ffrobot.mbs.posture.start import undeformed_posture
from ffrobot.mbs.quantities.motion import acting_forces, body_motion, node_of, plane_angle, section_motion
from ffrobot.mbs.quantities.reactions import reactions
from ffrobot.mbs.quantities.supply import actuator_forces, motor_moments, path_force, totals
from ffrobot.mbs.run.context import Context
from ffrobot.mbs.scene.analysis import IntegratedAnalysis


class JointForces(NamedTuple):
    """On the second side: force (T, 2), and what the motor does (T,), None without one."""

    reaction: np.ndarray
    motor: np.ndarray | None


class Seen:
    """An outcome in the plane: (R, θ, p) of all bodies side by side; what else is asked of it, the outcome has."""

    def __init__(self, robot, outcome):
        self.robot, self.outcome = robot, outcome

    def __getattr__(self, name):
        return getattr(self.outcome, name)

    @property
    def motion(self):
        return self.outcome

    def _of_bodies(self, frame, modes, p):
        found = []
        for body in self.robot.bodies:
            node = node_of(self.motion, body.name)
            found += [frame(body.name), modes[:, getattr(node, p)]]
        return np.hstack(found)

    @cached_property
    def q(self):
        def frame(name):
            return np.column_stack([body_motion(self.motion, name).position[:, :2], plane_angle(self.motion, name)])

        return self._of_bodies(frame, self.outcome.q, "p_q")

    @cached_property
    def v(self):
        def frame(name):
            moving = body_motion(self.motion, name)
            return np.column_stack([moving.velocity[:, :2], moving.angular_velocity[:, 2]])

        return self._of_bodies(frame, self.outcome.v, "p_v")

    @cached_property
    def a(self):
        def frame(name):
            a, alpha, _ = acting_forces(self.motion).of_body(self.outcome.model.tree.index[name])
            return np.column_stack([a[:, :2], alpha[:, 2]])

        return self._of_bodies(frame, self.outcome.a, "p_v")

    def coordinates(self, body):
        first, names = 0, [one.name for one in self.robot.bodies]
        for one in self.robot.bodies[: names.index(body)]:
            first += 3 + one.n_modes
        return slice(first, first + 3 + self.robot.body(body).n_modes)

    def modal_columns(self, body):
        """Of `F_p`."""
        here, before = self.coordinates(body), 3 * [one.name for one in self.robot.bodies].index(body)
        return slice(here.start - before, here.stop - before - 3)

    @property
    def tau(self):
        """(T, motors)."""
        return np.column_stack(
            [motor_moments(self.motion)[joint.name][:, 0] for joint in self.robot.scene.motor_joints]
        )

    @property
    def F_p(self):
        """(T, modes of all bodies), what patches would have to supply."""
        modal = actuator_forces(self.motion).modal
        return np.hstack([modal[body.name] @ body.modal_transform for body in self.robot.bodies])

    @property
    def lambda_(self):
        """(T, components) multipliers of the trajectories; where there are none, minus the reactions of joints."""
        if not self.robot.scene.trajectory:
            return -np.hstack([wrench[0][:, :2] for wrench in reactions(self.motion).values()])
        return -np.hstack([path_force(self.motion, path.name) for path in self.robot.scene.trajectory])


def run(robot, analysis, source=None, patches=None, progress=always, earlier=None):
    """What `analysis` finds, after that of `source`; integrations are recorded."""
    outcomes = {} if source is None else {source.analysis.name: source.outcome}
    context = Context(
        model=robot.model, outcomes=outcomes, progress=progress, earlier=earlier, patches=patches or {},
        path=path_start(robot.model, analysis.last_time) if analysis.starts_on_path else None,
        is_replayed=isinstance(analysis, IntegratedAnalysis) and analysis.kind != "forward",
    )  # fmt: skip
    return Seen(robot, analysis.run(context))


def place_of(seen, point):
    """Position (T, 2) of "BODY.POINT"."""
    return section_motion(seen.motion, point).r[:, :2]


def joint_forces(seen, joint):
    wrench = reactions(seen.motion)[joint]
    moments = motor_moments(seen.motion)
    return JointForces(wrench[0][:, :2], moments[joint][:, 0] if joint in moments else None)


def total_energy(seen):
    """(T,), and its kinetic part."""
    parts = totals(seen.motion)[0]
    return parts.kinetic + parts.strain + parts.gravitational, parts.kinetic


def evaluated(robot, t, q, v):
    """The accelerations and multipliers that the core finds in the plane, in a state of the tree, seen as a run."""
    system = MultibodySystem(robot.model)
    core, scene, _ = system.integrated
    found = _core.tree_outputs(core, scene, [t], np.concatenate([q, v])[None])
    state = state_of(robot.model, np.array([t]), q[None], v[None], found.accelerations)
    return Seen(robot, replace(state, multipliers=system.multipliers(found.multipliers)))


def posture_of(robot, rng, modal=0.05):
    """A state of the tree that meets all rows at t = 0, bent at random and moving."""
    model = robot.model
    q = undeformed_posture(model).q
    for node in model.tree.nodes:
        q[node.p_q] = modal * rng.standard_normal(node.body.n_modes)
    return on_rows(robot, q, rng.standard_normal(model.tree.n_v))


def on_rows(robot, q, v):
    """A state of the tree moved onto all rows at t = 0 by least steps."""
    model, at = robot.model, np.zeros(1)
    for _ in range(30):
        C, C_v = (x[0] for x in row_values(model, q[None], at))
        q = model.tree.integrate(q, -np.linalg.lstsq(C_v, C, rcond=None)[0])
    C_v = row_values(model, q[None], at)[1][0]
    rates = target_rates(model, q[None], at)[0]
    return q, v - np.linalg.lstsq(C_v, C_v @ v - rates, rcond=None)[0]
