"""Types of fields in a scene file: names, points, references, expressions in t; checks of keys."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeVar

import numpy as np
from pydantic import AfterValidator, ValidationInfo

from ...common.arrays import Array
from ...common.deferred import ReadBy
from ...common.errors import InputError, quoted
from ...common.keys import Direction as Direction
from ...common.keys import ModeCount as ModeCount
from ...common.keys import Name as Name  # offered here, with the other types of keys
from ...common.keys import NotNegative as NotNegative
from ...common.keys import PatchCount as PatchCount
from ...common.keys import Positive as Positive
from ...common.keys import Vector3 as Vector3
from ...common.tables import LARGEST, shown
from ...common.validation import Record, existing_file
from .._core import TimeFunction
from .expressions import parse_expression
from .functions import user_function
from .waypoints import Waypoints, load_waypoints

DATASET = "step_ends"
"""Of an analysis in a results file; its attribute `METHOD` is the integrator's name."""
METHOD = "integrator"


@dataclass(frozen=True)
class Steps:
    """Steps of an analysis in the results file at `path`: `method`, and times (N,), s, at which steps ended.

    With the same steps the motion is a smooth function of every number in the scene, and differences of runs have no
    noise but round-off (H. G. Bock, Springer Series in Chemical Physics 18, 1981, p. 102).
    """

    path: Path
    method: str
    ends: Array = field(repr=False, compare=False)


def load_steps(path: Path, analysis: str) -> Steps:
    """Read the time steps of the analysis of that name from a results file. Raises `InputError` where it has none."""
    from ...common.hdf5 import numbers, open_checked  # few scenes have steps, and h5py takes longer than reading one

    try:
        with open_checked(path) as file:
            dataset = file.get(f"{analysis}/{DATASET}")
            if dataset is None:
                raise InputError(
                    f'{path}: expected the steps of an analysis "{analysis}"',
                    "none: they are there of a run with keep_steps = true that one explicit integrator has made as a"
                    " whole",
                )
            ends, method = numbers(dataset, f"{path}: {analysis}/{DATASET}"), str(dataset.attrs.get(METHOD, ""))
    except OSError:
        raise InputError(f"{path}: expected a results file of ffrobot", "something else") from None
    if ends.ndim != 1 or not len(ends) or not np.all(np.diff(ends) > 0.0):
        raise InputError(f"{path}: {analysis}/{DATASET}: expected times that ascend", "others")
    return Steps(path, method, ends)


GROUND = "ground"

T = TypeVar("T")


def split_point(reference: str, also: str = "") -> tuple[str, str]:
    """Split `"link1.tip"` into `("link1", "tip")`. Raises `ValueError` for others, with `also` in its text."""
    body, dot, point = reference.partition(".")
    if not (body and dot and point) or "." in point:
        raise ValueError(f'expected {also}a point as "BODY.POINT", found "{shown(reference)}"')
    return body, point


def _time_function(value: object, info: ValidationInfo) -> TimeFunction:
    if isinstance(value, TimeFunction):
        return value
    objects = (info.context or {}).get("objects", {})
    if isinstance(value, str) and value in objects:
        return user_function(objects[value])
    if isinstance(value, str):
        return parse_expression(value)
    if isinstance(value, int | float) and not isinstance(value, bool):
        return parse_expression(repr(float(value)))
    raise ValueError(f"expected an expression in t, found {value!r}")


def _time_functions(value: object, info: ValidationInfo) -> TimeFunction | tuple[TimeFunction, ...]:
    if isinstance(value, list | tuple):
        return tuple(_time_function(one, info) for one in value)
    return _time_function(value, info)


def _quantity(value: object, _: ValidationInfo) -> float:
    """A number, or an expression without t, such as "30*deg"."""
    if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
        return float(value)
    if not isinstance(value, str):
        raise ValueError(f'expected a finite number, or an expression such as "30*deg", found {value!r}')
    function = parse_expression(value)
    number = function(0.0)[0]
    if number != function(1.0)[0] or abs(number) > LARGEST:
        raise ValueError(f'expected a number or an expression without t, such as "30*deg", found "{shown(value)}"')
    return number


def _point(value: str) -> str:
    split_point(value)
    return value


def _side(value: str) -> str:
    if value != GROUND:
        split_point(value, '"ground" or ')
    return value


