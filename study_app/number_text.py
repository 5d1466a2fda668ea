"""Numbers as people type them, as titles and ids contain them, and with what they count."""

import math
import re
from typing import Final

MINUS: Final = "\u2212"
_NUMBER: Final = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_APART: Final = re.compile(r"[\s;]+|,(?!\d)|(?<!\d),")
"""What separates numbers; a comma between two digits may also be a decimal comma."""
_PLAIN: Final = str.maketrans({" ": None, "\u00a0": None, "\u2009": None, "\u202f": None, MINUS: "-", ",": "."})


def number_of(text: str) -> int | float | None:
    """Return the number that a text says, with comma or point, real minus or hyphen, whole where it is written so."""
    plain = text.strip().translate(_PLAIN)
    if _NUMBER.fullmatch(plain) is None or not math.isfinite(found := float(plain)):
        return None
    return int(plain) if plain.lstrip("+-").isdecimal() else found


def typed_numbers(text: str, unit: str = "") -> list[tuple[str, int | float]]:
    """Return the numbers of a list as they are typed, with their values.

    They are separated by spaces, semicolons, lines, or commas with spaces; each may be followed by its unit.

    Raises
    ------
    ValueError
        There is no word, or one is not a number, or has a comma that may be decimal or separate two numbers.
    """
    words = [word for part in _APART.split(text) if (word := part.removesuffix(unit))]
    if not words:
        raise ValueError("Enter at least one number")
    commas = len(words) == 1 or any("," in apart for apart in _APART.findall(text.strip(" ,;\n")))
    found: list[tuple[str, int | float]] = []
    for word in words:
        if word.count(",") > (0 if commas else 1):
            raise ValueError(f"“{word}” may be one number or several: separate numbers by spaces or semicolons")
        if (value := number_of(word)) is None:
            raise ValueError(f"“{word}” is not a number")
        found.append((word, value))
    return found


def exact_text(value: float) -> str:
    """Return a number with every digit that it needs, without an exponent: "1000.0001", "0.00002"."""
    from decimal import Decimal  # noqa: PLC0415 - every command loads this module, few need it

    text = format(Decimal(repr(value + 0)), "f")
    return text.rstrip("0").rstrip(".") if "." in text else text


def counted(number: int, noun: str, plural: str = "") -> str:
    """Return "1 part", "2 parts"; ``plural`` is of a noun that has another one."""
    return f"{number} {noun}" if number == 1 else f"{number} {plural or noun + 's'}"
