"""Validators and schemas that are built when they are used: files have few of the kinds of tables that there are."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Annotated, Any, TypeVar, get_args

from pydantic import BaseModel, GetCoreSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, core_schema

RECORD = "deferred_record"
"""Key of the metadata of a core schema: what `loaded` takes."""

USED: set[type[BaseModel]] = set()
"""Records that this process has validated with: their validators are built."""


@dataclass(frozen=True)
class Deferred:
    """Annotation of a table whose record is imported when a file has such a table.

    `tag`: for unions, the key whose value picks the record. `modules`: by that value the record as "MODULE:RECORD";
    empty where the annotated union has the records.
    """

    tag: str = ""
    modules: Mapping[str, str] = field(default_factory=dict, hash=False)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        if not self.tag:
            return _deferred(source)
        of_union = {get_args(one.model_fields[self.tag].annotation)[0]: one for one in get_args(source)}
        records = self.modules or of_union
        return core_schema.tagged_union_schema(
            {value: _deferred(record) for value, record in records.items()}, discriminator=self.tag
        )

    def records(self) -> list[type[Any]]:
        """The records of `modules`, imported."""
        return [loaded(place) for place in self.modules.values()]


@dataclass(frozen=True)
class ReadBy:
    """Annotation of a value that `function` makes from a file's entry of type `written` (or "MODULE:TYPE").

    Pydantic's PlainValidator would look up both whenever a command starts.
    """

    function: Callable[[Any, ValidationInfo], Any]
    written: Any = field(hash=False)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self.function, metadata={RECORD: self.written})


def loaded(record: type[BaseModel] | str) -> type[BaseModel]:
    """Return `record`, imported where it is text "MODULE:RECORD"."""
    if not isinstance(record, str):
        return record
    module, _, name = record.partition(":")
    return getattr(import_module(module), name)


def _deferred(record: type[BaseModel] | str) -> CoreSchema:
    def read(value: Any, info: ValidationInfo) -> BaseModel:
        taken = loaded(record)
        USED.add(taken)
        if info.mode == "python" or isinstance(value, BaseModel):
            return taken.model_validate(value, context=info.context)
        return taken.model_validate_json(json.dumps(value, default=str), context=info.context)

    return core_schema.with_info_plain_validator_function(read, metadata={RECORD: record})


R = TypeVar("R", bound=BaseModel)

Table = Annotated[R, Deferred()]
"""A record whose validator is built when a file has such a table."""
