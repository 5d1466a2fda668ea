"""Values of the program as lines of text, for golden files."""

import difflib
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any


def short(value: Any) -> str:
    """Return a value in one line: numbers with six digits, names joined to paths, without defaults."""
    match value:
        case bool() | int() | str() | None:
            return repr(value)
        case float():
            return f"{value:.6g}"
        case Mapping():
            return "{" + ", ".join(f"{key}: {short(one)}" for key, one in value.items()) + "}"
        case tuple() | list():
            if value and isinstance(value[0], str) and all(isinstance(one, str | int) for one in value):
                return ".".join(map(str, value)) if all(" " not in str(one) for one in value) else repr(value)
            return f"({', '.join(map(short, value))})"
        case frozenset() | set():
            return f"({', '.join(sorted(map(short, value)))})"
    if is_dataclass(value):
        parts = ((part.name, getattr(value, part.name), part.default) for part in fields(value))
        shown = (f"{name}={short(one)}" for name, one, default in parts if default is not one and default != one)
        return f"{type(value).__name__}({', '.join(shown)})"
    return type(value).__name__


def lines_of(value: Any, depth: int = 0) -> Iterator[str]:
    """Yield a value in lines: dataclasses and tuples of them in several, all else in one."""
    if isinstance(value, tuple | list) and any(is_dataclass(one) for one in value):
        for one in value:
            yield from lines_of(one, depth)
    elif is_dataclass(value) and len(short(value)) > 160:
        yield f"{'  ' * depth}{type(value).__name__}"
        for part in fields(value):
            inner = getattr(value, part.name)
            if inner is part.default or inner == part.default:
                continue
            if is_dataclass(inner) or (isinstance(inner, tuple) and any(is_dataclass(one) for one in inner)):
                yield f"{'  ' * depth}  {part.name}:"
                yield from lines_of(inner, depth + 2)
            else:
                yield f"{'  ' * depth}  {part.name}: {short(inner)}"
    else:
        yield f"{'  ' * depth}{short(value)}"


def changed(before: str, after: str) -> Iterator[str]:
    """Yield the lines that another text has, or lacks, with the number of the first one that differs."""
    for line in list(difflib.unified_diff(before.split("\n"), after.split("\n"), n=0, lineterm=""))[2:]:
        yield line if line[0] in "+-" else line.rpartition(" +")[2].removesuffix(" @@")
