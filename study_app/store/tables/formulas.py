"""Texts that a spreadsheet would compute: with an apostrophe before them it shows them as they are.

Source: OWASP, "CSV Injection". Numbers are not texts: a negative number stays a number.
"""

import re
from typing import Final

COMPUTED: Final = "= + - @"
_FORMULA = re.compile("'*[=+\\-@\t\r＝＋－＠]")


def guarded(text: str) -> str:
    """Return a text for a cell, with an apostrophe first where a spreadsheet would compute it."""
    return f"'{text}" if _FORMULA.match(text) else text


def unguarded(cell: str) -> str:
    """Return the text that was `guarded`."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell
