"""Numbers and durations in words."""

import math

THIN_SPACE = "\u2009"


def minutes(seconds: float) -> str:
    """Return the time of a running clock: 68 s as "1:08"; an hour and more as "1:02:03"."""
    whole = max(0, int(seconds))
    hours, rest = divmod(whole, 3600)
    if hours:
        return f"{hours}:{rest // 60:02d}:{rest % 60:02d}"
    return f"{rest // 60}:{rest % 60:02d}"


def duration(seconds: float, *, tenths: bool = False) -> str:
    """Return about how long something takes: "45 s", "10 min", "1 h 05 min"; with ``tenths`` "0.6 s" below a minute."""
    if (whole := math.floor(seconds + 0.5)) < 60:
        return f"{seconds:.3g} s" if tenths else f"{max(0, whole)} s"
    hours, rest = divmod(math.floor(seconds / 60 + 0.5), 60)
    return f"{hours} h {rest:02d} min" if hours else f"{rest} min"


def duration_figure(seconds: float) -> tuple[str, str]:
    """Return a duration as its number and its unit: ("10", "min"), ("1 h 05", "min")."""
    number, unit = duration(seconds).rsplit(" ", 1)
    return number, unit


def exact_duration(least_s: float, most_s: float) -> str:
    """Return durations of the file as they are written there: "20 to 90 s", "2.5 s"; whole minutes as "2 min"."""
    (least, least_unit), (most, unit) = (
        (f"{one / 60:g}", "min") if one and one % 60 == most_s % 60 == 0 else (f"{one:.12g}", "s")
        for one in (least_s, most_s)
    )
    if least_s == most_s:
        return f"{most} {unit}"
    return f"{least} to {most} {unit}" if least_unit == unit else f"{least} {least_unit} to {most} {unit}"


def duration_range(least_s: float, most_s: float) -> str:
    """Return "15 to 32 min", "55 min to 1 h 10 min", or one duration where both read the same."""
    least, most = duration(least_s), duration(most_s)
    if least == most:
        return most
    number, unit = duration_figure(least_s)
    return f"{number} to {most}" if most.endswith(f" {unit}") and " h " not in most else f"{least} to {most}"


def grouped(number: int) -> str:
    """Return 45918 as "45 918" with a thin space."""
    return f"{number:,}".replace(",", THIN_SPACE)


def duration_words(seconds: float) -> str:
    """Return a lateness or age with the unit that suits it: "62 µs", "1.4 ms"."""
    micros = seconds * 1e6
    return f"{micros:.0f} µs" if micros < 1000 else f"{micros / 1000:.2g} ms"
