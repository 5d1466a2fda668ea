"""Numbers as people type them, and as titles and ids contain them."""

from __future__ import annotations

import math
import re
from decimal import Decimal
from typing import Final

MINUS: Final = "\u2212"
_NUMBER: Final = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_PLAIN: Final = str.maketrans({" ": None, "\u00a0": None, "\u2009": None, "\u202f": None, MINUS: "-", ",": "."})


def number_of(text: str) -> int | float | None:
    """Return the number that a text says, with comma or point, real minus or hyphen, whole where it is written so."""
    plain = text.strip().translate(_PLAIN)
    if _NUMBER.fullmatch(plain) is None or not math.isfinite(found := float(plain)):
        return None
    return int(plain) if plain.lstrip("+-").isdecimal() else found


def exact_text(value: float) -> str:
    """Return a number with every digit that it needs, without an exponent: "1000.0001", "0.00002"."""
    text = format(Decimal(repr(value + 0)), "f")
    return text.rstrip("0").rstrip(".") if "." in text else text
