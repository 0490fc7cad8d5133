"""JSON schemas of link, scene and figure files, generated from the records that validate these files.

Editors complete and check TOML files by them, and show what a key means. What ties several keys together (a revolute
joint has no axis) is beyond a schema: the records and the readers of the files say so.
"""

from __future__ import annotations

from typing import Any

from pydantic import TypeAdapter
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from .common.key_descriptions import key_descriptions
from .common.validation import is_key
from .mbs.fields.spelling import NormalInPlane

DIALECT = GenerateJsonSchema.schema_dialect


def schema(kind: str) -> dict[str, Any]:
    """The JSON schema of a "link", "scene" or "figures" file, or of a scene in space ("spatial"), as a dictionary."""
    generator = _Spatial if kind == "spatial" else _Described
    described = TypeAdapter(_record(kind)).json_schema(schema_generator=generator)
    if kind in ("scene", "spatial"):
        for link in ("BeamLink", "SolidLink"):
            described["$defs"][link]["required"].remove("name")  # that of the body
    if kind == "spatial":
        described["properties"]["space"] = {"const": "spatial", "description": "Dimension of the motion."}
        described["required"].append("space")
    if kind == "link":
        described["oneOf"] = described.pop("anyOf")  # geometry.kind tells beam and solid apart
    title = "3D scene" if kind == "spatial" else f"{kind} file"
    return {"$schema": DIALECT, **_for_toml(described), "title": f"ffrobot {title}"}


def _record(kind: str) -> Any:  # noqa: ANN401 (a record or a union of them)
    if kind == "scene":
        from .scene.spatial import SpatialSceneKeys as SceneKeys

        return SceneKeys
    if kind == "spatial":
        from .scene.spatial import SpatialSceneKeys

        return SpatialSceneKeys
    if kind == "link":
        from .fe_models.link_records import Link

        return Link
    from .pictures.figures.figure_file import FigureFile

    return FigureFile


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


class _Spatial(_Described):
    space = "spatial"


def _for_toml(node: Any) -> Any:  # noqa: ANN401 (any part of a JSON document)
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
