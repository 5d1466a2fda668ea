"""Results made up from their types: every field gets a seeded value, or None if it is optional."""

import dataclasses
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import Enum
from types import NoneType, UnionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

WORDS = ("kalman", "water", "honey", "prompt", "late", "drag", "wake", "P001")


def filled(kind: Any, rng: np.random.Generator, **overrides: Any) -> Any:
    """Return a value of a type; ``overrides`` are fields by name, at any depth: a value, or a function of ``rng``."""
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin in (UnionType, typing.Union):
        some = [option for option in inner if option is not NoneType]
        return None if len(some) < len(inner) and rng.random() < 0.25 else filled(some[0], rng, **overrides)
    if origin is typing.Literal:
        return inner[int(rng.integers(len(inner)))]
    if origin is typing.Annotated:
        return filled(inner[0], rng, **overrides)
    if kind is np.ndarray or origin in (np.ndarray, NDArray):  # from numpy 2.5 on an alias of its own
        return np.sort(rng.lognormal(0, 1, 12))
    if origin is tuple and not (len(inner) == 2 and inner[1] is ...):
        return tuple(filled(part, rng, **overrides) for part in inner)
    if origin in (tuple, list, Sequence, Iterable):
        items = [filled(inner[0], rng, **overrides) for _ in range(int(rng.integers(1, 4)))]
        return items if origin is list else tuple(items)
    if origin in (dict, Mapping):
        return {filled(inner[0], rng, **overrides): filled(inner[1], rng, **overrides) for _ in range(2)}
    if kind in PLAIN:
        return PLAIN[kind](rng)
    if isinstance(kind, type) and issubclass(kind, Enum):
        return list(kind)[int(rng.integers(len(kind)))]
    hints = typing.get_type_hints(kind)
    names = (
        [field.name for field in dataclasses.fields(kind) if field.init]
        if dataclasses.is_dataclass(kind)
        else kind._fields
    )
    values = {}
    for name in names:
        own = overrides.get(name, filled)
        values[name] = filled(hints[name], rng, **overrides) if own is filled else own(rng) if callable(own) else own
    return kind(**values)


PLAIN: dict[Any, Callable[[np.random.Generator], Any]] = {
    float: lambda rng: float(f"{rng.lognormal(0, 1.5):.6g}"),
    int: lambda rng: int(rng.choice([0, 1, 2, 7, 40, 1200])),
    str: lambda rng: str(rng.choice(WORDS)),
    bool: lambda rng: bool(rng.random() < 0.5),
    bytes: lambda rng: b"",
    Any: lambda rng: 1.0,
    NoneType: lambda rng: None,
}
