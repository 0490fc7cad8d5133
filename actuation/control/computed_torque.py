"""Computed torque: moments of the mechanism with rigid links for what the error is to do."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array
from .controllers import Setup
from .records import ComputedTorque
from .rigid_arm import RigidArm


class ComputedTorqueControl:
    """Moments for γ̈_ref + 2 ζ ω ė + ω² e with rigid links (Craig, Introduction to Robotics, sec. 10.4).

    They replace the moments of the feed-forward, which are taken off.
    """

    def __init__(self, record: ComputedTorque, setup: Setup, arm: RigidArm) -> None:
        motors = setup.robot.motors
        self.arm, self.bandwidth = arm, record.bandwidth
        self.gains = record.bandwidth**2, 2 * record.damping_ratio * record.bandwidth
        self.values = setup.columns(*(f"joint/{name}" for name in motors))
        self.rates = setup.columns(*(f"joint/{name}/rate" for name in motors))
        self.reference, self.feed_forward = setup.reference, setup.feed_forward
        self.accelerations = np.gradient(self.reference[:, self.rates], setup.times, axis=0, edge_order=2)

    def __call__(self, k: int, y: Array) -> Array:
        """Commands at sample k."""
        r, m = self.reference[k], len(self.values)
        e, e_dot = r[self.values] - y[self.values], r[self.rates] - y[self.rates]
        wanted = self.accelerations[k] + self.gains[0] * e + self.gains[1] * e_dot
        u: Array = np.zeros_like(self.feed_forward[k])
        u[:m] = self.arm.moments(y[self.values], y[self.rates], wanted) - self.feed_forward[k, :m]
        return u
