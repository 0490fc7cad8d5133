"""JSON schemas of link, scene and figure files, and meanings of keys, generated from the records that validate them.

Editors complete and check TOML files by them, and show what a key means. What ties several keys together (a revolute
joint has no axis) is beyond a schema: the records and the readers of the files say so.
"""

import ast
import inspect
import json
import re
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, TypeAdapter
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from .common.deferred import RECORD, loaded
from .common.validation import is_key
from .mbs.fields.spelling import PLANAR, SPATIAL, NormalInPlane, Spelled

REF = "#/$defs/"
REFERENCE = re.compile(r'"#/\$defs/(\w+)"')
SCENE, IN_PLANE = "Scene", "InPlane"  # names of definitions, and what they end in where planar scenes differ


def schema(kind: str) -> dict[str, Any]:
    """The JSON schema of a "link", "scene" or "figures" file, or of 3D scenes alone ("spatial"), as a dictionary."""
    if kind == SPATIAL:
        described = scene_in(SPATIAL)
        described["properties"]["space"] = {"const": SPATIAL, "description": "Dimension of the motion."}
        described["required"].append("space")
    elif kind == "scene":
        described = _scene()
    elif kind == "link":
        from .fe_models.link_records.link import Link

        described = TypeAdapter(Link).json_schema(schema_generator=_Described)
        described["oneOf"] = described.pop("anyOf")  # geometry.kind tells beam and solid apart
        described = _for_toml(described)
    else:
        from .pictures.figures.shared import FigureFile

        described = _for_toml(TypeAdapter(FigureFile).json_schema(schema_generator=_Described))
    title = "3D scene" if kind == SPATIAL else f"{kind} file"
    return {"$schema": GenerateJsonSchema.schema_dialect, **described, "title": f"ffrobot {title}"}


def scene_in(space: str | None) -> dict[str, Any]:
    """The schema of "planar" or "spatial" scenes, with definitions; None: with keys of both, written as in 3D."""
    from .scene.scene import SceneKeys

    generator = {PLANAR: _Planar, SPATIAL: _Spatial, None: _Described}[space]
    described: dict[str, Any] = TypeAdapter(SceneKeys).json_schema(schema_generator=generator)
    for link in ("BeamLink", "SolidLink"):
        described["$defs"][link]["required"].remove("name")  # that of the body
    return _for_toml(described)


def _scene() -> dict[str, Any]:
    """Of scenes of both spaces: `space` says which holds, so that editors name the key that is wrong."""
    parts = {space: scene_in(space) for space in (PLANAR, SPATIAL)}
    tables = {space: part.pop("$defs") | {SCENE: part} for space, part in parts.items()}
    planar, spatial = tables[PLANAR], tables[SPATIAL]
    differ = {name for name in planar if planar[name] != spatial[name]}
    refers = {name: set(REFERENCE.findall(json.dumps(table))) for name, table in planar.items()}
    while more := {name for name in planar if name not in differ and refers[name] & differ}:
        differ |= more
    text = json.dumps({f"{name}{IN_PLANE}": planar[name] for name in planar if name in differ})
    text = REFERENCE.sub(lambda found: f'"{REF}{found[1]}{IN_PLANE * (found[1] in differ)}"', text)
    is_spatial = {"properties": {"space": {"const": SPATIAL}}, "required": ["space"]}
    either: list[Any] = [{"$ref": REF + SCENE}, {"$ref": REF + SCENE + IN_PLANE}]
    conditions = {"if": is_spatial, "then": either[0], "else": either[1]}
    # Editors that follow no "if" (Taplo) complete keys by "anyOf", which accepts everything.
    return {"type": "object", **conditions, "anyOf": [*either, True], "$defs": spatial | json.loads(text)}


class _Described(GenerateJsonSchema):
    """The schema with the meaning of each key, of those that scenes of a `space` have."""

    space: str | None = None

    def model_schema(self, schema: core_schema.ModelSchema) -> JsonSchemaValue:
        described = super().model_schema(schema)
        record, properties = schema["cls"], described["properties"]
        for key, text in key_descriptions(record).items():
            properties[key]["description"] = text
        for name, field in record.model_fields.items():
            key = field.alias or name
            if not is_key(field, self.space):
                del properties[key]
            elif any(isinstance(mark, NormalInPlane) for mark in field.metadata):
                described["required"].append(key)
        return described

    def function_plain_schema(self, schema: core_schema.PlainValidatorFunctionSchema) -> JsonSchemaValue:
        return self.generate_inner(TypeAdapter(loaded(schema["metadata"][RECORD])).core_schema)


class _Spatial(_Described):
    space = SPATIAL


class _Planar(_Described):
    """Of planar scenes, with their spelling."""

    space = PLANAR

    def function_wrap_schema(self, schema: core_schema.WrapValidatorFunctionSchema) -> JsonSchemaValue:
        inner: Any = schema["schema"]
        if mark := _spelled(schema):
            return self.generate_inner(TypeAdapter(mark.spelling).core_schema)
        if tags := schema.get("metadata", {}).get("tags_in_plane"):
            return self.generate_inner(inner | {"choices": {tag: inner["choices"][tag] for tag in tags}})
        return super().function_wrap_schema(schema)

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        """Return a default with as many components as 2D has: such defaults are zeros."""
        described = super().default_schema(schema)
        default = described.get("default")
        if isinstance(default, list) and _spelled(schema["schema"]):
            described["default"] = default[: described["maxItems"]] if "maxItems" in described else default[-1]
        return described


def _spelled(schema: Any) -> Spelled | None:
    """The mark of a field that planar scenes write otherwise."""
    mark = getattr(schema.get("function", {}).get("function"), "__self__", None)
    return mark if isinstance(mark, Spelled) else None


def _for_toml(node: Any) -> Any:
    """`node` without what TOML has not (null), and without titles that only repeat the key."""
    if isinstance(node, list):
        return [_for_toml(item) for item in node]
    if not isinstance(node, dict):
        return node
    cleaned = {key: _for_toml(item) for key, item in node.items() if not _is_noise(key, item, node)}
    alternatives = [item for item in cleaned.get("anyOf", []) if item != {"type": "null"}]
    if len(alternatives) == 1:
        del cleaned["anyOf"]
        return alternatives[0] | cleaned
    if alternatives:
        cleaned["anyOf"] = alternatives
    return cleaned


def _is_noise(key: str, item: object, node: dict[str, Any]) -> bool:
    """Automatic titles, and defaults that stand for "not given": None, and 0 where the key has to be positive."""
    unset = item is None or (key == "default" and item == node.get("exclusiveMinimum"))
    return unset or (key == "title" and isinstance(item, str))


def key_descriptions(record: type[BaseModel]) -> dict[str, str]:
    """Meaning and unit of each key of `record` as files write it, those of its base classes included.

    Read from the source here: pydantic's `use_attribute_docstrings` would do so whenever a scene is loaded. Of a key
    that tells which record a table is, such as `kind`, it is the first line about the record.
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
    texts = {}
    for field, below in zip(definition.body, definition.body[1:], strict=False):
        match field, below:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                texts[name] = " ".join(text.split())
    return texts
