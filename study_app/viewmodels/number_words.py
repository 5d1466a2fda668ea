"""Numbers and durations in words."""

from __future__ import annotations

THIN_SPACE = "\u2009"


def minutes(seconds: float) -> str:
    """Return 68 s as "1:08"; an hour and more as "1:02:03"."""
    whole = max(0, int(seconds))
    hours, rest = divmod(whole, 3600)
    if hours:
        return f"{hours}:{rest // 60:02d}:{rest % 60:02d}"
    return f"{rest // 60}:{rest % 60:02d}"


def duration(seconds: float) -> str:
    """Return how long something takes, rounded: "45 s", "10 min", "1 h 05 min"; less than 90 s in whole seconds."""
    if seconds < 89.5:
        return f"{max(0, round(seconds))} s"
    hours, rest = divmod(round(seconds / 60), 60)
    return f"{hours} h {rest:02d} min" if hours else f"{rest} min"


def grouped(number: int) -> str:
    """Return 45918 as "45 918" with a thin space."""
    return f"{number:,}".replace(",", THIN_SPACE)


def duration_words(seconds: float) -> str:
    """Return a lateness or age with the unit that suits it: "62 µs", "1.4 ms"."""
    micros = seconds * 1e6
    return f"{micros:.0f} µs" if micros < 1000 else f"{micros / 1000:.2g} ms"
