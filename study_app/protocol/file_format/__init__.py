"""The file format: its versions, its JSON Schema, and scenes written in it."""

from study_app.protocol.file_format.json_schema import editor_schema, length_texts, schema
from study_app.protocol.file_format.scene_file import scene_text, with_default_estimator

__all__ = ["editor_schema", "length_texts", "scene_text", "schema", "with_default_estimator"]
