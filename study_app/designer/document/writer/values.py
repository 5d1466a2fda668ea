"""Values and tables as TOML text, in the style of their neighbours; ``tomlkit`` writes what stands on one line."""

import re
from collections.abc import Iterable, Mapping
from typing import Any, Final

import tomlkit
import tomlkit.items

WIDTH: Final = 120
INDENT: Final = "    "
_BARE: Final = re.compile(r"[A-Za-z0-9_-]+")
_LITERAL: Final = re.compile(r"[^'\x00-\x08\x0a-\x1f\x7f]*")


def key_text(key: str) -> str:
    """Return a key as it is written, in quotes where it needs them."""
    return key if _BARE.fullmatch(key) else str(tomlkit.key(key).as_string())


def header_text(path: Iterable[str | int]) -> str:
    """Return the path of a header as it is written; entries of arrays stand in it for themselves."""
    return ".".join(key_text(key) for key in path if isinstance(key, str))


def written(value: Any, like: str = "", newline: str = "\n", indent: str = "", column: int = 0) -> str:
    """Return a value, as ``tomllib`` reads it, as TOML.

    Parameters
    ----------
    value : str or bool or int or float
        Or a date, a table or an array.
    like : str
        The text of the value that it replaces, or of a neighbour: its quotes and its lines are kept where possible.
    newline, indent : str
        The text's line break, and what a line begins with on which the value begins.
    column : int
        Characters on the line before the value.
    """
    if isinstance(value, str):
        return _string(value, like, newline)
    if isinstance(value, list | tuple) and value:
        line = inline(value)
        if "\n" not in like and column + len(line) <= WIDTH:
            return line
        inner = indent + (INDENT if not like else _indent_in(like, indent))
        rows = "".join(f"{inner}{inline(entry)},{newline}" for entry in value)
        return f"[{newline}{rows}{indent}]"
    return inline(value)


def inline(value: Any) -> str:
    """Return a value as TOML without a line break."""
    if isinstance(value, Mapping):
        pairs = ", ".join(f"{key_text(key)} = {inline(entry)}" for key, entry in value.items())
        return f"{{ {pairs} }}" if pairs else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(inline, value))}]"
    return str(tomlkit.item(value).as_string())


def tables(path: tuple[str | int, ...], value: Mapping[str, Any], newline: str, *, entry: bool = False) -> str:
    """Return a table with its header; inner tables that fill more than a line get headers of their own.

    ``entry`` says that it is an entry of an array of tables.
    """
    name = header_text(path)
    lines, inner = [f"[[{name}]]" if entry else f"[{name}]"], list[str]()
    for key, part in value.items():
        column = len(key_text(key)) + 3
        fits = column + len(inline(part)) <= WIDTH
        if isinstance(part, Mapping) and part and not fits:
            inner.append(tables((*path, key), part, newline))
        elif isinstance(part, list | tuple) and part and not fits and all(isinstance(row, Mapping) for row in part):
            inner += [tables((*path, key), row, newline, entry=True) for row in part]
        else:
            lines.append(f"{key_text(key)} = {written(part, newline=newline, column=column)}")
    return newline.join(["".join(f"{line}{newline}" for line in lines), *inner])


def wrapped(text: str) -> str:
    """Return a text of paragraphs with lines of at most 120 characters, as it is written between triple quotes."""
    return "\n\n".join(_filled(part) for part in re.split(r"\n[ \t]*\n", text)) + "\n"


def _filled(paragraph: str) -> str:
    lines = [""]
    for word in paragraph.split():
        if lines[-1] and len(lines[-1]) + 1 + len(word) > WIDTH:
            lines.append("")
        lines[-1] += f" {word}" if lines[-1] else word
    return "\n".join(lines)


def _string(value: str, like: str, newline: str) -> str:
    if "\n" in value and "\r" not in value:
        # tomlkit writes another line break before a text that begins with one: with the sign, none does.
        body = tomlkit.string(f"-{value}", multiline=True).as_string()[4:-3]
        return f'"""{newline}{body.replace(chr(10), newline)}"""'
    if like.startswith("'") and _LITERAL.fullmatch(value):
        return f"'{value}'"
    return inline(value)


def _indent_in(array: str, indent: str) -> str:
    """Return by how much the entries of an array are indented."""
    found = re.search(r"\n([ \t]*)[^\s#\]]", array)
    return found.group(1).removeprefix(indent) if found else INDENT
