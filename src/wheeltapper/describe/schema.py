"""The JSON schema of the TOML files."""

from __future__ import annotations

from typing import Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import CoreSchema

from wheeltapper.describe.manual import HEADING, field_descriptions
from wheeltapper.describe.noun import Noun
from wheeltapper.describe.scenario import Scenario


class _WithType(GenerateJsonSchema):
    """Generator of the schema: it adds the `type` of each noun, and omits fields that a file cannot hold."""

    def model_schema(self, schema: Any) -> JsonSchemaValue:
        out = super().model_schema(schema)
        name = schema["cls"]._table_type()
        names = {"const": name} if name == schema["cls"].__name__ else {"enum": [name, schema["cls"].__name__]}
        out["properties"] = {"type": names} | out.get("properties", {})
        if schema["cls"]._needs_type:
            out["required"] = ["type", *out.get("required", [])]
        if hasattr(schema["cls"], "published_names"):
            _take_a_name(out, schema["cls"].published_names())
        out["description"] = out["description"].partition(HEADING)[0].strip()
        for field, words in field_descriptions(schema["cls"]).items():
            held = out["properties"].get(field, {})  # none of what no file holds
            held["description"] = f"{words} ({held['description']})" if "description" in held else words
        return out

    def callable_schema(self, schema: CoreSchema) -> JsonSchemaValue:
        return {"not": {}, "description": "a Python function: not in a file"}


def _take_a_name(table: JsonSchemaValue, names: list[str]) -> None:
    """Let the name of a published noun stand for the fields that a table requires."""
    typed = [field for field in table.get("required", []) if field == "type"]
    others = [field for field in table.get("required", []) if field != "type"]
    words = "of a published one; fields beside it overrule its own"
    table["properties"]["name"] = {"enum": names, "description": words}
    table["required"] = typed
    table["anyOf"] = [{"required": ["name"]}, {"required": others}]


def json_schema(of: type[Noun] = Scenario) -> dict[str, Any]:
    """Return the JSON schema of the file of a scenario, a site, or the plan of a data set."""
    out = of.model_json_schema(schema_generator=_WithType, mode="validation")
    out["properties"]["format"] = {"const": 1}
    out["title"] = f"wheeltapper {of.__name__.lower()}"
    return out
