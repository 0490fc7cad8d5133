"""How planar scenes write what records hold in 3D: fewer components, other keys. Dimension is data of a field."""

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, get_args

from pydantic import ConfigDict, GetCoreSchemaHandler, TypeAdapter, ValidationInfo, ValidatorFunctionWrapHandler
from pydantic_core import CoreSchema, PydanticKnownError, core_schema

from ...common.keys import Vector2, Vector3
from ...common.validation import OnlyIn, Record, as_tuples, is_key, space_of

PLANAR, SPATIAL = "planar", "spatial"
IN_PLANE, IN_SPACE = OnlyIn(PLANAR), OnlyIn(SPATIAL)
"""Marks of keys that only scenes of one space have."""

NORMAL = (0.0, 0.0, 1.0)
"""Axis about which all joints of the plane turn; angles are counter-clockwise in it."""
ACROSS = 0.6  # moments of inertia about x and y over that about z: a body of no other shape than one in space may have


def is_planar(info: ValidationInfo) -> bool:
    """Whether a planar scene is being read."""
    return space_of(info) == PLANAR


def keys_here(record: Record, keys: Iterable[str], info: ValidationInfo) -> tuple[str, ...]:
    """Those of a record's `keys` that exist in scenes of the space being read."""
    fields = type(record).model_fields
    return tuple(key for key in keys if is_key(fields[key], space_of(info)))


@cache
def _reader(spelling: Any) -> TypeAdapter[Any]:
    return TypeAdapter(spelling, config=ConfigDict(strict=True, allow_inf_nan=False))


@dataclass(frozen=True)
class Spelled:
    """Annotation of a field that planar scenes write as type `spelling`; `in_3d` converts values to 3D."""

    spelling: Any
    in_3d: Callable[[Any], Any] | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_wrap_validator_function(self._read, handler(source))

    def _read(self, value: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        if not is_planar(info):
            return handler(as_tuples(value))
        read = _reader(self.spelling).validate_json(json.dumps(value), context=info.context)
        return read if self.in_3d is None else self.in_3d(read)


class NormalInPlane(OnlyIn):
    """Marks an axis that planar scenes do not have: it is `NORMAL` there, and required in 3D. Its default is None."""

    __get_pydantic_core_schema__ = Spelled.__get_pydantic_core_schema__

    @staticmethod
    def _read(value: Any, handler: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        if (value is None) is not is_planar(info):
            raise PydanticKnownError("missing" if value is None else "extra_forbidden")
        return NORMAL if value is None else handler(as_tuples(value))


@dataclass(frozen=True)
class TaggedInPlane:
    """Marks a union of records with the discriminator `type`, of which planar scenes have those without `only_in`."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        records: Sequence[type[Record]] = get_args(source)
        tags = [get_args(record.model_fields["type"].annotation)[0] for record in records if record.only_in is None]

        def read(value: Any, inner: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
            tag = value.get("type") if isinstance(value, dict) else None
            if is_planar(info) and isinstance(tag, str) and tag not in tags:
                known = ", ".join(f"'{one}'" for one in tags)
                raise PydanticKnownError(
                    "union_tag_invalid", {"discriminator": "'type'", "tag": tag, "expected_tags": known}
                )
            return inner(as_tuples(value))

        marks = {"tags_in_plane": tags}
        return core_schema.with_info_wrap_validator_function(read, handler(source), metadata=marks)


def place(x_y: Sequence[float]) -> tuple[float, float, float]:
    """The position (x, y), m, of the plane in 3D."""
    x, y = x_y
    return x, y, 0.0


def inertia_about_z(J: float) -> tuple[float, float, float]:
    """Moments about x, y, z (kg·m²) of a body with J about z; x and y do not matter in the plane."""
    return ACROSS * J, ACROSS * J, J


Vector = Annotated[Vector3, Spelled(Vector2, place)]
"""Of 3D; [x, y] in planar scenes."""
