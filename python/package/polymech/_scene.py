"""Scenes from paths, texts and dictionaries."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

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


def read(scene: Scene, program: str, overrides: Mapping[str, Any]) -> tuple[str, str]:
    """Returns text and path of a scene. Overrides are appended and take precedence, as those of a sweep."""
    if isinstance(scene, Mapping):
        text, path = dumps({"version": 1, "program": program, **scene}), "scene.toml"
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
        text = text.rstrip("\n") + "\n\n[sweep.set]\n" + "".join(f"{literal(k)} = {literal(v)}\n" for k, v in set_.items())
    return text, path
