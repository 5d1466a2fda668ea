"""The pages of the documentation as tests read them: blocks of commands, commands, links and headings."""

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RUN = "<!-- run -->"
"""Stands above a block whose commands a test runs; of all others the options are checked."""

_FENCE = re.compile(r"^(?P<run><!-- run -->\n)?```(?P<language>\w*)\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\]\(([^()\s]+)\)")
_INLINE = re.compile(r"(?<!`)`(liquid-study [^`]+)`(?!`)")
_HEADING = re.compile(r"^#{1,4} (.+)$", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Block:
    """A block between fences: whether a test runs it, its language, its text."""

    run: bool
    language: str
    text: str


def pages() -> list[Path]:
    """Return every page that people read, of the checkout."""
    top = [path for path in ROOT.glob("*.md") if path.name != "CHANGELOG.md"]
    return sorted([*top, *(ROOT / "docs").rglob("*.md"), ROOT / "results" / "README.md"])


def name(page: Path) -> str:
    """Return the path of a page in the checkout."""
    return page.relative_to(ROOT).as_posix()


def blocks(page: Path) -> list[Block]:
    """Return the blocks of a page."""
    fences = _FENCE.finditer(page.read_text(encoding="utf-8"))
    return [Block(fence["run"] is not None, fence["language"], fence["text"]) for fence in fences]


def lines_to_type(block: Block) -> Iterator[str]:
    """Yield the command lines of a block: all of a shell's, those after a prompt of a session."""
    lines = block.text.replace("\\\n", " ").splitlines()
    if block.language == "sh":
        yield from (line for line in lines if line.strip())
    else:
        yield from (line.removeprefix("$ ") for line in lines if line.startswith("$ "))


def typed_commands(page: Path) -> Iterator[list[str]]:
    """Yield the words of every command in a page's blocks."""
    for block in blocks(page):
        for line in lines_to_type(block):
            yield from commands_of(line)


def mentioned_commands(page: Path) -> Iterator[list[str]]:
    """Yield the words of every command of the program within a page's sentences."""
    prose = _FENCE.sub("", page.read_text(encoding="utf-8"))
    for command in _INLINE.finditer(prose):
        yield shlex.split(command[1].replace("\n", " ").replace("\\|", "or"))


def commands_of(line: str) -> Iterator[list[str]]:
    """Yield the words of each command of a line, without redirections."""
    words = shlex.split(re.sub(r"\s#\s.*$", "", line), comments=True)
    command: list[str] = []
    for word in [*words, ";"]:
        if word in {"&&", "|", ";"}:
            if command:
                yield command
            command = []
        else:
            command.append(word)


def links(page: Path) -> list[str]:
    """Return where the links and pictures of a page point to."""
    return _LINK.findall(_FENCE.sub("", page.read_text(encoding="utf-8")))


def anchors(text: str) -> set[str]:
    """Return the anchors of the headings in a text, as GitHub and MyST make them."""
    headings = (re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading) for heading in _HEADING.findall(text))
    return {re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-") for heading in headings}
