"""Transcripts: commands, and what each of them does, in files that people review.

A transcript is a name (``=== name``), the state it starts from, commands, and below each command what it did (``>``).
``--regenerate`` writes the lines with ``>`` anew.
"""

import ast
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

Play = Callable[[str, list[str]], Iterator[str]]
"""Yields the commands of a transcript, from a start, each with what it does."""


def played(file: Path, play: Play) -> Iterator[str]:
    """Yield the lines of a file of transcripts with what the commands do now."""
    for number, part in enumerate(file.read_text(encoding="utf-8").removeprefix("=== ").split("\n=== ")):
        name, start, *lines = part.strip("\n").split("\n")
        yield from ("", f"=== {name}", start) if number else (f"=== {name}", start)
        yield from play(start.removeprefix("start: "), [line for line in lines if not line.startswith(">")])


def value_of(line: str, names: Mapping[str, Any]) -> Any:
    """Return the value of a call whose arguments are literals, names and calls."""

    def value(node: ast.AST) -> Any:
        match node:
            case ast.Call(ast.Name(name), arguments, keywords):
                given = {str(one.arg): value(one.value) for one in keywords}
                return names[name](*map(value, arguments), **given)
            case ast.Name(name):
                return names[name]
            case _:
                return ast.literal_eval(node)

    return value(ast.parse(line, mode="eval").body)
