"""From the controllers of a scene to the objects that act, and the sensors they need."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...common.arrays import Array
from ...mbs.model.model import Model
from ..patches.patches import PatchArray
from .controllers import Controller, Setup, joint_pid, modal_velocity
from .python_controller import PythonControl, load_function
from .records import ComputedTorque, JointPid, Lqr, ModalVelocity, PythonController, Sensor
from .records import Controller as Record
from .rigid_arm import ComputedTorqueControl, RigidArm


def needed_sensors(model: Model, controllers: Sequence[Record], patches: Mapping[str, PatchArray]) -> Iterator[Sensor]:
    """Sensors without which the `controllers` of an analysis could not act; ideal unless the scene gives them."""
    for record in controllers:
        if isinstance(record, JointPid):
            for joint in record.joints:
                yield Sensor.model_validate({record.side: joint})
                if joint in record.derivative and record.rate == "measured":
                    yield Sensor.model_validate({record.side: joint, "measure": "rate"})
        elif not isinstance(record, PythonController | ModalVelocity):
            for joint in model.motors:
                yield Sensor(joint=joint)
                yield Sensor(joint=joint, measure="rate")
        if isinstance(record, ModalVelocity | Lqr):
            bodies = record.bodies if isinstance(record, ModalVelocity) else _bending(model, record.sensor, patches)
            for body in bodies:
                if record.sensor == "pzt":
                    yield Sensor(pzt=body)
                else:
                    yield Sensor(modal=body)
                    yield Sensor(modal=body, measure="rate")


def _bending(model: Model, sensor: str, patches: Mapping[str, PatchArray]) -> list[str]:
    return list(patches) if sensor == "pzt" else [body.name for body in model.bodies if body.n_modes]


def make_controller(record: Record, setup: Setup, beside: Sequence[Record]) -> Controller:
    """The controller of one table of the scene, acting with those `beside`.

    Raises `InputError` where it does not fit the robot.
    """
    if isinstance(record, JointPid):
        return joint_pid(record, setup, joint_mobility(setup))
    if isinstance(record, ModalVelocity):
        return modal_velocity(record, setup)
    if isinstance(record, ComputedTorque):
        return ComputedTorqueControl(record, setup, RigidArm(setup.model))
    if isinstance(record, Lqr):
        from .lqr import LqrControl

        return LqrControl(record, setup, [other for other in beside if isinstance(other, JointPid)])
    label = f"{setup.model.scene.path}: controller: {record.python}"
    function = load_function(record.python) if isinstance(record.python, str) else record.python
    return PythonControl(function, setup, label)


def joint_mobility(setup: Setup) -> Array:
    """(motors,) acceleration of each joint per moment on it at the start, links rigid, the other joints free."""
    model = setup.model
    if len(model.motors) != model.degrees_of_freedom:
        return np.zeros(len(model.motors))
    arm = RigidArm(model)
    M, _ = arm.terms(arm.angles(setup.source), np.zeros(len(model.motors)))
    mobility: Array = np.diag(np.linalg.inv(M))
    return mobility
