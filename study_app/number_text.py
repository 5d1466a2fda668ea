"""Numbers as people type them, as titles and ids contain them, and with what they count."""

import math
import re
from typing import Final

MINUS: Final = "\u2212"
THIN_SPACE: Final = "\u2009"
_APART: Final = re.compile(r"[ \t\r\n;]+|,(?!\d)|(?<!\d),")
"""What separates numbers; a comma between two digits may also be a decimal comma."""
_THOUSANDS: Final = re.compile(r"[1-9]\d{0,2} 0\d\d")
_SPELLINGS: Final = str.maketrans(
    dict.fromkeys("\u00a0\u2007\u2009\u202f", " ")
    | dict.fromkeys("\u200e\u200f\u061c")
    | {MINUS: "-", "\u2019": "'", "\u066c": "'", "\u060c": ","}
)
_CONVENTIONS: Final = tuple(
    (
        decimal,
        rf"(?P<sign>[-+]?) ?(?P<whole>(?:\d+|[1-9]\d{{0,2}}(?:{re.escape(group)}\d{{3}})+)?)"
        rf"(?P<part>(?:{re.escape(decimal)}\d*)?)(?P<power>(?:[eE][-+]?\d+)?)",
    )
    for decimal in (".", ",", "\u066b")
    for group in (" ", "'", ".", ",")
    if group != decimal
)


def number_of(text: str, decimal_sign: str = ".") -> int | float | None:
    """Return the number in a text, as an int if it is written so; None if there is none or it is ambiguous.

    The decimal sign may be a point, a comma or the Arabic one, the digits those of any script, the sign a minus or a
    hyphen; groups of three digits may be separated. ``decimal_sign`` is that of the page's language.
    """
    numbers = readings_of(text, decimal_sign)
    return numbers[0] if len(numbers) == 1 else None


def readings_of(text: str, decimal_sign: str = ".") -> tuple[int | float, ...]:
    """Return the possible numbers in a text, none to two, the smaller first: "2,500" is 2.5 or 2500.

    A single comma or point followed by three digits is a decimal sign or separates thousands, unless it is the
    ``decimal_sign`` of the page's language, or the part before it cannot be thousands, as in "0,500".
    """
    plain = "".join(str(int(letter)) if letter.isdecimal() else letter for letter in text.strip().translate(_SPELLINGS))
    numbers: dict[float, int | float] = {}
    for decimal, convention in _CONVENTIONS:
        if (match := re.fullmatch(convention, plain)) is None or not re.search(r"\d", match["whole"] + match["part"]):
            continue
        whole, part = re.sub(r"\D", "", match["whole"]), match["part"].replace(decimal, ".")
        value = float(f"{match['sign']}{whole}{part}{match['power']}")
        if not math.isfinite(value):
            return ()
        if decimal == decimal_sign and part:
            return (value,)
        numbers.setdefault(value, value if part or match["power"] else int(match["sign"] + whole))
    return tuple(sorted(numbers.values(), key=abs))


def unclear_number(text: str) -> str:
    """Return why a text in an English window is rejected as a number, without a full stop."""
    if len(numbers := readings_of(text)) == 2:
        either = " or ".join(exact_text(number) for number in numbers)
        return f"“{text}” can be read as {either}: write {either}"
    return f"“{text}” is not a number"


def typed_numbers(text: str, unit: str = "") -> list[tuple[str, int | float]]:
    """Return the numbers of a list as typed, with their values.

    They are separated by spaces, semicolons, lines, or commas with spaces; each may be followed by its unit.
    Non-breaking spaces, as in "45 918", separate thousands.

    Raises
    ------
    ValueError
        The list is empty, a word is not a number, or a comma or space could be within a number or between two.
    """
    words = [word for part in _APART.split(text) if (word := part.removesuffix(unit))]
    if not words:
        raise ValueError("Enter at least one number")
    commas = len(words) == 1 or any("," in apart for apart in _APART.findall(text.strip(" ,;\n")))
    numbers: list[tuple[str, int | float]] = []
    for before, word in zip(["", *words], words, strict=False):
        if _THOUSANDS.fullmatch(both := f"{before} {word}"):
            raise ValueError(
                f"“{both}” could be read as one number or two: write {before}{word} or {before} {int(word)}"
            )
        if word.count(",") > (0 if commas else 1):
            raise ValueError(
                f"“{word}” could be read as one number or several: separate numbers with spaces or semicolons"
            )
        if (value := number_of(word)) is None:
            raise ValueError(unclear_number(word))
        numbers.append((word, value))
    return numbers


