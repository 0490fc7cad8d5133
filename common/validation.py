"""Reading and validating TOML input files: one clear error that names file, key, expected and found."""

import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, ClassVar, NamedTuple, TypeVar, get_args

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationError, ValidationInfo
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, ErrorDetails, PydanticKnownError, core_schema

from .deferred import USED, Deferred
from .errors import InputError, did_you_mean, either
from .python_files import digest_of_function
from .tables import key_path, shown
from .toml_files import check_limits


class Record(BaseModel):
    """Base of every record of an input file: immutable, no unknown keys, finite numbers, no silent conversions.

    Validators of a record raise `ValueError("expected …, found …")`; `validate` puts file and key in front. Modules of
    records import no `annotations` from `__future__`: pydantic would compile them again, whenever a command starts.
    """

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    only_in: ClassVar[str | None] = None
    """The `space` whose scenes alone have such tables; None: all have."""

    @classmethod
    def refuse_key(cls, key: str, others: Sequence[type["Record"]]) -> str:
        """The message for a `key` that only the records `others` have; empty: the message on unknown keys."""
        return ""

    @classmethod
    def demand_key(cls, key: str) -> str:
        """The message for a missing `key`; empty: the message on missing keys."""
        return ""


def space_of(info: ValidationInfo) -> str | None:
    """The `space` of the scene that is being read, "planar" or "spatial"; None of records made in Python."""
    return (info.context or {}).get("space")


def as_tuples(value: Any) -> Any:
    """Turn lists in `value` into tuples, for validators that run before pydantic checks the type."""
    if isinstance(value, dict):
        return {key: as_tuples(item) for key, item in value.items()}
    return tuple(as_tuples(item) for item in value) if isinstance(value, list | tuple) else value


@dataclass(frozen=True)
class OnlyIn:
    """Mark of a key that only scenes of one `space`, "planar" or "spatial", have: in others it is an unknown key."""

    space: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_before_validator_function(self._check, handler(source))

    def _check(self, value: object, info: ValidationInfo) -> object:
        if space_of(info) not in (None, self.space):
            raise PydanticKnownError("extra_forbidden")
        return as_tuples(value)


R = TypeVar("R", bound=Record)


def existing_file(path: Path, info: ValidationInfo) -> Path:
    """Return `path` as found from the folder of the input file. Raises `ValueError` where there is no such file."""
    folder: Path = (info.context or {}).get("folder", Path())
    resolved, name = folder / path, shown(str(path))
    try:
        if resolved.is_file():
            return resolved
        present = [entry.name for entry in resolved.parent.iterdir()] if resolved.parent.is_dir() else []
    except (OSError, ValueError) as error:  # too long, in a folder that may not be read, no name of a file
        raise ValueError(f'expected an existing file, found "{name}": {getattr(error, "strerror", error)}') from None
    if resolved.exists():
        raise ValueError(f'expected a file, found "{name}", which is {"a folder" if resolved.is_dir() else "a device"}')
    hint = did_you_mean(path.name, present)
    raise ValueError(f'expected an existing file, found "{name}", which is not in {folder.absolute()}{hint}')


InputFile = Annotated[Path, AfterValidator(existing_file)]
"""A file named by an input file, relative to it; it exists."""


_JUDGED = ("value_error", "greater_than", "less_than")  # errors in values of an allowed type


def validate(
    record: type[R],
    data: dict[str, Any],
    path: Path,
    objects: Mapping[str, object] | None = None,
    space: str | None = None,
) -> R:
    """Build `record` from `data`, read from `path`; an `InputError` lists every wrong key.

    `objects` are values that TOML cannot hold, as functions, by the text in `data` in their place; `space` is that of a
    scene. Validators find both in their context.
    """
    check_limits(data, path)
    USED.add(record)
    context = {"path": path, "folder": path.parent, "objects": objects or {}, "space": space}
    try:
        # By way of JSON, whose strict mode reads lists as tuples and text as paths; TOML has no types for these either.
        return record.model_validate_json(json.dumps(data, default=str), context=context)
    except ValidationError as error:
        items = error.errors(include_url=False)
        within = {item["loc"] for item in items}
        kinds = {_describe(item, record, data, space): item["type"] for item in items if not _follows(item, within)}
        judged = {problem.key for problem, kind in kinds.items() if kind.startswith(_JUDGED)}
        problems = [one for one, kind in kinds.items() if kind.startswith(_JUDGED) or one.key not in judged]
        raise InputError("\n".join(f"{path}: {line}" for line in _merge(problems))) from None


