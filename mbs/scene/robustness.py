"""Under which deviations from its model an analysis simulates its result again. SI units."""

from math import pi
from typing import Annotated

from pydantic import Field

from ...common.validation import Record
from ..fields.field_types import NotEmpty, NotNegative, Positive

Share = Annotated[float, Field(gt=0.0, lt=1.0)]


class Robustness(Record):
    """Deviations from the model, each alone, under which the torques and voltages of the result are simulated again.

    The summary has the largest distance of the tip from the computed motion: open loop, and with a sampled PD
    controller of the joints in addition, on quantized encoders and without rate sensors. Encoders of joints with
    compliant gears are on the motors.
    """

    sample_time: Positive = 1e-3
    """Time for which a zero-order hold keeps commands, and between samples of the controller, s."""
    parameters: Annotated[tuple[Share, ...], NotEmpty] = (0.01, 0.05)
    """Relative changes of the stiffness and of the mass of all flexible links, in both directions."""
    gears: tuple[Share, ...] = (0.1,)
    """Relative changes of the stiffness of compliant gears, in both directions."""
    force: NotNegative = 0.01
    """Constant force on the tip, along each axis in turn, N."""
    resolution: Positive = 2 * pi / 2**20
    """Increment of the encoders, rad at the joint (prismatic: m)."""
    bandwidth: Positive | None = None
    """Bandwidth of the joint controller, critically damped with rigid links, rad/s; default: half the lowest natural
    frequency of links and compliant gears, less where its samples are too slow for these."""