def exact_text(value: float) -> str:
    """Return a number with all necessary digits, without an exponent: "1000.0001", "0.00002"."""
    from decimal import Decimal  # noqa: PLC0415 - every command loads this module, few need it

    text = format(Decimal(repr(value + 0)), "f")
    return text.rstrip("0").rstrip(".") if "." in text else text


def counted(number: int, noun: str, plural: str = "") -> str:
    """Return a count with its noun: "1 part", "2 parts"; pass ``plural`` if it is irregular."""
    return f"{number} {noun}" if number == 1 else f"{number} {plural or noun + 's'}"


def capitalised(words: str) -> str:
    """Return a text with a capital first letter; the other letters are unchanged."""
    return words[:1].upper() + words[1:]


def clock_text(seconds: float) -> str:
    """Return a duration as on a clock: 68 s as "1:08"; an hour or more as "1:02:03"."""
    whole = max(0, int(seconds))
    hours, rest = divmod(whole, 3600)
    if hours:
        return f"{hours}:{rest // 60:02d}:{rest % 60:02d}"
    return f"{rest // 60}:{rest % 60:02d}"


def duration(seconds: float, *, tenths: bool = False) -> str:
    """Return an approximate duration: "45 s", "10 min", "1 h 05 min"; with ``tenths`` "0.6 s" below a minute."""
    if (whole := math.floor(seconds + 0.5)) < 60:
        return f"{seconds:.3g} s" if tenths else f"{max(0, whole)} s"
    hours, rest = divmod(math.floor(seconds / 60 + 0.5), 60)
    return f"{hours} h {rest:02d} min" if hours else f"{rest} min"


def duration_figure(seconds: float) -> tuple[str, str]:
    """Return a duration as its number and its unit: ("10", "min"), ("1 h 05", "min")."""
    number, unit = duration(seconds).rsplit(" ", 1)
    return number, unit


def exact_duration(least_s: float, most_s: float) -> str:
    """Return durations of the file in its notation: "20 to 90 s", "2.5 s"; whole minutes as "2 min"."""
    (minimum, least_unit), (maximum, unit) = (
        (f"{one / 60:g}", "min") if one and one % 60 == most_s % 60 == 0 else (f"{one:.12g}", "s")
        for one in (least_s, most_s)
    )
    if least_s == most_s:
        return f"{maximum} {unit}"
    return f"{minimum} to {maximum} {unit}" if least_unit == unit else f"{minimum} {least_unit} to {maximum} {unit}"


def duration_range(least_s: float, most_s: float) -> str:
    """Return "15 to 32 min", "55 min to 1 h 10 min", or one duration if both read the same."""
    minimum, maximum = duration(least_s), duration(most_s)
    if minimum == maximum:
        return maximum
    number, unit = duration_figure(least_s)
    return (
        f"{number} to {maximum}" if maximum.endswith(f" {unit}") and " h " not in maximum else f"{minimum} to {maximum}"
    )


def grouped(number: int) -> str:
    """Return 45918 as "45 918" with a thin space."""
    return f"{number:,}".replace(",", THIN_SPACE)


def duration_text(seconds: float) -> str:
    """Return a short time with a suitable unit: "62 µs", "1.4 ms"."""
    micros = seconds * 1e6
    return f"{micros:.0f} µs" if micros < 1000 else f"{micros / 1000:.2g} ms"
