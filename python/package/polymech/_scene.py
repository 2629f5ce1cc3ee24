"""Scenes from paths, texts and dictionaries."""

from __future__ import annotations

import functools
import hashlib
import json
import math
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from . import _polymech

Scene: TypeAlias = "str | os.PathLike[str] | Mapping[str, Any]"


def number(value: float) -> str:
    """Formats a number for TOML."""
    if math.isnan(value):
        return "nan"
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return repr(value)


def literal(value: Any) -> str:
    """Formats a value for TOML, in one line."""
    if isinstance(value, str):
        # TOML's strings are those of JSON, except for DEL, which JSON does not escape
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return number(value)
    if isinstance(value, os.PathLike):
        return literal(os.fspath(value))
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key(k)} = {literal(v)}" for k, v in value.items()) + " }"
    if isinstance(value, Sequence):
        return "[" + ", ".join(literal(item) for item in value) + "]"
    raise TypeError(f"scene: found {value!r} of {type(value).__name__}; allowed: numbers, texts, lists and dictionaries")


def key(name: str) -> str:
    """Formats a key for TOML."""
    plain = name.replace("_", "").replace("-", "")
    return name if plain.isascii() and plain.isalnum() else literal(str(name))


def dumps(scene: Mapping[str, Any]) -> str:
    """Formats a dictionary as TOML: tables under headings, their values in single lines."""
    lines = [f"{key(k)} = {literal(v)}" for k, v in scene.items() if not _heads(v)]
    for name, value in scene.items():
        if not _heads(value):
            continue
        for table in [value] if isinstance(value, Mapping) else value:
            heading = f"[{key(name)}]" if isinstance(value, Mapping) else f"[[{key(name)}]]"
            lines += ["", heading, *(f"{key(k)} = {literal(v)}" for k, v in table.items())]
    return "\n".join(lines) + "\n"


def _heads(value: Any) -> bool:
    """Returns true for a value with a heading of its own."""
    if isinstance(value, Mapping):
        return True
    return isinstance(value, (list, tuple)) and bool(value) and all(isinstance(item, Mapping) for item in value)


# SI units of the quantities of the schemas
UNITS = {
    "acceleration": "m/s^2",
    "angle": "rad",
    "angular_velocity": "rad/s",
    "energy_per_area": "J/m^2",
    "energy_per_mass": "J/kg",
    "force": "N",
    "heat_flux": "W/m^2",
    "heat_transfer_coefficient": "W/(m^2 K)",
    "length": "m",
    "mass": "kg",
    "mass_density": "kg/m^3",
    "molar_energy": "J/mol",
    "molar_mass": "kg/mol",
    "number_per_temperature": "1/K",
    "power_per_volume": "W/m^3",
    "rate": "1/s",
    "specific_heat_capacity": "J/(kg K)",
    "speed": "m/s",
    "squared_temperature": "K^2",
    "stress": "Pa",
    "temperature": "K",
    "temperature_difference": "K",
    "temperature_rate": "K/s",
    "thermal_conductivity": "W/(m K)",
    "time": "s",
}

Node: TypeAlias = "tuple[str, Mapping[str, Any]]"


