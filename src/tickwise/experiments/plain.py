"""Specifications as plain data that JSON can carry, and back: their types by name, nothing that runs."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import Any

from tickwise.errors import ConfigurationError


def to_plain(value: Any) -> Any:
    """Plain data for a value that consists of Tickwise's dataclasses, tuples, lists, dictionaries and scalars.

    Raises:
        ConfigurationError: If there is something else in it.
    """
    kind = type(value)
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if kind in (tuple, list):
        return {kind.__name__: [to_plain(each) for each in value]}
    if kind is dict:
        return {"dict": [[to_plain(key), to_plain(each)] for key, each in value.items()]}
    if is_dataclass(kind) and _ours(kind.__module__):
        content = {field.name: to_plain(getattr(value, field.name)) for field in fields(kind)}
        return {f"{kind.__module__}:{kind.__qualname__}": content}
    raise ConfigurationError(
        f"a {kind.__module__}.{kind.__qualname__} cannot be sent to a cluster; run this study without --cluster"
    )


def from_plain(data: Any) -> Any:
    """The value that `to_plain` made plain data of.

    Raises:
        ConfigurationError: If a type is not one of Tickwise's.
    """
    if not isinstance(data, dict):
        return data
    ((kind, content),) = data.items()
    if kind in ("tuple", "list"):
        parts = [from_plain(each) for each in content]
        return tuple(parts) if kind == "tuple" else parts
    if kind == "dict":
        return {from_plain(key): from_plain(each) for key, each in content}
    return _type(kind)(**{name: from_plain(each) for name, each in content.items()})


def _type(name: str) -> Any:
    module, _, of = name.partition(":")
    found = getattr(import_module(module), of, None) if _ours(module) else None
    if not (isinstance(found, type) and is_dataclass(found)):
        raise ConfigurationError(f"there is no {name} in a specification; send what tickwise packed")
    return found


def _ours(module: str) -> bool:
    return module.partition(".")[0] == "tickwise"