def _follows(item: ErrorDetails, within: Collection[tuple[int | str, ...]]) -> bool:
    """Whether others say it: entries that are wrong count as missing ones, too, and the last missing one counts all."""
    loc = item["loc"]
    if item["type"] == "too_short":
        return any(len(other) > len(loc) and other[: len(loc)] == loc for other in within)
    return item["type"] == "missing" and isinstance(loc[-1], int) and (*loc[:-1], loc[-1] + 1) in within


def plain(value: Any, functions: dict[str, object] | None = None) -> Any:
    """`value` in types of TOML: NumPy numbers and arrays, tuples and paths replaced, keys that are None omitted.

    Functions go to `functions` under the text that stands for them.
    """
    if isinstance(value, Mapping):
        return {key: plain(item, functions) for key, item in value.items() if item is not None}
    if isinstance(value, np.longdouble):  # whose tolist() is itself
        return float(value)
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist(), functions)
    if isinstance(value, list | tuple):
        return [plain(item, functions) for item in value]
    if functions is not None and (callable(value) or hasattr(value, "address")):
        called = getattr(value, "__qualname__", type(value).__name__)
        name = f"<{called}, function no. {len(functions) + 1}, content {digest_of_function(value)}>"
        functions[name] = value
        return name
    return str(value) if isinstance(value, PathLike) else value


def check_texts(value: object, label: str) -> None:
    """Raise `InputError`, beginning with `label`, for anything but a list of texts; a single text is refused too."""
    texts = value if isinstance(value, Collection) else ()  # generators can be read once
    is_list = isinstance(value, Iterable) and not isinstance(value, str | Mapping)
    if not (is_list and all(isinstance(one, str) for one in texts)):
        raise InputError(f"{label}: expected a list of texts", shown(repr(value)))


class _Problem(NamedTuple):
    key: str
    expected: str
    found: str


def _merge(problems: Sequence[_Problem]) -> list[str]:
    expected: dict[tuple[str, str], list[str]] = {}
    for problem in problems:
        alternatives = expected.setdefault((problem.key, problem.found), [])
        if problem.expected not in alternatives:
            alternatives.append(problem.expected)
    return [
        f"{key}{': ' * bool(key)}{' or '.join(texts).replace(' or expected ', ' or ')}{value}"
        for (key, value), texts in expected.items()
    ]


_EXPECTED = {
    "missing": "a value, since this key is required",
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "string_type": "text in quotes",
    "path_type": "a file name in quotes",
    "bool_type": "true or false",
    "tuple_type": "a list",
    "list_type": "a list",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "finite_number": "a finite number",
    "too_short": "at least {min_length} entries",
    "too_long": "at most {max_length} entries",
    "string_too_short": "text that is not empty",
    "greater_than": "a number greater than {gt:g}",
    "greater_than_equal": "a number of at least {ge:g}",
    "less_than": "a number less than {lt:g}",
    "less_than_equal": "a number of at most {le:g}",
}


