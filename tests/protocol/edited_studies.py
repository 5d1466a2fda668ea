"""Studies with edits, and what `check` says of each, in files that people review.

A file of ``cases`` names its study in the first line. A case is a name (``=== name``), lines that are replaced (``-``)
by others (``+``), ``...`` between two replacements, and what is said: every problem, or "accepted" and the lines of the
description that the description of the study without edits does not have. Lines with ``!`` are assertions, which people
change by hand; ``--regenerate`` rewrites the lines with ``>``, whose numbers are simulated.
"""

import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

from study_app.errors import ProtocolError
from study_app.protocol.descriptions.protocol_text import describe
from study_app.protocol.load import parse
from study_app.protocol.source.files import source_bytes
from tests.transcripts import every

STUDIES = Path(__file__).parent / "studies"
CASES = Path(__file__).parent / "cases"
FILES = every(
    CASES,
    "adjustment block_order compared designs formats groups impossible impossible_levels late liquids methods pace "
    "precision questions rated rows sound views",
)


_SIMULATED = re.compile(r"Expected precision |.* yield ±|.* holds back about ")
"""A line with numbers of simulated participants or motions."""


def split(said: Iterable[str]) -> tuple[list[str], list[str]]:
    """Return the lines that are asserted, and those that are recorded."""
    asserted, recorded = list[str](), list[str]()
    for line in said:
        (recorded if _SIMULATED.match(line) else asserted).append(line)
    return asserted, recorded


class Case(NamedTuple):
    """A study with edits, and the asserted and the recorded lines about it."""

    study: str
    name: str
    edits: tuple[tuple[str, str], ...]
    asserted: tuple[str, ...]
    recorded: tuple[str, ...]

    @property
    def text(self) -> str:
        """Return the edited text; each replaced run of lines must occur exactly once."""
        text = "\n" + text_of(self.study)
        for old, new in self.edits:
            assert text.count(old) == 1, f"{self.name}: {old!r} is there {text.count(old)} times"
            text = text.replace(old, new)
        return text.removeprefix("\n")


@cache
def text_of(study: str) -> str:
    """Return the text of a study of the folder, or of one that ships."""
    file = STUDIES / f"{study}.toml"
    return file.read_text(encoding="utf-8") if file.exists() else source_bytes(study).decode()


def said_of(text: str, study: str) -> list[str]:
    """Return the problems of a text, or the lines of its description that the unedited study lacks."""
    try:
        protocol = parse(text.encode(), "study.toml")
    except ProtocolError as error:
        return [str(problem) for problem in error.problems]
    return ["accepted", *(line for line in _lines(describe(protocol)) if line not in _described(study))]


@cache
def _described(study: str) -> frozenset[str]:
    return frozenset(_lines(describe(parse(text_of(study).encode(), study))))


def _lines(text: str) -> list[str]:
    return [" ".join(line.split()) for line in text.splitlines()]


def cases_of(file: Path) -> Iterator[Case]:
    """Yield the cases of a file."""
    head, *parts = file.read_text(encoding="utf-8").split("\n=== ")
    assert parts, f"{file} has no cases"
    for part in parts:
        name, *lines = part.removesuffix("\n").split("\n")
        edits = "\n".join(line for line in lines if not line.startswith(("!", ">"))).split("\n...\n")
        said = (tuple(line[2:] for line in lines if line.startswith(sign)) for sign in "!>")
        yield Case(head.removeprefix("study: ").strip(), name, tuple(map(_edit, edits)), *said)


def _edit(hunk: str) -> tuple[str, str]:
    old, new = ("".join(f"{line[2:]}\n" for line in hunk.split("\n") if line.startswith(sign)) for sign in ("-", "+"))
    return f"\n{old}", f"\n{new}"


def regenerate(file: Path) -> None:
    """Write the recorded lines of each case anew."""
    cases = list(cases_of(file))
    parts = [f"study: {cases[0].study}\n"]
    for case in cases:
        edits = "...\n".join(_signed("-", old) + _signed("+", new) for old, new in case.edits)
        _, recorded = split(said_of(case.text, case.study))
        message = "".join([*(f"! {line}\n" for line in case.asserted), *(f"> {line}\n" for line in recorded)])
        parts.append(f"=== {case.name}\n{edits}{message}")
    file.write_text("\n".join(parts), encoding="utf-8", newline="\n")


def _signed(sign: str, text: str) -> str:
    return "".join(f"{sign} {line}\n" if line else f"{sign}\n" for line in text.removeprefix("\n").splitlines())


FAULTY = tuple(cases_of(CASES / "sound.txt"))
"""The small sound protocol with mistakes."""