def _waypoints(value: object, info: ValidationInfo) -> Waypoints:
    if isinstance(value, Waypoints):
        return value
    if not isinstance(value, str):
        raise ValueError(f"expected the name of a CSV file in quotes, or places in via = [[…], …], found {value!r}")
    return load_waypoints(existing_file(Path(value), info))


def _steps(value: object, info: ValidationInfo) -> Steps:
    if isinstance(value, Steps):
        return value
    if not isinstance(value, str):
        raise ValueError(f"expected the name of a results file in quotes, found {value!r}")
    return load_steps(existing_file(Path(value), info), info.data.get("name", "?"))


def _not_empty(entries: tuple[T, ...]) -> tuple[T, ...]:
    # Not a min_length: pydantic would complain about that, too, whenever an entry is wrong.
    if not entries:
        raise ValueError("expected at least one entry, found none")
    return entries


def given_in(record: Record, keys: Iterable[str]) -> dict[str, Any]:
    """The values of those `keys` of a record that are set."""
    return {key: value for key in keys if (value := getattr(record, key)) is not None}


def one_of(record: Record, keys: tuple[str, ...]) -> str:
    """The one key of `keys` that is set. Raises `ValueError` when there is none or more than one."""
    given = [*given_in(record, keys)]
    if len(given) != 1:
        raise ValueError(f"expected exactly one of the keys {quoted(keys)}, found {quoted(given)}")
    return given[0]


def only(record: Record, subject: str, allowed: tuple[str, ...], optional: tuple[str, ...]) -> list[str]:
    """The `optional` keys that are set. Raises `ValueError` for none, or some not `allowed` with `subject`."""
    given = [*given_in(record, optional)]
    if not given or not set(given) <= set(allowed):
        raise ValueError(f'expected the keys {quoted(allowed)} with "{subject}", found {quoted(given)}')
    return given


PointReference = Annotated[str, AfterValidator(_point)]
Side = Annotated[str, AfterValidator(_side)]
Quantity = Annotated[float, ReadBy(_quantity, str | float)]
Expression = Annotated[TimeFunction, ReadBy(_time_function, str | float)]
Expressions = Annotated[
    TimeFunction | tuple[TimeFunction, ...], ReadBy(_time_functions, str | float | list[str | float])
]
WaypointTable = Annotated[Waypoints, ReadBy(_waypoints, str)]
KeptSteps = Annotated[Steps, ReadBy(_steps, str)]
NotEmpty = AfterValidator(_not_empty)


Kind = Literal["body", "flexible body", "patches", "patched body", "joint", "elastic joint", "command", "input"]


@dataclass(frozen=True)
class Reference:
    """Reference to another table: the `key` that holds it, and its `name` "BODY", "BODY.POINT" or a joint's.

    `kind` is that of the other table: "patches" a layout, "patched body" a body with patches, "elastic joint" a joint
    with stiffness, "command" a motor or patch, "input" also a force. Forces of the mechanism act at a `loaded` point.
    """

    key: str
    name: str
    kind: Kind = "body"
    loaded: bool = False

    @property
    def body_and_point(self) -> tuple[str, str] | None:
        """Body and point of "BODY.POINT"; None if it names no point."""
        return split_point(self.name) if self.kind == "body" and "." in self.name else None


def loaded_reference(key: str, side: str | None) -> list[Reference]:
    """The reference to a point (or body frame) where forces act; empty for the ground, or without a `side`."""
    return [] if side is None or side == GROUND else [Reference(key, side, loaded=True)]


class Referring(Record):
    """Base of records that name bodies, points, joints or patches of their scene."""

    refers_to: ClassVar[tuple[tuple[str, Kind | Literal["loaded"]], ...]] = ()  # keys, each with what its values name

    def references(self) -> Iterator[Reference]:
        """Yield all references of the record."""
        for key, kind in self.refers_to:
            value = getattr(self, key)
            for name in () if value is None else (value,) if isinstance(value, str) else value:
                yield from loaded_reference(key, name) if kind == "loaded" else [Reference(key, name, kind)]


def body_of(side: str) -> str:
    """The body of "BODY.POINT" or "BODY"; "ground" for the ground."""
    return side.partition(".")[0]


def under(label: str, references: Iterable[Reference]) -> Iterator[Reference]:
    """Yield references of a record that messages call `label`, each with its full key."""
    for reference in references:
        yield replace(reference, key=f"{label}: {reference.key}" if reference.key else label)
