"""From the controllers of a scene to the objects that act, and the sensors they need."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...common.arrays import Array
from .controllers import (
    ComputedTorqueControl,
    Controller,
    PythonControl,
    Setup,
    joint_pid,
    load_function,
    modal_velocity,
)
from .records import ComputedTorque, JointPid, Lqr, ModalVelocity, PythonController, Sensor
from .records import Controller as Record
from .robot import Robot


def needed_sensors(robot: Robot, controllers: Sequence[Record]) -> Iterator[Sensor]:
    """Sensors without which the `controllers` of an analysis could not act; ideal unless the scene gives them."""
    for record in controllers:
        if isinstance(record, JointPid):
            for joint in record.joints:
                yield Sensor.model_validate({record.side: joint})
                if joint in record.derivative and record.rate == "measured":
                    yield Sensor.model_validate({record.side: joint, "measure": "rate"})
        elif not isinstance(record, PythonController | ModalVelocity):
            for joint in robot.motor_joints:
                yield Sensor(joint=joint)
                yield Sensor(joint=joint, measure="rate")
        if isinstance(record, ModalVelocity | Lqr):
            bodies = record.bodies if isinstance(record, ModalVelocity) else _bending(robot, record.sensor)
            for body in bodies:
                if record.sensor == "pzt":
                    yield from (Sensor(pzt=layout) for layout in robot.patches[body].layouts)
                else:
                    yield Sensor(modal=body)
                    yield Sensor(modal=body, measure="rate")


def _bending(robot: Robot, sensor: str) -> list[str]:
    return list(robot.patches if sensor == "pzt" else robot.links)


def make_controller(record: Record, setup: Setup, beside: Sequence[Record]) -> Controller:
    """The controller of one table of the scene, acting with those `beside`.

    Raises `InputError` where it does not fit the robot.
    """
    if isinstance(record, JointPid):
        return joint_pid(record, setup, joint_mobility(setup))
    if isinstance(record, ModalVelocity):
        return modal_velocity(record, setup)
    if isinstance(record, ComputedTorque):
        return ComputedTorqueControl(record, setup, setup.robot.rigid())
    if isinstance(record, Lqr):
        from .lqr import LqrControl

        return LqrControl(record, setup, [other for other in beside if isinstance(other, JointPid)])
    label = f"{setup.robot.path}: controller: {record.python}"
    folder = setup.robot.path.parent
    function = load_function(record.python, folder) if isinstance(record.python, str) else record.python
    return PythonControl(function, setup, label)


def joint_mobility(setup: Setup) -> Array:
    """(motors,) acceleration of each joint per moment on it at the start, links rigid, the other joints free."""
    rest = np.zeros(len(setup.robot.motors))
    if not setup.robot.motors_fit:
        return rest
    arm = setup.robot.rigid()
    M, _ = arm.terms(arm.angles(), rest)
    mobility: Array = np.diag(np.linalg.inv(M))
    return mobility
