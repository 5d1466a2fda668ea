"""Texts that people review: ``python -m pytest FILE --regenerate`` writes them anew; read the difference."""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from difflib import unified_diff
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
import pytest

NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")


def alike(expected: str, found: str, rel: float = 1e-5, abs_: float = 1e-9) -> bool:
    """Return whether lines are equal but for the last digits of numbers, which depend on libraries and processors."""
    if expected == found:
        return True
    if NUMBER.sub("", expected) != NUMBER.sub("", found):
        return False
    numbers = [[float(number) for number in NUMBER.findall(line)] for line in (expected, found)]
    return numbers[0] == pytest.approx(numbers[1], rel=rel, abs=abs_)


def compare(kept: Path, lines: Iterable[str], config: pytest.Config, **tolerance: float) -> None:
    """Compare lines with a golden file, or write it."""
    found = "\n".join(lines).split("\n")
    if config.getoption("regenerate"):
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text("\n".join(found) + "\n", encoding="utf-8")
    expected = kept.read_text(encoding="utf-8").removesuffix("\n").split("\n")
    pairs = list(zip_longest(expected, found))
    if not all(a is not None and b is not None and alike(a, b, **tolerance) for a, b in pairs):
        shown = list(unified_diff(expected, found, n=0, lineterm=""))[2:42]
        pytest.fail("\n".join([f"{kept}: review, then --regenerate", *shown]))


def flat(place: str, value: Any) -> Iterator[str]:
    """Yield a line for each value in dataclasses, models, mappings, sequences and arrays, with its place."""
    match value:
        case _ if is_dataclass(value) and not isinstance(value, type):
            below: Any = {one.name: getattr(value, one.name) for one in fields(value)}
        case _ if hasattr(type(value), "model_fields"):
            below = {name: getattr(value, name) for name in type(value).model_fields}
        case Mapping():
            below = value
        case np.ndarray() | np.void() if value.dtype.names and value.shape in ((), (1,)):
            below = {name: value.reshape(())[name][()] for name in value.dtype.names}
        case np.ndarray() if value.size > 12:
            kept = np.nan_to_num(value.astype(float))
            span = f"{kept.min():.6g} {kept.max():.6g} {kept.sum():.6g}"
            yield f"{place}: {value.shape} {span} {np.count_nonzero(np.isnan(value.astype(float)))}"
            return
        case tuple() | list() | np.ndarray() if any(
            is_dataclass(one) or isinstance(one, tuple | list | Mapping | np.ndarray) for one in value
        ):
            below = dict(enumerate(value))
        case tuple() | list() | np.ndarray():
            yield f"{place}: {' '.join(map(plain, value))}"
            return
        case _:
            yield f"{place}: {plain(value)}"
            return
    for name, one in below.items():
        yield from flat(f"{place}.{name}", one)
    if not below:
        yield f"{place}: none"


def plain(value: Any) -> str:
    """Return a value on one line; floats with six digits, no addresses."""
    if isinstance(value, float | np.floating):
        return f"{value:.6g}"
    if isinstance(value, np.generic):
        value = value.item()
    return re.sub(r" at 0x\w+", "", str(value) if isinstance(value, str) else repr(value)).replace("\n", " / ")


def changed(before: list[str], after: list[str]) -> list[str]:
    """Return the lines that are new, and the places under which nothing is left."""
    known, left = set(before), set[str]()
    for line in after:
        parts = line.partition(":")[0].split(".")
        left.update(".".join(parts[: 1 + k]) for k in range(len(parts)))
    gone = dict[str, None]()
    for line in before:
        parts = line.partition(":")[0].split(".")
        heads = (".".join(parts[: 1 + k]) for k in range(len(parts)))
        gone.update(dict.fromkeys([head for head in heads if head not in left][:1]))
    return [*(line for line in after if line not in known), *(f"- {place}" for place in gone)]
