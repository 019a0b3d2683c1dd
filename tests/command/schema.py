"""Checks JSON against a schema of docs/schemas. Knows the words that these use; any other word is an error."""
import json
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "schemas"
TYPES = {"object": dict, "array": list, "string": str, "integer": int, "number": (int, float), "boolean": bool, "null": type(None)}
WORDS = {"$schema", "$defs", "title", "description", "$ref", "anyOf", "enum", "type", "properties", "required",
         "additionalProperties", "items"}  # fmt: skip


def has_type(value, name):
    return isinstance(value, TYPES[name]) and (name == "boolean" or not isinstance(value, bool))


def problems(value, schema, root, where="$"):
    """What is wrong with the value, a line each."""
    if schema is False:
        return [f"{where}: is not in the schema"]
    if schema is True:
        return []
    unknown = set(schema) - WORDS
    assert not unknown, f"the schema has words that nobody checks: {unknown}"
    if "$ref" in schema:
        return problems(value, root["$defs"][schema["$ref"].removeprefix("#/$defs/")], root, where)
    found = []
    if "anyOf" in schema:
        tried = [problems(value, one, root, where) for one in schema["anyOf"]]
        found += [] if [] in tried else min(tried, key=len)
    if "enum" in schema and value not in schema["enum"]:
        found.append(f"{where}: {value!r} is none of {schema['enum']}")
    if "type" in schema:
        types = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
        if not any(has_type(value, name) for name in types):
            return [*found, f"{where}: {value!r} is no {' or '.join(types)}"]
    if isinstance(value, dict):
        found += [f"{where}: {name} is missing" for name in schema.get("required", []) if name not in value]
        for name, part in value.items():
            of_part = schema.get("properties", {}).get(name, schema.get("additionalProperties", True))
            found += problems(part, of_part, root, f"{where}.{name}")
    if isinstance(value, list) and "items" in schema:
        for i, part in enumerate(value):
            found += problems(part, schema["items"], root, f"{where}[{i}]")
    return found


def against(name, text):
    """All problems of a JSON text by the schema of this name."""
    schema = json.loads((FOLDER / f"{name}.json").read_text())
    # What is no JSON: NaN and Infinity, which Python would accept.
    def refuse(word):
        raise ValueError(f"{word} is no JSON")

    return problems(json.loads(text, parse_constant=refuse), schema, schema)
