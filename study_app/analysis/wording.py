"""Format numbers, intervals, p values and lists for sentences and tables of the report.

Numbers have at most three significant digits, p values three decimals; report.json and tests.csv have all digits.
"""

import re
from collections.abc import Iterable, Sequence
from typing import Final, Protocol

from study_app.number_text import MINUS, exact_text
from study_app.protocol.model import Contrast

_DIGITS: Final = 3
"""Significant digits in sentences and table cells."""
_NUMBERS: Final = (
    *("no", "one", "two", "three", "four", "five", "six"),
    *("seven", "eight", "nine", "ten", "eleven", "twelve"),
)


_D_Z: Final = re.compile(r"\bd_z\b")


def with_d_z(text: str, symbol: str) -> str:
    """Return a text with d_z, the effect size, replaced by ``symbol``."""
    return _D_Z.sub(symbol, text)


class Ends(Protocol):
    """Anything with the ends of an interval."""

    @property
    def low(self) -> float:
        """Lower end."""

    @property
    def high(self) -> float:
        """Upper end."""


def counted(number: int, noun: str) -> str:
    """Return "three statements", "1 statement"."""
    text = _NUMBERS[number] if 1 < number < len(_NUMBERS) else str(number)
    return f"{text} {noun}" + ("" if number == 1 else "s")


def bound_text(bound: float) -> str:
    """Return "±1 point", "±0.5 points"."""
    return f"±{bound:g} {'point' if bound == 1 else 'points'}"


def all_of(number: int, noun: str) -> str:
    """Return "all three statements", "both statements", "the one statement"."""
    if number < 3:
        return f"the one {noun}" if number == 1 else f"both {noun}s"
    return f"all {counted(number, noun)}"


def number(value: float | None, decimals: int = 2) -> str:
    """Return a number with ``decimals`` decimals (at most `_DIGITS` digits) and a minus sign; a dash for None."""
    if value is None:
        return "–"
    whole = len(f"{abs(value):.0f}") if abs(value) >= 1 else 0
    text = f"{value:.{max(0, min(decimals, _DIGITS - whole))}f}"
    return "0" + text[2:] if text.strip("-0.") == "" and text.startswith("-") else text.replace("-", "−")


def significant(value: float) -> str:
    """Return a number with at most `_DIGITS` significant digits, without trailing zeros: 0.00305, 1.25, 1."""
    return exact_text(float(f"{value:.{_DIGITS}g}")).replace("-", MINUS)


def p_value(p: float | None) -> str:
    """Return a p value in the style of journals: .023, < .001, > .999; a dash for None."""
    if p is None:
        return "–"
    if p < 0.001:
        return "< .001"
    return "> .999" if p > 0.999 else f"{p:.3f}".removeprefix("0")


def p_equals(p: float) -> str:
    """Return a p value for a sentence: p = .023, p < .001, p > .999."""
    text = p_value(p)
    return f"p = {text}" if text.startswith(".") else f"p {text}"


def interval(ends: Ends | None, decimals: int = 2) -> str:
    """Return an interval in brackets; a dash for None."""
    return "–" if ends is None else f"[{number(ends.low, decimals)}, {number(ends.high, decimals)}]"


def percent(share: float) -> str:
    """Return a percentage with at most `_DIGITS` digits, never rounded to 0 or 100: 90 %, 95.8 %, > 99.9 %."""
    if 0.9995 <= share < 1:
        return "> 99.9 %"
    return "< 0.1 %" if 0 < share < 0.0005 else f"{significant(100 * share)} %"


def whole_percent(share: float) -> str:
    """Return a proportion in percent without decimals: 0 %, 96 %."""
    return f"{share:.0%}".replace("%", " %")


def listed(words: Sequence[str]) -> str:
    """Join words: "a, b and c"."""
    return " and ".join(words) if len(words) < 3 else f"{', '.join(words[:-1])} and {words[-1]}"


def with_group(name: str, group: str) -> str:
    """Return the heading of a group's answers: "Water – experts"; without a group, the name."""
    return f"{name} – {group}" if group else name


def ms(delay_ms: float) -> str:
    """Return a delay with its unit."""
    return f"{delay_ms:g} ms"


def inclusion_text(contrasts: Iterable[Contrast], *, in_report: bool = False) -> str:
    """Return sentences on which participants are compared, for power analysis, preregistration and report."""
    tested = list(contrasts)
    beyond = any(contrast.measure == "threshold" for contrast in tested)
    kinds = {contrast.within is None for contrast in tested}  # a comparison of groups alone has one value each
    values = {(): "both of their values are", (False,): "both of their values are", (True,): "their value is"}
    included = (
        f"Participants are included if {values.get(tuple(kinds), 'all of their compared values are')} available"
        f"{', even if a threshold lies outside the range of levels' * beyond}."
    )
    return included if in_report else f"{included} The report lists the excluded participants and the reasons."
