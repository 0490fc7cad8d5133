"""What is to be said of motors from a catalog among the variables of `optimise`: mass, cost, share of their limits."""

from __future__ import annotations

from dataclasses import dataclass

from ..actuation.catalog import CatalogMotor, choice_of
from ..common.errors import InputError
from ..present.motor_choice import joint_tasks
from ..results.file import Results
from ..sweep.files import value_of
from .readings import Goal, Reading
from .variables import Variable


@dataclass(frozen=True)
class OfMotors(Goal):
    """Of the motors of the variables `chosen`: the sum of `what`, "mass" or "cost"; or the largest "share".

    The share is that of rated torque (by the RMS), of peak torque, or of speed.
    """

    text: str
    what: str
    chosen: tuple[Variable, ...] = ()

    def read(self, results: Results) -> Reading:
        """By the scene that the results have, and of shares by its motion."""
        if not self.chosen:
            raise InputError(f'"{self.text}": expected `optimise` with --vary "motor JOINT in CATALOG", found none')
        motors = {variable.keys[0][1]: _of_scene(results, variable) for variable in self.chosen}
        if self.what == "share":
            return Reading(max(self._share(results, joint, *motor) for joint, motor in motors.items()), "")
        values = []
        for motor, _ in motors.values():
            if (value := getattr(motor, self.what)) is None:
                raise InputError(f'"{self.text}": expected a {self.what} of motor "{motor.name}", found none')
            values.append(value)
        return Reading(sum(values), "kg" if self.what == "mass" else "")

    def _share(self, results: Results, joint: str, motor: CatalogMotor, ratio: float) -> float:
        tasks = (task for name in results.analyses for of, task in joint_tasks(results, name) if of == joint)
        shares = [max(choice_of(task, motor, ratio).shares) for task in tasks]
        if not shares:
            raise InputError(f'"{self.text}": expected a motion of joint "{joint}" with its torque, found none')
        return max(shares)


def _of_scene(results: Results, variable: Variable) -> tuple[CatalogMotor, float]:
    """The motor that a joint has, and its ratio."""
    row = tuple(value_of(results.scene, key) for key in variable.keys)
    return variable.motors[variable.rows.index(row)], row[0]
