"""Readings of sensors and commands of actuators by name, as linear models name them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from ...common.arrays import Array
from ...mbs import _core
from ...mbs.joints.measure import Marker, Measure
from ...mbs.model.model import Model
from ...mbs.model.system import MechanismSystem
from ..context import PlanarWholeLinks, place_of
from ..patches.patches import PatchArray
from .records import PERMITTIVITY, Sensor

AnyReading = TypeVar("AnyReading", bound="Reading")
ORDERS = {"value": 0, "rate": 1, "acceleration": 2}


@dataclass(frozen=True)
class Reading:
    """One reading.

    `name`: "joint/NAME", "motor/NAME", "point/BODY.POINT/x" or y, "pzt/BODY/k", "modal/BODY/k" (k from 1), with
    "/rate" or "/acceleration" behind it where that is read. `order` counts derivatives, `resolution` and `noise` are
    those of `Sensor`.
    """

    name: str
    order: int
    resolution: float
    noise: float


@dataclass(frozen=True)
class Signal(Reading):
    """In the plane: either `row` is read, or `vector` . p of the `bodies`, p of one beside that of the next."""

    row: Measure | None = None
    bodies: tuple[str, ...] = ()
    vector: Array = field(default_factory=lambda: np.zeros(0))


def signals(
    model: Model, patches: Mapping[str, PatchArray], sensor: Sensor, whole: PlanarWholeLinks | None = None
) -> Iterator[Signal]:
    """The readings of one sensor of the scene, of whose links some are in pieces where there are `whole` ones."""
    order, ending = ORDERS[sensor.measure], "" if sensor.measure == "value" else f"/{sensor.measure}"
    quality = sensor.resolution, sensor.noise
    if sensor.joint is not None:
        yield Signal(f"joint/{sensor.joint}{ending}", order, *quality, model.scene.coordinate(sensor.joint))
    elif sensor.motor is not None:
        yield Signal(f"motor/{sensor.motor}{ending}", order, *quality, model.motors[sensor.motor])
    elif sensor.point is not None:
        body, _, point = place_of(whole, sensor.point).partition(".")
        for axis in ("x", "y"):
            row = Measure(
                f'sensor on "{sensor.point}"', getattr(_core.MeasureKind, axis), Marker(None), Marker(body, point)
            )
            yield Signal(f"point/{sensor.point}/{axis}{ending}", order, *quality, row)
    elif sensor.pzt is not None:
        for k, vector in enumerate(volts_per_modal_coordinate(patches[sensor.pzt], sensor.capacitance), 1):
            carriers = patches[sensor.pzt].carriers
            yield Signal(f"pzt/{sensor.pzt}/{k}", order, *quality, bodies=carriers, vector=vector)
    elif sensor.modal is not None:
        bodies, rows = _modal_coordinates(model, sensor.modal, whole)
        for k, vector in enumerate(rows, 1):
            yield Signal(f"modal/{sensor.modal}/{k}{ending}", order, *quality, bodies=bodies, vector=vector)


def _modal_coordinates(model: Model, link: str, whole: PlanarWholeLinks | None) -> tuple[tuple[str, ...], Array]:
    """The bodies whose modes make up those of a link, and p of the link (n, …) in theirs."""
    if whole is None or link not in whole.divided:
        return (link,), np.eye(model.body(link).n_modes)
    return whole.divided[link].bodies, whole.divided[link].gathered


def volts_per_modal_coordinate(patches: PatchArray, capacitance: float | None = None) -> Array:
    """Voltage (k, n) of each patch per modal coordinate: by how much that turns its ends against each other."""
    return volts_per_turn(patches, capacitance)[:, None] * patches.turn.T


def volts_per_turn(patches: PatchArray, capacitance: float | None = None) -> Array:
    """Voltage (k,) of each patch per turn: its charge c [φ'(x2) − φ'(x1)] over its capacitance.

    By reciprocity the charge of a rotation is the moment of a voltage, c (Lee and Moon, J. Appl. Mech. 57, 1990). The
    capacitance of a patch is ε w l/t_p of each layer; one that also drives the link is read through a bridge, which
    leaves this voltage (Dosch, Inman and Garcia, J. Intell. Mater. Syst. Struct. 3, 1992).
    """
    layout = patches.layout
    faces = 2 if layout.face == "both" else 1
    own = faces * layout.layers * PERMITTIVITY * layout.width * layout.length / layout.thickness
    return patches.moment_per_volt / (own if capacitance is None else capacitance)


def merged(given: Iterable[AnyReading], needed: Iterable[AnyReading]) -> tuple[AnyReading, ...]:
    """The sensors of the scene, and ideal ones for what controllers need besides."""
    by_name = {signal.name: signal for signal in needed} | {signal.name: signal for signal in given}
    return tuple(by_name.values())


def rows_first(read: Iterable[Signal]) -> tuple[Signal, ...]:
    """As the core has them."""
    return tuple(sorted(read, key=lambda signal: signal.row is None))


def sensing(assembly: MechanismSystem, read: Sequence[Signal]) -> _core.Sensing:
    """What reads these signals in the core; the motor rows of `assembly` are those of the signals along rows."""
    orders = [signal.order for signal in read if signal.row is not None]
    along = list(zip(assembly.motor_measures, orders, strict=True))
    modal = [(assembly.index[s.bodies[0]], s.vector, s.order) for s in read if s.row is None]
    return _core.Sensing(assembly.system, along, modal)
