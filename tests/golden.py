"""Outputs as lines of text, compared with reviewed files: ``python -m pytest FILE --regenerate`` writes these anew.

To review what was written: commit everything else first, then read ``git diff -U0`` of the folder.
Every changed line must follow from the change of the program; one that you cannot explain is a fault.
A change of one window changes several files. List each changed line once, with the count of its places, by
``git diff -U0 tests/gui/golden | grep '^[-+]' | sort | uniq -c``; read in full only the file named after the window.
In a transcript, "+" and "-" tell what a step changed: what merely moved to another step is in the list twice.
Lines that tell numbers of a whole table or figure (count, ends, sums) change with any cell: find it in the output.
Regenerate windows with the Qt of ``tests/gui/golden/qt_version``; commit texts and program together.
"""

import re
from collections.abc import Iterable
from difflib import unified_diff
from itertools import zip_longest
from pathlib import Path

import pytest

CHANGING = re.compile(
    r"\d{4}-\d\d-\d\d(?:[T ]\d\d:\d\d(?::\d\d(?:\.\d+)?)?(?:Z|[+-]\d\d:\d\d)?)?"
    r"|\b\d+\.\d+\.\d+\b|\b(?<!\.)[0-9a-f]{12,}\b|\b[a-z2-7]{4}-[a-z2-7]{4}-[a-z2-7]{4}(?:-[a-z2-7]{2})?\b"
)
"""Dates, versions, hashes and fingerprints."""
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
SHOWN = 40
"""Most lines of a difference that are printed."""


def compare(
    kept: Path,
    lines: Iterable[str],
    config: pytest.Config,
    *,
    mask: re.Pattern[str] | None = None,
    rel: float = 1e-5,
    abs_: float = 1e-9,
    exact: bool = False,
) -> None:
    """Compare lines with a golden file, or write it.

    What ``mask`` matches is left out; numbers may differ a little, or as they are written, unless ``exact``.
    """
    found = "\n".join(lines).split("\n")
    assert any(found), f"{kept} is compared with nothing"
    if mask is not None:
        found = [mask.sub("*", line) for line in found]
    if config.getoption("regenerate"):
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text("\n".join(found) + "\n", encoding="utf-8")
    expected = kept.read_text(encoding="utf-8").removesuffix("\n").split("\n")
    pairs = zip_longest(expected, found)
    alike = found == expected if exact else all(None not in pair and _alike(*pair, rel, abs_) for pair in pairs)
    if not alike:
        different = list(unified_diff(expected, found, n=0, lineterm=""))[2:]
        more = [f"... {len(different) - SHOWN} lines more"] if len(different) > SHOWN else []
        pytest.fail("\n".join([f"{kept}: review, then --regenerate", *different[:SHOWN], *more]), pytrace=False)


def _alike(expected: str, found: str, rel: float, abs_: float) -> bool:
    """Return whether lines are equal but for the last digits of numbers, which depend on libraries and processors."""
    if expected == found:
        return True
    if NUMBER.sub("", expected) != NUMBER.sub("", found):
        return False
    numbers = [[float(number) for number in NUMBER.findall(line)] for line in (expected, found)]
    return numbers[0] == pytest.approx(numbers[1], rel=rel, abs=abs_)
