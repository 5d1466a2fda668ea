"""Transcripts: commands, and what each of them does, in files that people review.

A transcript is a name (``=== name``), the state it starts from, commands, and below each command what it did (``>``).
``--regenerate`` writes the lines with ``>`` anew. A file may have lines with ``!`` instead, which it leaves: one for
each line that a command says, with words that it must have; " … " stands for the words between.
"""

import ast
import os
import re
import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from study_app.errors import StudyError
from tests.golden import as_on_linux

Play = Callable[[str, list[str]], Iterator[str]]
"""Yields the commands of a transcript, from a start, each with what it does."""


def played(file: Path, play: Play) -> list[str]:
    """Replay a file of transcripts; return its lines with the present output, or assert it in a file with `!`."""
    text, lines = file.read_text(encoding="utf-8"), list[str]()
    for part in text.removeprefix("=== ").split("\n=== "):
        name, start, *part_lines = part.strip("\n").split("\n")
        lines += [*[""] * bool(lines), f"=== {name}", start]
        asserted, did = list[list[str]](), list[tuple[str, list[str]]]()
        for line in part_lines:
            asserted[-1].append(line) if line.startswith((">", "!")) else asserted.append([])
        commands = [line for line in part_lines if not line.startswith((">", "!"))]
        for line in play(start.removeprefix("start:").strip(), commands):
            did[-1][1].append(line) if line.startswith(">") else did.append((line, []))
        for (command, said), words in zip(did, asserted, strict=True):
            if "\n! " in text:
                assert [*map(_has_words, words, said)] == [True] * max(len(said), len(words)), (name, command, said)
            lines += [command, *(words if "\n! " in text else said)]
    return lines


def _has_words(words: str, said: str) -> bool:
    forms = (said,) if os.name == "posix" else (said, as_on_linux(said))
    return any(re.search(".*".join(map(re.escape, words[2:].split(" … "))), form) for form in forms)


def every(folder: Path, names: str) -> list[Path]:
    """Return the transcript files in a folder; fail unless their names are ``names``."""
    files = sorted(folder.glob("*.txt"))
    assert [path.stem for path in files] == names.split(), f"{folder} holds {[path.stem for path in files]}"
    return files


def value_of(line: str, names: Mapping[str, Any]) -> Any:
    """Return the value of a call whose arguments are literals, names and calls."""

    def value(node: ast.AST) -> Any:
        match node:
            case ast.Call(ast.Name(name), arguments, keywords):
                named_arguments = {str(keyword.arg): value(keyword.value) for keyword in keywords}
                return names[name](*map(value, arguments), **named_arguments)
            case ast.Name(name):
                return names[name]
            case ast.List(items):
                return [*map(value, items)]
            case _:
                return ast.literal_eval(node)

    return value(ast.parse(line, mode="eval").body)


def calls(names: Mapping[str, Any], *refusals: type[Exception]) -> Play:
    """Return a player of calls, which yields the value of each, or its refusal."""

    def play(_start: str, lines: list[str]) -> Iterator[str]:
        for line in lines:
            yield line
            try:
                yield f"> {value_of(line, names)!r}"
            except refusals as error:
                yield f"> refused: {error}"

    return play


def acts(begin: Callable[[str], Any], names: Mapping[str, Any], words: Callable[[str], str] = str) -> Play:
    """Return a player of the methods of a world that ``begin`` makes; ``words`` formats each line of `told`."""

    def play(start: str, lines: list[str]) -> Iterator[str]:
        world = begin(start)
        for line in lines:
            yield line
            yield from (f"> {words(text)}" for text in told(world, line, names))

    return play


def told(world: Any, line: str, names: Mapping[str, Any]) -> Iterator[str]:
    """Yield the output or refusal of a world's method, or of a call of ``names``, and then the world's news."""
    name = line.partition("(")[0]
    try:
        said = value_of(line, {**names, name: getattr(world, name)} if hasattr(world, name) else names)
        yield from [said] if isinstance(said, str) else said or ()
    except StudyError as error:
        yield f"refused: {error}"
    yield from getattr(world, "_news", tuple)()


class Files:
    """Files below a folder, and a command for each change that may happen to them."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.before = self._contents() if root.is_dir() else {}

    def _contents(self) -> dict[str, bytes]:
        paths = (path for path in self.root.rglob("*") if path.is_file())
        return {path.relative_to(self.root).as_posix(): path.read_bytes() for path in paths}

    def files(self) -> Iterator[str]:
        """Yield the files that were added, deleted or changed."""
        now = self._contents()
        yield from (f"gone: {name}" for name in sorted(self.before.keys() - now.keys()))
        yield from (f"new: {name}" for name in sorted(now.keys() - self.before.keys()))
        yield from (
            f"other: {name}" for name in sorted(now.keys() & self.before.keys()) if now[name] != self.before[name]
        )

    def same(self, folder: str, other: str) -> Iterator[str]:
        """Yield the number of files in a folder, and the names that differ in another one."""
        first, second = (Files(self.root / name)._contents() for name in (folder, other))
        different = sorted(name for name in first | second if first.get(name) != second.get(name))
        yield f"{len(first)} files, different: {different}"

    def replace(self, name: str, old: str, new: str) -> None:
        content = (self.root / name).read_bytes()
        assert old.encode() in content
        (self.root / name).write_bytes(content.replace(old.encode(), new.encode(), 1))

    def write(self, name: str, content: bytes) -> None:
        (self.root / name).write_bytes(content)

    def append(self, name: str, content: bytes) -> None:
        self.write(name, (self.root / name).read_bytes() + content)

    def cut(self, name: str, size: int) -> None:
        """Cut a file to this number of bytes; a negative number removes the last bytes."""
        self.write(name, (self.root / name).read_bytes()[:size])

    def delete(self, *names: str) -> None:
        for name in names:
            for path in self.root.glob(name):
                shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()

    def rename(self, name: str, to: str) -> None:
        (self.root / to).parent.mkdir(parents=True, exist_ok=True)
        (self.root / name).rename(self.root / to)

    def link(self, name: str, to: str) -> None:
        """Put a link in the place of a file, if there is one."""
        (self.root / name).unlink(missing_ok=True)
        (self.root / name).symlink_to(self.root / to)

    def folder(self, name: str) -> None:
        """Put a folder in the place of a file."""
        (self.root / name).unlink()
        (self.root / name).mkdir()

    def copy(self, name: str, to: str) -> None:
        (self.root / to).parent.mkdir(parents=True, exist_ok=True)
        (shutil.copytree if (self.root / name).is_dir() else shutil.copy)(self.root / name, self.root / to)