class Schema:
    """Keys of a program's scenes: numbers of Python become quantities in SI, arrays become tables of
    `folder`."""

    def __init__(self, schema: dict[str, Any]) -> None:
        self._definitions = schema["definitions"]
        self._top = self._choices(schema)

    def _choices(self, node: Mapping[str, Any], name: str = "") -> list[Node]:
        """Alternatives of a node, with the names of their definitions."""
        if "$ref" in node:
            name = node["$ref"].rpartition("/")[2]
            return self._choices(self._definitions[name], name)
        parts = [part for word in ("anyOf", "allOf", "oneOf") for part in node.get(word, [])]
        return [choice for part in parts for choice in self._choices(part)] if parts else [(name, node)]

    def _below(self, nodes: list[Node], key: str | None) -> list[Node]:
        """Alternatives below a key, or for `None` of the items of a list."""
        def one(node: Mapping[str, Any]) -> Any:
            return node.get("properties", {}).get(key, node.get("additionalProperties"))

        inner = [node.get("items") if key is None else one(node) for _, node in nodes]
        return [choice for node in inner if isinstance(node, Mapping) for choice in self._choices(node)]

    def at(self, path: str) -> list[Node]:
        """Alternatives at a path, such as ``boundary[0].displacement``."""
        nodes = self._top
        for name in filter(None, re.split(r"[.\[\]]", path)):
            nodes = self._below(nodes, None if name.isdigit() else name)
        return nodes

    def is_list(self, path: str) -> bool:
        """Returns true for a list of tables."""
        return any("items" in node for _, node in self.at(path))

    def si(self, value: Any, nodes: list[Node], folder: Path | None, key: str = "") -> Any:
        """Returns a value with units and blocks of laws, without `None`, and with tables in files."""
        if hasattr(value, "tolist"):
            value = value.tolist()
        if hasattr(value, "block"):
            value = value.block()
        if isinstance(value, Mapping):
            if key == "file" and folder is not None and not any("properties" in node for _, node in nodes):
                return _file(value, folder)
            given = {name: item for name, item in value.items() if item is not None}
            return {n: self.si(item, self._below(nodes, n), folder, n) for n, item in given.items()}
        if isinstance(value, Sequence) and not isinstance(value, str):
            return [self.si(item, self._below(nodes, None), folder) for item in value]
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            types = [kind for _, node in nodes for kind in np.atleast_1d(node.get("type", []))]
            units = [UNITS[name] for name, _ in nodes if name in UNITS]
            if units and "number" not in types and "integer" not in types:
                return f"{number(float(value))} {units[0]}"
        return value


@functools.cache
def schema(program: str) -> Schema:
    """Schema of a program of the compiled module."""
    return Schema(json.loads(_polymech.schema(program)))


def _file(columns: Mapping[str, Any], folder: Path) -> str:
    """Writes a table, a dictionary of columns by their headings, and returns its path."""
    units = getattr(columns, "units", {})
    names = [f"{name} [{units[name]}]" if units.get(name) else name for name in columns]
    arrays = [np.atleast_1d(column).tolist() for column in columns.values()]
    if len({len(array) for array in arrays}) != 1:
        found = ", ".join(str(len(array)) for array in arrays)
        raise ValueError(f"file: found columns of {found} rows; allowed: columns of one length")
    rows = (",".join(str(cell) for cell in row) for row in zip(*arrays, strict=True))
    text = "\n".join([",".join(names), *rows]) + "\n"
    # not .csv, which are results of the run
    folder.mkdir(parents=True, exist_ok=True)
    path = folder.resolve() / f"table-{hashlib.sha256(text.encode()).hexdigest()[:12]}.txt"
    path.write_text(text, encoding="utf-8")
    return str(path)


def read(
    scene: Scene, program: str, overrides: Mapping[str, Any], known: Schema, folder: Path | None
) -> tuple[str, str]:
    """Returns text and path of a scene. Overrides are appended and take precedence, as those of a sweep."""
    if isinstance(scene, Mapping):
        whole = {"version": 1, "program": program, **scene}
        text, path = dumps(known.si(whole, known.at(""), folder)), "scene.toml"
    elif isinstance(scene, str) and "\n" in scene:
        text, path = scene, "scene.toml"
    else:
        path = os.fspath(scene)
        text = ""
        if Path(path).is_file():
            text = Path(path).read_text(encoding="utf-8")
        else:
            raise FileNotFoundError(f"{path}: no such scene; the text of a scene has more than one line")
    if overrides:
        # `material__youngs_modulus` is `material.youngs_modulus`
        set_ = {name.replace("__", "."): value for name, value in overrides.items()}
        lines = [f"{literal(k)} = {literal(known.si(v, known.at(k), folder))}\n" for k, v in set_.items()]
        text = text.rstrip("\n") + "\n\n[sweep.set]\n" + "".join(lines)
    return text, path
