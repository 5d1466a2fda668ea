"""Outputs as lines of text, compared with reviewed files: ``python -m pytest FILE --regenerate`` writes these anew.

A recording keeps the words of the program, for one reason stated in docs/testing.md; an assertion proves the numbers.
``--regenerate`` prints each text that is removed or added once, with the number of its places, and writes the files.
Every one must follow from the change of the program; one that you cannot explain is a fault.
Regenerate windows with the Qt of ``tests/gui/golden/qt_version``; commit texts and program together.
"""

import ctypes
import errno
import os
import re
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from difflib import unified_diff
from itertools import groupby, zip_longest
from pathlib import Path

import pytest

CHANGING = re.compile(
    r"\d{4}-\d\d-\d\d(?:[T ]\d\d:\d\d(?::\d\d(?:\.\d+)?)?(?:Z|[+-]\d\d:\d\d)?)?"
    r"|\b\d+\.\d+\.\d+\b|\b(?<!\.)[0-9a-f]{12,}\b|\b[a-z2-7]{4}-[a-z2-7]{4}-[a-z2-7]{4}(?:-[a-z2-7]{2})?\b"
)
"""Dates, versions, hashes and fingerprints."""
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
MASKED = re.compile(r"(?:(?<![\w.])[-−])?\d+(?:[.,:]\d+)*(?:e[+-]?\d+)?")
MISSING = ctypes.FormatError(2).rstrip(". \r\n") if sys.platform == "win32" else os.strerror(errno.ENOENT)
DRIVE = re.compile(r"\b[A-Z]:/")
HEADINGS = ("== ", "-- ")
SHOWN = 40
"""Most lines of a difference that are printed."""
TEXT_ENDS = re.compile(r" [|/] |^[-+=]+ ")
"""What separates the licence of a line."""
CHANGED: Counter[str] = Counter()
"""How often each text was removed ("- ...") or added ("+ ...") by ``--regenerate``."""


def as_on_linux(line: str) -> str:
    """Return a line of Windows with the paths and the system's words of Linux."""
    line = line.replace("WindowsPath", "PosixPath").replace("\\\\", "/").replace("\\", "/")
    return DRIVE.sub("/", line.replace(MISSING, os.strerror(errno.ENOENT)))


def masked(line: str) -> str:
    """Return a line with * for each date, version and hash, and # for each other number."""
    return MASKED.sub("#", CHANGING.sub("*", line))


def each_once(lines: Iterable[str], known: Iterable[str] = ()) -> Iterator[str]:
    """Yield each line that is neither known nor repeated, with # for numbers; a heading only if such a line follows."""
    masked_lines, headings = {masked(line) for line in known}, list[str]()
    for line in lines:
        if line.startswith(HEADINGS):
            headings = [heading for heading in headings if heading.startswith("==") and line.startswith("--")]
            headings.append(line)
        elif (text := masked(line)) not in masked_lines:
            masked_lines.add(text)
            yield from headings
            headings = []
            yield text


def compare(
    golden_file: Path,
    lines: Iterable[str],
    config: pytest.Config,
    *,
    mask: re.Pattern[str] | None = None,
    rel: float = 1e-5,
    abs_: float = 1e-9,
    exact: bool = False,
    fixed: bool = False,
) -> None:
    """Compare lines with a golden file, or write it; a ``fixed`` file is written only once.

    What ``mask`` matches is left out; numbers may differ a little, or as they are written, unless ``exact``.
    """
    actual = "\n".join(lines).split("\n")
    assert any(actual), f"{golden_file} is compared with nothing"
    if mask is not None:
        actual = [mask.sub("*", line) for line in actual]
    if config.getoption("regenerate") and not (fixed and golden_file.exists()):
        note_changed_texts(golden_file.read_text(encoding="utf-8").splitlines() if golden_file.exists() else [], actual)
        golden_file.parent.mkdir(parents=True, exist_ok=True)
        golden_file.write_text("\n".join(actual) + "\n", encoding="utf-8", newline="\n")
    expected = golden_file.read_text(encoding="utf-8").removesuffix("\n").split("\n")
    if os.sep == "\\":  # paths of Windows
        actual, expected = [*map(as_on_linux, actual)], [*map(as_on_linux, expected)]
    pairs = zip_longest(expected, actual)
    alike = actual == expected if exact else all(None not in pair and _alike(*pair, rel, abs_) for pair in pairs)
    if not alike:
        different = list(unified_diff(expected, actual, n=0, lineterm=""))[2:]
        more = [f"... {len(different) - SHOWN} lines more"] if len(different) > SHOWN else []
        pytest.fail("\n".join([f"{golden_file}: review, then --regenerate", *different[:SHOWN], *more]), pytrace=False)


def check_kept(golden_file: Path, lines: Iterable[str]) -> None:
    """Compare lines and their numbers with a file that is only edited by hand."""
    actual, expected = list(lines), golden_file.read_text(encoding="utf-8").splitlines()
    if sys.platform == "win32":  # both, since the backslashes of other texts become slashes, too
        actual, expected = [[as_on_linux(line) for line in side] for side in (actual, expected)]
    if actual != expected:
        different = "\n".join(unified_diff(expected, actual, n=0, lineterm=""))
        pytest.fail(f"{golden_file}: review, then edit it\n{different}", pytrace=False)


def _alike(expected: str, actual: str, rel: float, abs_: float) -> bool:
    """Return whether lines are equal except for the last digits of numbers, which vary between machines."""
    if expected == actual:
        return True
    if NUMBER.sub("", expected) != NUMBER.sub("", actual):
        return False
    numbers = [[float(number) for number in NUMBER.findall(line)] for line in (expected, actual)]
    return numbers[0] == pytest.approx(numbers[1], rel=rel, abs=abs_)


def runs(lines: Iterable[str]) -> Iterator[str]:
    """Yield each run of equal lines once, with its length."""
    for line, same in groupby(lines):
        count = sum(1 for _ in same)
        yield line if count == 1 else f"{line} ({count} times)"


def what_comes(changes: Iterable[str]) -> Iterator[str]:
    """Yield the lines that come of those of ``changed``, and the lines between them, without their indentation."""
    for line in changes:
        if not line.startswith("- "):
            yield line.removeprefix("+ ").strip()


def note_changed_texts(before: Iterable[str], after: Iterable[str]) -> None:
    """Count the texts that lines no longer have, and those that they have now."""
    old, new = (Counter(text for line in lines for text in TEXT_ENDS.split(line) if text) for lines in (before, after))
    for sign, texts in (("-", old - new), ("+", new - old)):
        CHANGED.update({f"{sign} {text}": count for text, count in texts.items()})
