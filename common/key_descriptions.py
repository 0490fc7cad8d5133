"""What each key of a record means: the docstring under its field, which stands nowhere else."""

from __future__ import annotations

import ast
import inspect
from typing import Literal, get_args, get_origin

from pydantic import BaseModel


def key_descriptions(record: type[BaseModel]) -> dict[str, str]:
    """Meaning and unit of each key of `record` as files write it, those of its base classes included.

    They are read from the source, when they are asked for: pydantic's `use_attribute_docstrings` would do so whenever a
    scene is loaded. Of a key that tells which record a table is, such as `kind`, it is the first line about the record.
    """
    texts: dict[str, str] = {}
    for cls in reversed(record.__mro__):
        if issubclass(cls, BaseModel) and cls is not BaseModel:
            texts |= _docstrings_of_fields(cls)
    about = (inspect.getdoc(record) or "").partition("\n")[0]
    for name, field in record.model_fields.items():
        if get_origin(field.annotation) is Literal and field.is_required() and len(get_args(field.annotation)) == 1:
            texts[name] = about
    return {field.alias or name: texts[name] for name, field in record.model_fields.items() if name in texts}


def _docstrings_of_fields(cls: type) -> dict[str, str]:
    """Texts that stand directly under a field in the body of a class."""
    (definition,) = ast.parse(inspect.cleandoc("\n" + inspect.getsource(cls))).body
    assert isinstance(definition, ast.ClassDef)
    found = {}
    for field, below in zip(definition.body, definition.body[1:], strict=False):
        match field, below:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                found[name] = " ".join(text.split())
    return found