def _describe(item: ErrorDetails, record: type[BaseModel], data: dict[str, Any], space: str | None) -> _Problem:
    """Where pydantic's `item` is in the user's file, and what is wrong there, in the user's terms."""
    kind, loc, context = item["type"], item["loc"], item.get("ctx", {})
    key = key_path(loc, data, kind)
    if kind == "value_error":
        return _Problem(key, str(context["error"]), "")
    if kind == "extra_forbidden":
        if refusal := _own_words(record, loc, space, is_missing=False):
            return _Problem(key_path(loc[:-1], data, kind=""), "", refusal)
        known = _known_keys(_alternatives(record, loc[:-1])[0], space)
        return _Problem(
            key,
            f"expected one of the keys {', '.join(known)}",
            ", found an unknown key" + did_you_mean(str(loc[-1]), known),
        )
    if kind == "missing" and isinstance(loc[-1], int):
        return _Problem(key, f"expected a list of {int(loc[-1]) + 1} entries", f", found {_show(item['input'])}")
    if kind == "missing":
        if demand := _own_words(record, loc, space, is_missing=True):
            return _Problem(key_path(loc[:-1], data, kind=""), demand, "")
        return _Problem(key, f"expected {_EXPECTED[kind]}", ", found none")
    value = item["input"]
    if kind == "union_tag_not_found":
        tag_key = context["discriminator"].replace("'", "")
        from difflib import get_close_matches

        near = get_close_matches(tag_key, list(item["input"]), n=1)
        instead = f'"{near[0]}" (did you mean "{tag_key}"?)' if near else "none"
        return _Problem(key_path((*loc, tag_key), data), f"expected {_EXPECTED['missing']}", f", found {instead}")
    if kind == "union_tag_invalid":
        tags = context["expected_tags"].replace("'", "").split(", ")
        key = key_path((*loc, context["discriminator"].replace("'", "")), data)
        return _Problem(
            key, f"expected {either(tags)}", f", found {_show(context['tag'])}{did_you_mean(context['tag'], tags)}"
        )
    template = _EXPECTED.get(kind)
    expected = template.format_map(context) if template else item["msg"].removeprefix("Input should be ")
    expected = expected.replace("'", '"')  # as TOML writes it
    hint = ""
    if expected == "a list" and isinstance(value, dict) and len(loc) == 1:
        hint = f" (write [[{key}]])"
    if kind == "literal_error" and isinstance(value, str):
        hint = did_you_mean(value, context["expected"].replace("'", "").replace(" or ", ", ").split(", "))
    return _Problem(key, f"expected {expected}", f", found {_show(value)}{hint}")


def _show(value: object) -> str:
    text = json.dumps(value, default=str, ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + "…"


def _alternatives(
    record: type[BaseModel], loc: Sequence[int | str]
) -> tuple[list[type[BaseModel]], list[type[BaseModel]]]:
    """The records that the table at `loc` may be, and all those that may stand there with another tag."""
    candidates = allowed = [record]
    for part in loc:
        if not isinstance(part, str):
            continue
        inner = [
            model for c in candidates if part in c.model_fields for model in _models(c.model_fields[part].annotation)
        ]
        # A part that is no key tells which alternative of a union was taken.
        allowed = inner or allowed
        candidates = inner or _tagged(candidates, part) or candidates
    return candidates, allowed


def _tagged(records: Sequence[type[BaseModel]], tag: str) -> list[type[BaseModel]]:
    """Those with a key that can be nothing but `tag`; where there is none, those with a key that can be that."""
    values = {record: [get_args(field.annotation) for field in record.model_fields.values()] for record in records}
    only = [record for record, choices in values.items() if (tag,) in choices]
    return only or [record for record, choices in values.items() if any(tag in choice for choice in choices)]


def _known_keys(records: Iterable[type[BaseModel]], space: str | None) -> list[str]:
    fields = [entry for record in records for entry in record.model_fields.items()]
    return list(dict.fromkeys(field.alias or name for name, field in fields if is_key(field, space)))


def is_key(field: FieldInfo, space: str | None) -> bool:
    """Whether scenes of `space`, "planar", "spatial" or None (either), have the key of this field."""
    return all(space in (None, mark.space) for mark in field.metadata if isinstance(mark, OnlyIn))


def _own_words(record: type[BaseModel], loc: Sequence[int | str], space: str | None, *, is_missing: bool) -> str:
    """What a record itself says of the key at `loc`, which is missing, or which it does not have."""
    (taken, *more), allowed = _alternatives(record, loc[:-1])
    if more or not issubclass(taken, Record):
        return ""
    if is_missing:
        return taken.demand_key(str(loc[-1]))
    here = [other for other in allowed if issubclass(other, Record) and other.only_in in (None, space)]
    return taken.refuse_key(str(loc[-1]), [other for other in here if str(loc[-1]) in _known_keys([other], space)])


def _models(annotation: object) -> list[type[BaseModel]]:
    """Every record in `annotation`, inside optionals, unions, lists and tables too."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    arguments = get_args(annotation)
    if deferred := [mark for mark in arguments if isinstance(mark, Deferred) and mark.modules]:
        return deferred[0].records()
    return [model for argument in arguments for model in _models(argument)]
